// How fast frames are decoded and sorted on one core, of some streams: node speed.mjs IN.gss... [--native PROGRAM]. Prints
// nanoseconds of processor time per Gaussian, and frames a second; PROGRAM is the example `page_speed` of the crate
// splatstream-wasm, the same work compiled for this machine, and adds how fast this is beside it.
import { execFileSync } from 'node:child_process';
import { readFileSync } from 'node:fs';
import { Decoder, loadModule } from '../decoder/index.js';

/** Rounds, of which the fastest counts. */
const ROUNDS = 5;
const words = process.argv.slice(2);
const at = words.indexOf('--native');
const native = at < 0 ? null : words.splice(at, 2)[1];

/** Processor time of this process, milliseconds. */
function processor() {
  const { user, system } = process.cpuUsage();
  return (user + system) / 1000;
}

/** Decodes the stream once, from its start; milliseconds of decoding, packing and sorting, Gaussians and frames. */
function round(decoder) {
  decoder.seek(0);
  const times = { decode: 0, pack: 0, sort: 0, gaussians: 0, frames: 0 };
  for (;;) {
    const start = processor();
    const frame = decoder.next();
    if (frame.isEnd) return times;
    const decoded = processor();
    decoder.show();
    const packed = processor();
    decoder.sort([0, 0, -5], [0, 0, 1]);
    times.decode += decoded - start;
    times.pack += packed - decoded;
    times.sort += processor() - packed;
    times.gaussians += frame.gaussians;
    times.frames += 1;
  }
}

const total = ({ decode, pack, sort }) => decode + pack + sort;

const module = await loadModule();
for (const path of words) {
  const decoder = new Decoder(module);
  decoder.push(readFileSync(path));
  decoder.end();
  const rounds = Array.from({ length: ROUNDS }, () => round(decoder));
  const best = rounds.reduce((one, other) => (total(other) < total(one) ? other : one));
  const each = (milliseconds) => (1e6 * milliseconds) / best.gaussians;
  const parts = ['decode', 'pack', 'sort'].map((part) => `${part} ${each(best[part]).toFixed(0)}`).join(', ');
  const rate = ((1000 * best.frames) / total(best)).toFixed(1);
  let line = `${path}: ${Math.round(best.gaussians / best.frames)} Gaussians; ns per Gaussian: ${parts}; ${rate} frames a second`;
  if (native) {
    const [decode, all] = execFileSync(native, [path], { encoding: 'utf8', env: { ...process.env, RAYON_NUM_THREADS: '1' } }).split(' ').map(Number);
    line += `; native decode ${decode.toFixed(0)}, all ${all.toFixed(0)}: this has ${((100 * decode) / each(best.decode)).toFixed(0)} % of its speed in decoding`;
  }
  console.log(line);
}
