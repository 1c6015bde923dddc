// One stream at one operating point: its worker, its Gaussians on the GPU, and the frames between them.

import { DecoderWorker } from '@splatstream/decoder';

/** Frames over which times and rates are averaged. */
const AVERAGED = 12;

/**
 * Asks for one frame at a time and shows it when it is due. Every answer of the worker is applied, in the order in which
 * they come: each holds what has changed since the one before. `scene` takes what changes, and the orders to draw in;
 * `controls` say from where it is seen, null where nobody needs an order.
 */
export class Track extends EventTarget {
  #controls;
  #worker;
  /** The index that the worker has been asked for; the one to ask for after that, at once; a frame that is not due yet. */
  #asked = null;
  #next = null;
  #held = null;
  /** The frame that was sought last, and whether what stands for it is the best that can be had. */
  #sought = 0;
  #isBest = false;
  #history = [];

  constructor(source, options, scene, controls) {
    super();
    this.#controls = controls;
    this.scene = scene;
    this.frame = null;
    this.isEnded = false;
    this.error = null;
    this.point = options.point ?? {};
    /** What was asked for: without axes it is everything, and of a package what the network allows. */
    this.chosen = this.point;
    /** What is known of a package: see PackageState of the decoder; null of a stream. */
    this.package = null;
    this.#worker = new DecoderWorker(source, options);
    const on = (type, handler) => this.#worker.addEventListener(type, ({ detail }) => handler(detail));
    on('frame', (answer) => this.#take(answer));
    on('renewed', (all) => this.#renewed(all));
    on('order', ({ order }) => this.#sorted(order));
    on('end', ({ warnings }) => this.#end(warnings));
    on('waiting', () => this.#wait());
    on('error', ({ message }) => this.#fail(message));
    on('package', ({ state }) => this.#report(state));
    on('best', () => this.#settleForBest());
    for (const type of ['description', 'received', 'better']) on(type, (detail) => this.#emit(type, detail));
    this.seek(0);
  }

  /** Whether a frame is on its way. */
  get isBusy() {
    return this.#asked !== null;
  }

  /** Whether the frame is there that was sought last, or what stands for it, which of a package may be replaced later. */
  get isSettled() {
    if (this.#asked !== null || this.#next !== null) return false;
    return this.package === null || this.isEnded || this.#isBest || this.frame.index >= this.#sought;
  }

  /** Whether the operating point is left to the network. */
  get isAutomatic() {
    return this.package !== null && Object.keys(this.chosen).length === 0;
  }

  /** When the frame is due that is held back, seconds from the start; null if there is none. */
  get heldTime() {
    return this.#held?.frame.time ?? null;
  }

  /** Times of the last frames in milliseconds, bytes a second of the stream, and bytes of memory. */
  get statistics() {
    const mean = (part) => this.#history.reduce((sum, entry) => sum + entry[part], 0) / (this.#history.length || 1);
    const seconds = this.#history.reduce((sum, entry) => sum + entry.seconds, 0);
    const bytes = this.#history.reduce((sum, entry) => sum + entry.bytes, 0);
    const times = { decode: mean('decode'), pack: mean('pack'), sort: mean('sort'), upload: mean('upload') };
    return { ...times, uploaded: mean('uploaded'), rate: seconds > 0 ? bytes / seconds : 0, memory: this.#history.at(-1)?.memory ?? 0 };
  }

  /** Shows a frame as soon as it is there. */
  seek(index) {
    this.release();
    this.isEnded = false;
    this.#sought = index;
    if (this.#asked === null) this.#ask(index, true);
    else this.#next = index;
  }

  /** Resolves once the frame is there that was sought last, or cannot come; at once if the track is closed. */
  settled() {
    const types = ['shown', 'best', 'ended', 'failed', 'closed'];
    return new Promise((resolve) => {
      const listen = ({ type }) => {
        if (type !== 'closed' && !this.isSettled) return;
        for (const type of types) this.removeEventListener(type, listen);
        resolve();
      };
      for (const type of types) this.addEventListener(type, listen);
    });
  }

  /** Asks for a frame that is shown when it is released. */
  prefetch(index) {
    if (this.#asked === null && this.#held === null) this.#ask(index, false);
  }

  /** Shows the frame that is held back. */
  release() {
    const held = this.#held;
    this.#held = null;
    if (held) this.#show(held);
  }

  /** Changes the operating point and shows the frame with an index again. */
  setPoint(point, index) {
    [this.point, this.chosen] = [point, point];
    this.#history = [];
    this.#worker.setPoint(point);
    this.seek(index);
  }

  /** Sorts again, since the camera has moved. */
  sort() {
    this.#worker.sort(this.#controls.view());
  }

  /** Asks for all that the scene has held, since the GPU has lost it. */
  renew() {
    this.#worker.renew();
  }

  /** Says how fast a package is played; 0 while it stands still. */
  run(speed) {
    this.#worker.run(speed);
  }

  /** The next bytes of a source that is pushed. */
  push(bytes, total) {
    this.#worker.push(bytes, total);
  }

  /** No more bytes will be pushed. */
  finish() {
    this.#worker.finish();
  }

  close() {
    this.#worker.close();
    this.scene.delete();
    this.#emit('closed');
  }

  #ask(index, isUrgent) {
    this.#asked = { index, isUrgent };
    this.#worker.show(index, this.#controls.view());
  }

  #take(answer) {
    const isUrgent = this.#asked?.isUrgent || this.#next !== null || answer.wanted !== this.#asked?.index;
    if (answer.wanted === this.#asked?.index) this.#asked = null;
    this.#isBest = false;
    this.#emit('warnings', { warnings: answer.frame.warnings, index: answer.frame.index });
    if (answer.frame.isJump) this.#emit('jumped', answer.frame);
    if (isUrgent) this.#show(answer, true);
    else this.#held = answer;
    this.#askNext();
    this.#emit('arrived', answer.frame);
  }

  #askNext() {
    if (this.#next === null || this.#asked !== null) return;
    const index = this.#next;
    this.#next = null;
    this.#ask(index, true);
  }

  /** Shows an answer. A frame that was sought says nothing of the rate of the stream. */
  #show({ frame, update, order, times, memory }, isSought = false) {
    const start = performance.now();
    const uploaded = this.scene.update(update);
    this.scene.setOrder(order);
    const upload = performance.now() - start;
    const seconds = this.frame && !isSought ? frame.time - this.frame.time : 0;
    const entry = { ...times, upload, uploaded, memory, seconds: Math.max(0, seconds), bytes: seconds > 0 ? frame.bytes : 0 };
    this.#history = [...this.#history, entry].slice(-AVERAGED);
    this.frame = frame;
    this.#emit('shown', { frame, update });
  }

  #report(state) {
    this.package = state;
    if (this.isAutomatic && this.frame) this.point = this.frame.point;
    this.#emit('package', state);
  }

  /** A frame that is held back may be in it already: to write its rows again changes nothing. */
  #renewed({ update, order }) {
    this.scene.update(update);
    this.#sorted(order);
  }

  #settleForBest() {
    this.#isBest = this.#asked === null;
    this.#emit('best');
  }

  #sorted(order) {
    this.scene.setOrder(order);
    this.#emit('sorted');
  }

  #end(warnings) {
    this.#asked = null;
    this.isEnded = true;
    this.#emit('warnings', { warnings, index: null });
    this.#askNext();
    this.#emit('ended');
  }

  /** The worker waits for bytes: it can be asked for another frame instead. */
  #wait() {
    if (this.#next !== null) {
      this.#asked = null;
      this.#askNext();
    }
    this.#emit('waiting');
  }

  #fail(message) {
    this.#asked = null;
    this.isEnded = true;
    this.error = message;
    this.#emit('failed', { message });
  }

  #emit(type, detail) {
    this.dispatchEvent(new CustomEvent(type, { detail }));
  }
}
