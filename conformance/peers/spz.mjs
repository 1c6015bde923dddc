// Codes frames with @adobe/spz, in memory. Standard input is a job, the last line of the output is its result. With the
// name of a file that holds the job, it encodes or decodes whenever standard input says so.
import { readFileSync, writeFileSync } from 'node:fs';
import { pathToFileURL } from 'node:url';
import { serve, timed } from './clock.mjs';

const job = JSON.parse(readFileSync(process.argv[2] ?? 0));
const { default: createSpzModule } = await import(pathToFileURL(job.module));
const spz = await createSpzModule({ print: () => {} });
const { RDF } = spz.CoordinateSystem;
const shValues = 3 * ((job.degree + 1) ** 2 - 1);
const clouds = job.frames.map(cloud);

const pack = (c) => spz.saveSpzToBuffer(c, { from: RDF, ...job.pack });
const unpack = (bytes) => spz.loadSpzFromBuffer(bytes, { to: RDF });
const bytes = (packed) => packed.reduce((sum, part) => sum + part.length, 0);
const gaussians = (unpacked) => unpacked.reduce((sum, c) => sum + c.numPoints, 0);
await (process.argv[2] ? answer() : once());

async function once() {
  const [packed, encode_s] = await timed(job.repeat, () => clouds.map(pack));
  const [unpacked, decode_s] = await timed(job.repeat, () => packed.map(unpack));
  unpacked.forEach((c, i) => writeFileSync(job.frames[i].out, flat(c)));
  console.log(JSON.stringify({ bytes: bytes(packed), gaussians: gaussians(unpacked), encode_s, decode_s }));
}

async function answer() {
  let packed = [];
  const encode = () => {
    packed = clouds.map(pack);
    return { bytes: bytes(packed) };
  };
  const decode = () => ({ gaussians: gaussians(packed.map(unpack)) });
  await serve({ encode, decode });
}

function cloud({ in: path, count }) {
  const bytes = readFileSync(path);
  let at = bytes.byteOffset;
  const take = (width) => {
    const part = new Float32Array(bytes.buffer.slice(at, at + 4 * width * count));
    at += 4 * width * count;
    return part;
  };
  return {
    numPoints: count, shDegree: job.degree, antialiased: false, extensions: [],
    positions: take(3), scales: take(3), rotations: take(4), alphas: take(1), colors: take(3), sh: take(shValues),
  };
}

function flat(c) {
  const parts = [c.positions, c.scales, c.rotations, c.alphas, c.colors, c.sh];
  return Buffer.concat(parts.map((p) => Buffer.from(p.buffer, p.byteOffset, p.byteLength)));
}
