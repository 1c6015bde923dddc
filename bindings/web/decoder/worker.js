// The worker: takes a stream as it comes, decodes the frames that are asked for, sorts, and posts what has changed.
// Messages in and out are those of `client.js`.

import { Decoder, loadModule } from './decoder.js';

/** Frames further ahead than this are sought where the stream is whole; nearer ones are decoded towards. */
const FAR = 16;
/** Bytes of a source in memory that are taken between two frames. */
const PIECE = 1 << 18;

/** One stream, and the frame that is wanted. */
class Player {
  #decoder;
  #view = { position: [0, 0, 0], ahead: [0, 0, 1] };
  #wanted = null;
  #shown = -1;
  #isWhole = false;
  #hasDescription = false;
  #warnings = [];
  #received = 0;
  #bytes = 0;

  constructor(module) {
    this.#decoder = new Decoder(module);
  }

  push(bytes, total) {
    this.#decoder.push(bytes);
    this.#received += bytes.length;
    post({ type: 'received', bytes: this.#received, total });
    this.#advance();
  }

  end() {
    this.#decoder.end();
    this.#isWhole = true;
    post({ type: 'received', bytes: this.#received, total: this.#received });
    this.#advance();
  }

  show(index, view) {
    this.#view = view;
    const isBack = index <= this.#shown;
    if (isBack || (this.#isWhole && index > this.#shown + FAR)) this.#seek(index);
    this.#wanted = index;
    this.#advance();
  }

  sort(view) {
    this.#view = view;
    this.#order();
  }

  /** Changes the operating point at once: the frame that is asked for next is decoded from its keyframe on. */
  setPoint(point) {
    this.#decoder.setPoint(point);
    this.#shown = Infinity;
  }

  #seek(index) {
    this.#decoder.seek(index);
    this.#shown = index - 1;
    this.#bytes = 0;
  }

  /** Decodes until the wanted frame is there or bytes are missing. */
  #advance() {
    while (this.#wanted !== null) {
      const start = performance.now();
      const frame = this.#decoder.next();
      if (frame === null) return post({ type: 'waiting' });
      this.#bytes += frame.bytes ?? 0;
      this.#warnings.push(...frame.warnings);
      if (frame.isEnd) {
        return this.#end();
      }
      if (!this.#hasDescription) this.#describe();
      if (frame.index >= this.#wanted) {
        this.#give(frame, start);
      }
    }
  }

  #end() {
    post({ type: 'end', wanted: this.#wanted, warnings: this.#takeWarnings() });
    this.#wanted = null;
    this.#bytes = 0;
  }

  #describe() {
    this.#hasDescription = true;
    post({ type: 'description', description: this.#decoder.describe() });
  }

  #give(frame, start) {
    const decoded = performance.now();
    const update = this.#decoder.show();
    const packed = performance.now();
    const order = this.#decoder.sort(this.#view.position, this.#view.ahead);
    const sorted = performance.now();
    this.#shown = frame.index;
    const times = { decode: decoded - start, pack: packed - decoded, sort: sorted - packed };
    const buffers = [...update.base, ...update.sh].map((run) => run.words.buffer);
    const memory = this.#decoder.memory;
    const described = { ...frame, bytes: this.#bytes, warnings: this.#takeWarnings() };
    post({ type: 'frame', wanted: this.#wanted, frame: described, update, order, times, memory }, [...buffers, order.slots.buffer]);
    this.#wanted = null;
    this.#bytes = 0;
  }

  #order() {
    const start = performance.now();
    const order = this.#decoder.sort(this.#view.position, this.#view.ahead);
    post({ type: 'order', order, time: performance.now() - start }, [order.slots.buffer]);
  }

  #takeWarnings() {
    return this.#warnings.splice(0);
  }
}

const post = (message, transfer = []) => self.postMessage(message, transfer);
const pause = () => new Promise((resolve) => setTimeout(resolve));

/** Gives a source to the player, piece by piece, so that other messages are heard in between. */
async function feed(player, source) {
  if (source.bytes) {
    for (let at = 0; at < source.bytes.length; at += PIECE) {
      player.push(source.bytes.subarray(at, at + PIECE), source.bytes.length);
      await pause();
    }
    player.end();
  } else if (source.url) {
    const response = await fetch(source.url);
    if (!response.ok) throw new Error(`${source.url}: ${response.status} ${response.statusText}`);
    const total = Number(response.headers.get('content-length')) || null;
    const reader = response.body.getReader();
    for (let piece = await reader.read(); !piece.done; piece = await reader.read()) player.push(piece.value, total);
    player.end();
  }
}

/** Why something failed, in words. */
const reason = (error) => (error instanceof WebAssembly.RuntimeError ? 'the memory does not suffice, or the decoder has a defect' : error.message);

let opening = null;

/** A message; those that need the player wait until it is there. */
async function take({ data: message }) {
  if (message.type === 'open') {
    opening = (async () => {
      const module = message.module ?? (await loadModule());
      const player = new Player(module instanceof WebAssembly.Module ? module : await WebAssembly.compile(module));
      player.setPoint(message.point);
      return player;
    })();
    const player = await opening;
    post({ type: 'opened' });
    return feed(player, message.source);
  }
  const player = await opening;
  if (message.type === 'push') player.push(message.bytes, message.total);
  else if (message.type === 'finish') player.end();
  else if (message.type === 'show') player.show(message.index, message.view);
  else if (message.type === 'sort') player.sort(message.view);
  else if (message.type === 'point') player.setPoint(message.point);
  return undefined;
}

self.addEventListener('message', (event) => {
  take(event).catch((error) => post({ type: 'error', message: reason(error) }));
});
