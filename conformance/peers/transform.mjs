// Converts frames with splat-transform, in memory and on one thread; with `decode`, there and back to PLY.
// Standard input is a job, the last line of the output is its result.
import { readFileSync, writeFileSync } from 'node:fs';
import { basename, dirname, join } from 'node:path';
import { pathToFileURL } from 'node:url';
import { timed } from './clock.mjs';

const job = JSON.parse(readFileSync(0));
const splat = await import(pathToFileURL(job.module));
splat.WorkerQueue.maxWorkers = 0;

const result = job.info ? await info(job.info) : await convertAll();
console.log(JSON.stringify(result));

async function info(path) {
  const name = basename(path);
  const read = { filename: name, inputFormat: splat.getInputFormat(name), fileSystem: files(path) };
  return { gaussians: (await splat.readFileInfo(read)).numGaussians };
}

async function convertAll() {
  const total = { bytes: 0, encode_s: 0, decode_s: 0 };
  for (const frame of job.frames) {
    const input = files(frame.in);
    const [coded, encode_s] = await timed(job.repeat, () => convert(input, basename(frame.in), `frame.${job.suffix}`));
    total.bytes += coded.length;
    total.encode_s += encode_s;
    let written = coded;
    if (job.decode) {
      const memory = new splat.MemoryReadFileSystem();
      memory.set(`frame.${job.suffix}`, coded);
      const [decoded, decode_s] = await timed(job.repeat, () => convert(memory, `frame.${job.suffix}`, 'decoded.ply'));
      total.decode_s += decode_s;
      written = decoded;
    }
    writeFileSync(frame.out, written);
  }
  return total;
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
