// The decoder in the thread that calls it: bytes in, frames as texels out. `worker.js` runs it beside a page; programs of
// Node use it as it is.

import { bytesOf } from './bytes.js';

const VERSION = 2;
const DONE = 0, NEED_BYTES = 1, END = 2, INCOMPLETE = 3;
/** Bytes that are handed to the decoder at a time. */
const PIECE = 1 << 20;
/** Gaussians in a row of a texture, and words of a Gaussian in the base texture. */
export const ROW = 512;
const BASE_WORDS = 8;
/** Words of a Gaussian in the texture of spherical harmonics, by their degree. */
const SH_WORDS = [0, 8, 12, 24];

/** A module with an instruction of 128 bits: i8x16.splat of 0, dropped. */
const SIMD_PROBE = new Uint8Array([0, 97, 115, 109, 1, 0, 0, 0, 1, 4, 1, 96, 0, 0, 3, 2, 1, 0, 10, 9, 1, 7, 0, 65, 0, 253, 15, 26, 11]);

/** Whether this engine has the instructions that the faster module uses. */
export const hasSimd = () => WebAssembly.validate(SIMD_PROBE);

/** The module for this engine, from the files beside this one: for streams, or for packages too. */
export async function loadModule({ packages = false } = {}) {
  const url = new URL(`./splatstream${packages ? '-packages' : ''}${hasSimd() ? '' : '-plain'}.wasm`, import.meta.url);
  if (url.protocol === 'file:') {
    const { readFile } = await import('node:fs/promises');
    return WebAssembly.compile(await readFile(url));
  }
  const response = await fetch(url);
  if (!response.ok) throw new Error(`${url}: ${response.status} ${response.statusText}`);
  return WebAssembly.compile(await response.arrayBuffer());
}

/** Decodes one stream. */
export class Decoder {
  #exports;
  /** What was shown last, but for the rows of its textures. */
  #shown = null;

