// What the tests run with: the command, a moving scene with three GOPs, and what the native decoder says of it.
import { execFileSync } from 'node:child_process';
import { existsSync, mkdirSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';

const { SPLATSTREAM: command, WEB_TESTS: folder } = process.env;
if (!command || !folder) throw new Error('set SPLATSTREAM to the command, and WEB_TESTS to a folder for files');
mkdirSync(folder, { recursive: true });

/** A path in the folder of the tests. */
export const at = (...names) => join(folder, ...names);

/** Runs the command; gives what it prints. */
export const splatstream = (...words) => execFileSync(command, words, { encoding: 'utf8', stdio: ['ignore', 'pipe', 'pipe'], maxBuffer: 1 << 28 });

/** Frames of a GOP of the scene, and of the scene. */
export const GOP = 8;
export const FRAMES = 24;
export const POINTS = ['s0,t0,r0', 's0,t1,r1', 's1,t1,r2'];

const scene = at('scene', 'demo.gss');
if (!existsSync(scene)) splatstream('demo', '--out', at('scene'), '--gaussians', '4000', '--frames', String(FRAMES));
export const stream = readFileSync(scene);
export const streamPath = scene;

/** Digests that the native decoder gives of a stream, frame by frame. */
export function nativeDigests(point, path = scene) {
  const out = at('frames');
  rmSync(out, { recursive: true, force: true });
  const report = JSON.parse(splatstream('decode', path, '-o', out, '--op', point, '--json'));
  return report.digests;
}

/** What a text such as s0,t1,r2 names. */
export function pointOf(text) {
  const [spatial, temporal, refinement] = text.match(/\d+/g).map(Number);
  return { spatial, temporal, refinement };
}

/** The stream with damage in the middle of a frame of the second GOP. */
export function damaged() {
  const bytes = Uint8Array.from(stream);
  const place = Math.floor(bytes.length * 0.55);
  for (let offset = 0; offset < 40; offset++) bytes[place + offset] ^= 0xa5;
  return bytes;
}

/** Cameras around the scene, at a height of so many lines, in the form that the command reads. */
export function writeCameras(cameras, width, height) {
  const entries = cameras.map(({ position, axes, field }, id) => ({
    id, img_name: `view_${id}`, width, height, position,
    // Columns are the axes of the camera in the world.
    rotation: [0, 1, 2].map((row) => axes.map((axis) => axis[row])),
    fx: (0.5 * height) / Math.tan(0.5 * field), fy: (0.5 * height) / Math.tan(0.5 * field),
  }));
  writeFileSync(at('cameras.json'), JSON.stringify(entries));
  return at('cameras.json');
}
