// A package of the scene of the tests, a network that is made up, and a worker in this thread.
import { spawn } from 'node:child_process';
import { setMaxListeners } from 'node:events';
import { existsSync, readFileSync, readdirSync, rmSync } from 'node:fs';
import { Decoder, DecoderWorker } from '../decoder/index.js';
import { at, nativeDigests, pointOf, splatstream, writeCameras } from './setting.mjs';

/** Frames of the scene, which has GOPs of 8. */
export const FRAMES = 96;

const path = at('long', 'demo.gss');
export const packagedPath = path;
if (!existsSync(path)) splatstream('demo', '--out', at('long'), '--gaussians', '1500', '--frames', String(FRAMES));
const folder = at('package');
if (!existsSync(folder)) splatstream('package', path, '-o', folder, '--quality');

/** The files of the package by their names. */
export const files = new Map(readdirSync(folder).map((name) => [name, readFileSync(`${folder}/${name}`)]));
export const packageFolder = folder;

/** The manifest, in which a frame lasts so many milliseconds. */
export function manifestAt(milliseconds) {
  const manifest = JSON.parse(files.get('manifest.json'));
  Object.assign(manifest.stream, { ticks_per_second: 1000, ticks_per_frame: milliseconds });
  return manifest;
}

let started = 0;
const known = new Map();

/** Digests of a point by display index: those of the native decoder, of the scene or of another stream. */
export async function digestsAt({ spatial, temporal, refinement }, of = path) {
  const name = `s${spatial},t${temporal},r${refinement}`;
  const key = `${of} ${name}`;
  if (!known.has(key)) {
    const decoder = await Decoder.load();
    decoder.setPoint(pointOf(name));
    decoder.push(readFileSync(of));
    decoder.end();
    const indices = [];
    for (let frame = decoder.next(); !frame.isEnd; frame = decoder.next()) indices.push(frame.index);
    const native = nativeDigests(name, of);
    if (native.length !== indices.length) throw new Error(`${name}: ${native.length} frames, not ${indices.length}`);
    known.set(key, new Map(indices.map((index, place) => [index, native[place]])));
  }
  return known.get(key);
}

/** Resolves after so many milliseconds. */
export const pause = (time) => new Promise((resolve) => setTimeout(resolve, time));

/** Milliseconds of a frame of a broadcast, which has all frames of the scene. */
export const FRAME_TIME = 1000 / 12;
export const broadcastPath = at('broadcast.gss');
if (!existsSync(broadcastPath)) {
  // It says of its scene all that a stream can say.
  const pose = { position: [0, -0.5, 3], axes: [[-1, 0, 0], [0, 1, 0], [0, 0, -1]], field: 0.8 };
  const scene = ['--title', 'A broadcast', '--up=-y', '--background', '0.25,0.5,0.75', '--cameras', writeCameras([pose], 480, 270)];
  splatstream('encode', at('long', 'source'), '-o', broadcastPath, '--fps', '12', '--gop', '8', '--preset', 'fast', '--layers', '540,1080', '--refinements', '10,30,100', ...scene);
}

/** What a stream says of itself, as the decoder of streams gives it. */
export async function descriptionOf(stream) {
  const decoder = await Decoder.load();
  decoder.push(readFileSync(stream));
  decoder.next();
  return decoder.describe();
}

/**
 * A live package whose bytes come in the time of the stream, with so many seconds in its manifest. Gives, once its manifest is
 * there, its folder, its files by their names as they are at that time, and what ends it.
 */
export async function broadcast(window) {
  const out = at(`live-${started++}`);
  rmSync(out, { recursive: true, force: true });
  const options = ['package', '-', '-o', out, '--live', '--window', String(window), '--target-latency', '0.6'];
  const packager = spawn(process.env.SPLATSTREAM, options, { stdio: ['pipe', 'ignore', 'inherit'] });
  const [begun, stream] = [performance.now(), readFileSync(broadcastPath)];
  let sent = 0;
  const timer = setInterval(() => {
    const due = Math.min(1, (performance.now() - begun) / (FRAMES * FRAME_TIME));
    packager.stdin.write(stream.subarray(sent, (sent = Math.floor(due * stream.length))));
    if (due < 1) return;
    clearInterval(timer);
    packager.stdin.end();
  }, 10);
  const close = () => {
    clearInterval(timer);
    packager.kill();
  };
  const get = (name) => (existsSync(`${out}/${name}`) ? readFileSync(`${out}/${name}`) : undefined);
  while (!existsSync(`${out}/manifest.json`)) {
    if (packager.exitCode !== null) {
      close();
      throw new Error(`the packager ended with ${packager.exitCode}`);
    }
    await pause(10);
  }
  return { folder: out, files: { get }, close };
}

/**
 * A network in place of `fetch`: `behaviour` says of each request what becomes of it, as { status, bytes, delay, rate (bytes a
 * second), isWhole, tag }; what it leaves out goes well. Gives the requests that were sent, and what puts `fetch` back.
 */