  constructor(module) {
    this.#exports = new WebAssembly.Instance(module, {}).exports;
    if (this.#exports.gss_version() !== VERSION) throw new Error('the WebAssembly module belongs to another version');
  }

  /** A decoder with the module for this engine. */
  static async load() {
    return new Decoder(await loadModule());
  }

  /** Bytes of memory that the decoder has taken. */
  get memory() {
    return this.#exports.memory.buffer.byteLength;
  }

  /** Takes the next bytes of the stream: an ArrayBuffer, or a view of one. */
  push(given) {
    const bytes = bytesOf(given);
    for (let at = 0; at < bytes.length; at += PIECE) {
      const piece = bytes.subarray(at, at + PIECE);
      const room = this.#exports.gss_room(piece.length);
      if (room === 0) throw new Error('the stream is longer than the decoder keeps, or there is no memory');
      new Uint8Array(this.#exports.memory.buffer, room, piece.length).set(piece);
      this.#exports.gss_filled(piece.length);
    }
  }

  /** No more bytes will come. */
  end() {
    this.#exports.gss_end();
  }

  /** Decodes the next frame: see Frame in index.d.ts. `null` if more bytes have to come first. */
  next() {
    const status = this.#exports.gss_next();
    const warnings = this.#text().split('\n').filter(Boolean);
    if (status === NEED_BYTES) return null;
    if (status === END || status === INCOMPLETE) return { isEnd: true, warnings };
    if (status !== DONE) throw new Error(this.#text());
    const [index, time, gaussians, carried, refinements, isKeyframe, spatial, temporal, refinement, hasDigest, high, low, bytes, until, isJump] =
      this.#numbers();
    const digest = hasDigest ? hex(high) + hex(low) : null;
    const point = { spatial, temporal, refinement };
    return { isEnd: false, index, time, gaussians, carried, refinements, isKeyframe: isKeyframe === 1, point, digest, bytes, until, isJump: isJump === 1, warnings };
  }

  /** Puts the frame that was decoded last into the textures: see Update in index.d.ts. */
  show() {
    this.#check(this.#exports.gss_show());
    const [slots, isNew, shDegree, isAntialiased, kept, appeared, disappeared] = this.#numbers();
    this.#shown = { slots, isNew: isNew === 1, shDegree, isAntialiased: isAntialiased === 1, kept, appeared, disappeared };
    return { ...this.#shown, base: this.#changed(0, ROW * BASE_WORDS), sh: this.#changed(1, ROW * SH_WORDS[shDegree]) };
  }

  /** All rows of the textures as they are after `show`, for those whose GPU has lost them; null before that. */
  whole() {
    if (this.#shown === null) return null;
    const { slots, shDegree } = this.#shown;
    const rows = slots / ROW;
    const base = [this.#rows(0, ROW * BASE_WORDS, 0, rows)];
    const sh = shDegree > 0 ? [this.#rows(1, ROW * SH_WORDS[shDegree], 0, rows)] : [];
    return { ...this.#shown, isNew: true, base, sh };
  }

  /** Sorts for a camera: the slots to draw, farthest first, and the depth from which they are drawn. */
  sort([x, y, z], [aheadX, aheadY, aheadZ]) {
    const count = this.#exports.gss_sort(x, y, z, aheadX, aheadY, aheadZ);
    const slots = new Uint32Array(this.#exports.memory.buffer, this.#exports.gss_order(), count).slice();
    return { slots, near: this.#exports.gss_near() };
  }

  /** Goes to a frame: the next one has this index, or a higher one where that is missing. */
  seek(index) {
    this.#check(this.#exports.gss_seek(index));
  }

  /** Changes the operating point, from the next GOP on, and where it is lower on some axis, from the next frame on. */
  setPoint({ spatial = 255, temporal = 255, refinement = 255 }) {
    this.#exports.gss_set_point(spatial, temporal, refinement);
  }

  /** What the stream says of itself, once a frame has come: see Description in index.d.ts. */
  describe() {
    if (this.#exports.gss_describe() !== DONE) return null;
    const title = this.#text();
    const [frames, frameSeconds, spatial, temporal, refinement, up, hasBackground, red, green, blue, ...poses] = this.#numbers();
    const cameras = [];
    for (let at = 0; at + 8 <= poses.length; at += 8) {
      const [x, y, z, a, b, c, d, field] = poses.slice(at, at + 8);
      cameras.push({ position: [x, y, z], rotation: [a, b, c, d], field });
    }
    const background = hasBackground ? [red, green, blue] : null;
    const upAxis = ['unknown', '+x', '-x', '+y', '-y', '+z', '-z'][up];
    return { title, frames, frameSeconds, highest: { spatial, temporal, refinement }, upAxis, background, cameras };
  }

  /** Whether the module plays packages. */
  get hasPackages() {
    return 'gss_package_open' in this.#exports;
  }

  /** Opens the package with a manifest. All that follows here is for packages: `Fetcher` calls it. */
  openPackage(manifest, now) {
    if (!this.hasPackages) throw new Error('this page plays streams, not packages');
    this.#write(manifest);
    this.#check(this.#exports.gss_package_open(1000 * now));
  }

  /** Takes the manifest as it is now; throws if it is that of another package. */
  renewPackage(manifest) {
    this.#write(manifest);
    this.#check(this.#exports.gss_package_renew());
  }

  /** Takes the manifest of a presentation that grows, read beside playback; throws if nothing more can be played. */
  polledPackage(manifest) {
    this.#write(manifest);
    this.#check(this.#exports.gss_package_polled(1));
  }

  /** The manifest of a presentation that grows could not be read; throws if nothing more can be played. */
  unreadablePackage(message) {
    this.#write(new TextEncoder().encode(message));
    this.#check(this.#exports.gss_package_polled(0));
  }

  /** Says what time it is, in milliseconds. */
  clock(now) {
    this.#exports.gss_package_clock(1000 * now);
  }

  /** What to do now: wait, fetch, abandon, read the manifest again, or do that beside all else. */
  decide() {
    const type = ['wait', 'fetch', 'abandon', 'manifest', 'poll'][this.#exports.gss_package_decide()];
    const numbers = this.#numbers();
    if (type === 'wait') return { type, until: numbers[0] / 1000 };
    const names = this.#text().split('\n').filter(Boolean);
    return { type, requests: names.map((file, at) => ({ file, offset: numbers[2 * at], size: numbers[2 * at + 1] })) };
  }

  /** A request is sent. */
  sent() {
    this.#exports.gss_package_sent();
  }

  /** Its response begins. */
  begun() {
    this.#exports.gss_package_begun();
  }

  /** Bytes of the response have come; whether they are what was packaged. */
  received(bytes) {
    this.#write(bytes);
    return this.#exports.gss_package_received() === 1;
  }

  /** The requests have failed: see Fault of `fetcher.js`. */
  failed({ kind, value = 0, message = '' }) {
    this.#write(new TextEncoder().encode(message));
    this.#exports.gss_package_failed(kind, value);
  }

  /** Whether what was requested is still wanted. */
  get isFetching() {
    return this.#exports.gss_package_is_fetching() === 1;
  }

  /** Whether the frame that was given last can be had better. */
  get isBetter() {
    return this.#exports.gss_package_is_better() === 1;
  }

  /** Whether nothing is missing that would make that frame better. */
  get isBest() {
    return this.#exports.gss_package_is_best() === 1;
  }

  /** Playback moves at a speed, or stands still at 0. */
  run(speed) {
    this.#exports.gss_package_run(Math.round(1000 * speed));
  }

  /** What is known of playback: see PackageState in index.d.ts. */
  packageState() {
    this.#exports.gss_package_report();
    const [isWaiting, gop, buffer, throughput, latency, stalls, stalled, bytes, requests, failures, abandoned, ...rest] = this.#numbers();
    const [spatial, temporal, refinement, quality, rate, buffered, isLive, first, frames, edge, isBehind, delay, pace] = rest;
    const point = spatial < 0 ? null : { spatial, temporal: temporal < 0 ? null : temporal, refinement };
    const counts = { stalls, stalled, bytes, requests, failures, abandoned };
    const live = { isLive: isLive === 1, first, frames, edge, isBehind: isBehind === 1, delay: delay < 0 ? null : delay, pace };
    return { isWaiting: isWaiting === 1, gop, buffer, buffered, throughput, latency, point, quality, rate, ...counts, ...live };
  }

  /** Hands bytes to the next call. */
  #write(bytes) {
    const room = this.#exports.gss_package_room(bytes.length);
    if (room === 0) throw new Error('there is no memory');
    new Uint8Array(this.#exports.memory.buffer, room, bytes.length).set(bytes);
  }

  #check(status) {
    if (status !== DONE) throw new Error(this.#text() || 'there is no frame');
  }

  /** The rows of a texture that have changed, one copy for each run of rows. */
  #changed(texture, rowWords) {
    const { buffer } = this.#exports.memory;
    const runs = new Uint32Array(buffer, this.#exports.gss_dirty(texture), this.#exports.gss_dirty_length(texture));
    const changed = [];
    for (let at = 0; at < runs.length; at += 2) changed.push(this.#rows(texture, rowWords, runs[at], runs[at + 1]));
    return changed;
  }

  /** A copy of rows of a texture. */
  #rows(texture, rowWords, row, end) {
    const start = this.#exports.gss_texels(texture) + 4 * row * rowWords;
    const words = new Uint32Array(this.#exports.memory.buffer, start, (end - row) * rowWords).slice();
    return { row, rows: end - row, words };
  }

  #numbers() {
    const at = this.#exports.gss_numbers();
    return [...new Float64Array(this.#exports.memory.buffer, at, this.#exports.gss_numbers_length())];
  }

  #text() {
    const at = this.#exports.gss_text();
    return new TextDecoder().decode(new Uint8Array(this.#exports.memory.buffer, at, this.#exports.gss_text_length()));
  }
}

const hex = (half) => half.toString(16).padStart(8, '0');
