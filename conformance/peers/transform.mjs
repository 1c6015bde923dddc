// Converts frames with splat-transform, in memory and on one thread; with `decode`, there and back to PLY.
// Standard input is a job, the last line of the output is its result. With the name of a file that holds the job, it encodes
// or decodes all frames whenever standard input says so.
import { readFileSync, writeFileSync } from 'node:fs';
import { basename, dirname, join } from 'node:path';
import { pathToFileURL } from 'node:url';
import { serve, timed } from './clock.mjs';

const job = JSON.parse(readFileSync(process.argv[2] ?? 0));
const splat = await import(pathToFileURL(job.module));
splat.WorkerQueue.maxWorkers = 0;

if (process.argv[2]) {
  await answer();
} else {
  const result = job.info ? await info(job.info) : await convertAll();
  console.log(JSON.stringify(result));
}

async function info(path) {
  const name = basename(path);
  const read = { filename: name, inputFormat: splat.getInputFormat(name), fileSystem: files(path) };
  return { gaussians: (await splat.readFileInfo(read)).numGaussians };
}

async function convertAll() {
  const total = { bytes: 0, encode_s: 0, decode_s: 0 };
  for (const frame of job.frames) {
    const [coded, encode_s] = await timed(job.repeat, encoder(frame));
    total.bytes += coded.length;
    total.encode_s += encode_s;
    let written = coded;
    if (job.decode) {
      const [decoded, decode_s] = await timed(job.repeat, decoder(coded));
      total.decode_s += decode_s;
      written = decoded;
    }
    writeFileSync(frame.out, written);
  }
  return total;
}

async function answer() {
  const encoders = job.frames.map(encoder);
  let coded = [];
  const all = async (works) => {
    const results = [];
    for (const work of works) results.push(await work());
    return results;
  };
  const encode = async () => {
    coded = await all(encoders);
    return { bytes: coded.reduce((sum, part) => sum + part.length, 0) };
  };
  const decode = async () => {
    await all(coded.map(decoder));
    return {};
  };
  await serve({ encode, decode });
}

function encoder(frame) {
  const input = files(frame.in);
  return () => convert(input, basename(frame.in), `frame.${job.suffix}`);
}

function decoder(coded) {
  const memory = new splat.MemoryReadFileSystem();
  memory.set(`frame.${job.suffix}`, coded);
  return () => convert(memory, `frame.${job.suffix}`, 'decoded.ply');
}

async function convert(input, from, to) {
  const [source] = await splat.readFile({ filename: from, inputFormat: splat.getInputFormat(from), fileSystem: input });
  const output = new splat.MemoryFileSystem();
  const pool = splat.createChunkDataPool();
  const outputFormat = splat.getOutputFormat(to, {});
  await splat.writeSource({ filename: to, outputFormat, source, pool, options: job.options }, output);
  source.close();
  return output.results.get(to);
}

// The file, or for a meta.json also the images it names.
function files(path) {
  const memory = new splat.MemoryReadFileSystem();
  const bytes = readFileSync(path);
  memory.set(basename(path), bytes);
  if (basename(path) === 'meta.json') {
    const images = Object.values(JSON.parse(bytes)).flatMap((part) => part.files ?? []);
    images.forEach((name) => memory.set(name, readFileSync(join(dirname(path), name))));
  }
  return memory;
}
