// The page's side of the worker: asks for frames, and hands on what the worker posts.

import { bytesOf } from './bytes.js';

/** Where the worker is, if nothing else is said: beside this file. */
const workerBeside = () => new Worker(new URL('./worker.js', import.meta.url), { type: 'module' });

/** A source as the worker takes it: its address is not relative to the page, but whole, and bytes are a Uint8Array. */
function prepared(source) {
  const whole = (address) => new URL(address, globalThis.document?.baseURI ?? globalThis.location?.href).href;
  const addresses = Object.entries(source).filter(([name]) => name === 'url' || name === 'package');
  const bytes = 'bytes' in source ? { bytes: bytesOf(source.bytes) } : {};
  return { ...source, ...Object.fromEntries(addresses.map(([name, address]) => [name, whole(address)])), ...bytes };
}

/**
 * Decodes and sorts in a worker. Events, whose `detail` index.d.ts describes: `description`, `frame`, `order`, `received`,
 * `renewed`, `waiting` (for bytes), `end`, `error`; of packages also `package`, `better` and `best`.
 */
export class DecoderWorker extends EventTarget {
  #worker;
  #isSorting = false;
  #nextSort = null;

  /**
   * Starts to decode a source: `{ url }`, `{ package: url }`, `{ bytes }`, or `{}` where chunks are pushed. `module` is the WebAssembly module
   * or its bytes, by default the file beside the worker; `startWorker` makes the worker in pages that have no file of it.
   */
  constructor(source, { point = {}, module = null, startWorker = workerBeside } = {}) {
    super();
    // First, since it throws at bytes that are none.
    const whole = prepared(source);
    this.#worker = startWorker();
    this.#worker.addEventListener('message', ({ data }) => this.#take(data));
    this.#worker.addEventListener('error', (event) => this.#emit('error', { message: event.message ?? 'the worker cannot be started' }));
    this.#worker.postMessage({ type: 'open', module, point, source: whole });
  }

  /** The next bytes of a source that is pushed; `total` is the length of the stream, if that is known. */
  push(bytes, total = null) {
    this.#worker.postMessage({ type: 'push', bytes: bytesOf(bytes), total });
  }

  /** No more bytes will be pushed. */
  finish() {
    this.#worker.postMessage({ type: 'finish' });
  }

  /** Asks for a frame, sorted for a view. The answer is `frame` with this index or a higher one, or `end`. */
  show(index, view) {
    this.#worker.postMessage({ type: 'show', index, view });
  }

  /** Sorts the frame that was given last for another view. Of views that come faster than they are sorted for, the last counts. */
  sort(view) {
    if (this.#isSorting) {
      this.#nextSort = view;
      return;
    }
    this.#isSorting = true;
    this.#worker.postMessage({ type: 'sort', view });
  }

  /** Asks for all of what is shown, where the GPU has lost it. The answer is `renewed`; none before the first frame. */
  renew() {
    this.#worker.postMessage({ type: 'renew' });
  }

  /** Changes the operating point; frames that are asked for after this have it. */
  setPoint(point) {
    this.#worker.postMessage({ type: 'point', point });
  }

  /** Says how fast a package is played, 1 being its own speed; 0 while it stands still, in which time what is shown gets better. */
  run(speed) {
    this.#worker.postMessage({ type: 'run', speed });
  }

  /** Ends the worker. */
  close() {
    this.#worker.terminate();
  }

  #take({ type, ...detail }) {
    if (type === 'order' || type === 'frame') this.#sortNext(type);
    this.#emit(type, detail);
  }

  #sortNext(type) {
    if (type === 'order') this.#isSorting = false;
    if (this.#isSorting || this.#nextSort === null) return;
    const view = this.#nextSort;
    this.#nextSort = null;
    this.sort(view);
  }

  #emit(type, detail) {
    this.dispatchEvent(new CustomEvent(type, { detail }));
  }
}