export function network(served, behaviour = () => ({})) {
  const before = globalThis.fetch;
  const requests = [];
  globalThis.fetch = async (url, { headers = {}, signal, cache } = {}) => {
    const file = new URL(url).pathname.split('/').at(-1);
    const range = /bytes=(\d+)-(\d+)/.exec(headers.range)?.slice(1).map(Number) ?? null;
    const request = { file, range, cache, number: requests.length, isAborted: false, got: 0 };
    requests.push(request);
    const answer = { status: range ? 206 : 200, delay: 2, rate: Infinity, ...behaviour(request) };
    await pause(answer.delay);
    signal?.throwIfAborted();
    if (answer.fails) throw new TypeError('the connection is lost');
    const content = served.get(file);
    if (!content || answer.status >= 400) return new Response('', { status: content ? answer.status : 404 });
    const [first, last] = range && !answer.isWhole ? range : [0, content.length - 1];
    const bytes = Uint8Array.from(content.subarray(first, last + 1));
    answer.change?.(bytes, first);
    const sent = bytes.subarray(0, answer.length ?? bytes.length);
    const responseHeaders = range && !answer.isWhole ? { 'content-range': `bytes ${first}-${last}/${content.length}` } : {};
    if (answer.tag) responseHeaders.etag = answer.tag;
    const status = answer.isWhole ? 200 : answer.status;
    return new Response(bodyOf(sent, answer.rate, request, signal), { status, headers: responseHeaders });
  };
  return { requests, restore: () => (globalThis.fetch = before) };
}

/** Bytes at a rate. */
function bodyOf(bytes, rate, request, signal) {
  const step = rate === Infinity ? bytes.length : Math.max(1, Math.floor(rate / 50));
  let place = 0;
  if (signal) setMaxListeners(0, signal);
  signal?.addEventListener('abort', () => (request.isAborted = true));
  return new ReadableStream({
    async pull(controller) {
      if (signal?.aborted) return controller.error(signal.reason);
      if (place >= bytes.length) return controller.close();
      if (rate !== Infinity) await pause(20);
      if (signal?.aborted) return controller.error(signal.reason);
      controller.enqueue(bytes.slice(place, place + step));
      request.got = place = Math.min(place + step, bytes.length);
      return undefined;
    },
    cancel() {
      request.isAborted = true;
    },
  }, { highWaterMark: 0 });
}

/** A worker in this thread: the module `worker.js` with a scope of its own. Its timers end with it. */
export async function startWorker() {
  const timers = new Set();
  const [setBefore, listeners] = [globalThis.setTimeout, []];
  let take = null, isOpen = true;
  globalThis.self = {
    location: { href: 'http://127.0.0.1/worker.js' },
    addEventListener: (_, listener) => (take = listener),
    postMessage: (data) => queueMicrotask(() => isOpen && listeners.forEach((listener) => listener({ data }))),
  };
  globalThis.setTimeout = (...words) => {
    const timer = setBefore(...words);
    timers.add(timer);
    return timer;
  };
  await import(`../decoder/worker.js?${started++}`);
  return {
    addEventListener: (type, listener) => type === 'message' && listeners.push(listener),
    postMessage: (data) => take({ data }),
    terminate() {
      isOpen = false;
      globalThis.setTimeout = setBefore;
      timers.forEach(clearTimeout);
    },
  };
}

const VIEW = { position: [0, 0, -5], ahead: [0, 0, 1] };

/** Somebody who looks at a package. */
export class Viewer {
  warnings = [];
  states = [];
  /** What was said of the stream, and how many frames had come by then. */
  description = null;
  describedAfter = null;
  error = null;
  #frames = 0;
  #worker;
  #settle = null;

  static async open(source, options = {}) {
    const worker = await startWorker();
    return new Viewer(new DecoderWorker(source, { ...options, startWorker: () => worker }));
  }

  constructor(worker) {
    this.#worker = worker;
    const on = (type, handler) => worker.addEventListener(type, ({ detail }) => handler(detail));
    on('description', ({ description }) => ([this.description, this.describedAfter] = [description, this.#frames]));
    on('frame', ({ frame }) => {
      this.#frames += 1;
      this.warnings.push(...frame.warnings);
      this.#answer(frame);
    });
    on('end', ({ warnings }) => {
      this.warnings.push(...warnings);
      this.#answer(null);
    });
    on('error', ({ message }) => {
      this.error = message;
      this.#answer(null);
    });
    on('package', ({ state }) => this.states.push(state));
    on('better', ({ index }) => (this.better = index));
    on('best', ({ index }) => (this.best = index));
  }

  get worker() {
    return this.#worker;
  }

  #answer(frame) {
    const settle = this.#settle;
    this.#settle = null;
    settle?.(frame);
  }

  /** The frame with an index, or a higher one; null at the end. */
  async see(index) {
    if (this.error) throw new Error(this.error);
    const seen = new Promise((resolve) => (this.#settle = resolve));
    this.#worker.show(index, VIEW);
    const frame = await seen;
    if (this.error) throw new Error(this.error);
    return frame;
  }

  /** Plays some frames by the clock, as pages do; gives them. */
  async play(frameMilliseconds, from = 0, to = FRAMES) {
    const seen = [];
    let due = 0;
    for (let index = from; index < to; ) {
      const frame = await this.see(index);
      if (frame === null) break;
      const now = performance.now();
      seen.push({ ...frame, at: now });
      due = seen.length === 1 ? now : Math.max(due, now - 250);
      due += (frame.until - Math.max(index, frame.index)) * frameMilliseconds;
      index = frame.until;
      await pause(Math.max(0, due - performance.now() - frameMilliseconds));
    }
    return seen;
  }

  close() {
    this.#worker.close();
  }
}
