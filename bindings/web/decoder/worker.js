// The worker: takes a stream as it comes, decodes the frames that are asked for, sorts, and posts what has changed.
// Messages in and out are those of `client.js`.

import { Decoder, loadModule } from './decoder.js';
import { Fetcher, manifestAddress, readManifest } from './fetcher.js';

/** Frames further ahead than this are sought where the stream is whole; nearer ones are decoded towards. */
const FAR = 16;
/** Bytes of a source in memory that are taken between two frames. */
const PIECE = 1 << 18;
/** Milliseconds between two reports of a package. */
const REPORTED = 200;

/** One stream or package, and the frame that is wanted. */
class Player {
  #decoder;
  #view = { position: [0, 0, 0], ahead: [0, 0, 1] };
  #wanted = null;
  /** The frame that was given last, and the one up to which it stands. */
  #shown = -1;
  #until = 0;
  #point = {};
  #speed = 1;
  #isWhole = false;
  #hasDescription = false;
  #warnings = [];
  #received = 0;
  #bytes = 0;
  /** Of a package: what fetches it, when it was reported last, and whether a better frame was announced. */
  #fetcher = null;
  #reportedAt = -Infinity;
  #isAnnounced = false;

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
    this.#isAnnounced = false;
    const isBack = index < this.#until;
    if (isBack || ((this.#isWhole || this.#fetcher) && index >= this.#until + FAR)) this.#seek(index);
    this.#wanted = index;
    this.#advance();
    this.#fetcher?.tick();
    this.#announce();
  }

  /** Plays the package with a manifest at an address. */
  openPackage(manifest, address) {
    this.#decoder.openPackage(manifest, performance.now());
    this.#decoder.setPoint(this.#point);
    this.#decoder.run(this.#speed);
    const onfail = (message) => post({ type: 'error', message });
    const on = { onchange: () => this.#changed(), ontick: () => this.#report(REPORTED), onfail };
    this.#fetcher = new Fetcher(this.#decoder, address, on);
    this.#fetcher.tick();
    this.#report();
  }

  /** Says how fast playback moves; 0 while it stands still. */
  run(speed) {
    this.#speed = speed;
    if (!this.#fetcher) return;
    this.#decoder.clock(performance.now());
    this.#decoder.run(speed);
    this.#fetcher.tick();
    this.#changed();
  }

  /** Something of a package has come, or cannot be had. */
  #changed() {
    try {
      this.#advance();
    } catch (error) {
      this.#fetcher.close();
      post({ type: 'error', message: reason(error) });
    }
    this.#announce();
    this.#report(REPORTED);
  }

  /** Says once of the frame that stands of a package that it can be had better, or that it is the best that can be had. */
  #announce() {
    if (!this.#fetcher || this.#wanted !== null || this.#isAnnounced) return;
    const isBest = () => this.#speed === 0 && this.#decoder.isBest;
    const type = this.#decoder.isBetter ? 'better' : isBest() ? 'best' : null;
    if (type === null) return;
    this.#isAnnounced = true;
    post({ type, index: this.#shown });
  }

  /** Reports a package, if that was not done for so many milliseconds. */
  #report(interval = 0) {
    if (!this.#fetcher || performance.now() - this.#reportedAt < interval) return;
    this.#reportedAt = performance.now();
    post({ type: 'package', state: this.#decoder.packageState() });
  }

  sort(view) {
    this.#view = view;
    this.#order();
  }

  /** Changes the operating point at once: the frame that is asked for next is decoded from its keyframe on. */
  setPoint(point) {
    this.#point = point;
    this.#decoder.setPoint(point);
    // Before the first frame there is none to go back for, and a presentation that grows starts near its end.
    if (this.#shown >= 0) this.#until = Infinity;
  }

  #seek(index) {
    this.#decoder.seek(index);
    this.#until = index;
    this.#bytes = 0;
  }

  /** Decodes until the wanted frame is there or bytes are missing. */
  #advance() {
    while (this.#wanted !== null) {
      const start = performance.now();
      if (this.#fetcher) this.#decoder.clock(start);
      const frame = this.#decoder.next();
      if (frame === null) return post({ type: 'waiting' });
      this.#bytes += frame.bytes ?? 0;
      this.#warnings.push(...frame.warnings);
      if (frame.isEnd) {
        return this.#end();
      }
      if (!this.#hasDescription) this.#describe();
      if (frame.until > this.#wanted) {
        this.#give(frame, start);
      }
    }
  }

  #end() {
    this.#report();
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
    const order = this.#sorted();
    const sorted = performance.now();
    [this.#shown, this.#until] = [frame.index, frame.until];
    const times = { decode: decoded - start, pack: packed - decoded, sort: sorted - packed };
    const memory = this.#decoder.memory;
    const described = { ...frame, bytes: this.#bytes, warnings: this.#takeWarnings() };
    post({ type: 'frame', wanted: this.#wanted, frame: described, update, order, times, memory }, buffersOf(update, order));
    this.#wanted = null;
    this.#bytes = 0;
  }

  /** Gives all of what is shown, and the order for it. */
  renew() {
    const update = this.#decoder.whole();
    if (update === null) return;
    const order = this.#sorted();
    post({ type: 'renewed', update, order }, buffersOf(update, order));
  }

  #order() {
    const start = performance.now();
    const order = this.#sorted();
    post({ type: 'order', order, time: performance.now() - start }, [order.slots.buffer]);
  }

  /** The order for the view; an empty one for those who sort themselves, and give none. */
  #sorted() {
    if (this.#view === null) return { slots: new Uint32Array(0), near: 0 };
    return this.#decoder.sort(this.#view.position, this.#view.ahead);
  }

  #takeWarnings() {
    return this.#warnings.splice(0);
  }
}

const post = (message, transfer = []) => self.postMessage(message, transfer);
/** What is moved to the page, and not copied. */
const buffersOf = ({ base, sh }, { slots }) => [...base, ...sh].map(({ words }) => words.buffer).concat(slots.buffer);
const pause = () => new Promise((resolve) => setTimeout(resolve));

/** What the first bytes at an address are: a stream, or JSON. */
const isJson = (bytes) => bytes[0] === 0x7b;

/** Starts to fetch a source at once, whatever else has to be done first. */
function begin(source) {
  const started = source.package ? startPackage(source.package) : source.url ? startAddress(source.url) : null;
  // Whoever takes it hears of the failure.
  started?.catch(() => {});
  return started;
}

/** The manifest of a package at an address: its own, that of its folder, or that of its MPD. */
async function startPackage(given) {
  const address = manifestAddress(given);
  try {
    const manifest = await readManifest(address);
    if (isJson(manifest)) return { manifest, address };
  } catch (error) {
    if (address.endsWith('manifest.json')) throw error;
  }
  const inFolder = manifestAddress(address.replace(/\/*([?#].*)?$/, '/'));
  return { manifest: await readManifest(inFolder), address: inFolder };
}

/** A stream at an address, or a package: where its folder or its MPD is, or where the content is JSON. */
async function startAddress(url) {
  if (/(\/|\.mpd)$/.test(new URL(url, self.location.href).pathname)) return startPackage(url);
  const response = await fetch(url);
  if (!response.ok) throw new Error(`${url}: ${response.status} ${response.statusText}`);
  const reader = response.body.getReader();
  const first = await reader.read();
  if (first.done || !isJson(first.value)) return { response, reader, first };
  const parts = [];
  for (let piece = first; !piece.done; piece = await reader.read()) parts.push(piece.value);
  return { manifest: new Uint8Array(await new Blob(parts).arrayBuffer()), address: response.url || url };
}

/** Gives a source to the player, piece by piece, so that other messages are heard in between. */
async function feed(player, { bytes }, started) {
  if (bytes) {
    for (let at = 0; at < bytes.length; at += PIECE) {
      player.push(bytes.subarray(at, at + PIECE), bytes.length);
      await pause();
    }
    player.end();
  }
  const { manifest, address, response, reader, first } = (await started) ?? {};
  if (manifest) player.openPackage(manifest, address);
  if (!reader) return;
  const total = Number(response.headers.get('content-length')) || null;
  for (let piece = first; !piece.done; piece = await reader.read()) player.push(piece.value, total);
  player.end();
}

/** Why something failed, in words. */
const reason = (error) => (error instanceof WebAssembly.RuntimeError ? 'the memory does not suffice, or the decoder has a defect' : error.message);

/** The module for a source. That for packages is larger: others do without. */
async function moduleFor({ module, source }, started) {
  if (module) return module instanceof WebAssembly.Module ? module : WebAssembly.compile(module);
  const isPackage = source.package || (source.url && /(\/|\.mpd|\.json)$/.test(new URL(source.url, self.location.href).pathname));
  if (isPackage) return loadModule({ packages: true });
  const loading = loadModule();
  const { manifest } = (await started) ?? {};
  return manifest ? loadModule({ packages: true }) : loading;
}

let opening = null;

/** A message; those that need the player wait until it is there. Where it cannot be, only the first one says so. */
async function take({ data: message }) {
  if (message.type === 'open') {
    const started = begin(message.source);
    opening = (async () => {
      const player = new Player(await moduleFor(message, started));
      player.setPoint(message.point);
      return player;
    })();
    const player = await opening;
    post({ type: 'opened' });
    return feed(player, message.source, started);
  }
  const player = await opening.catch(() => null);
  if (player === null) return undefined;
  if (message.type === 'push') player.push(message.bytes, message.total);
  else if (message.type === 'finish') player.end();
  else if (message.type === 'show') player.show(message.index, message.view);
  else if (message.type === 'sort') player.sort(message.view);
  else if (message.type === 'renew') player.renew();
  else if (message.type === 'point') player.setPoint(message.point);
  else if (message.type === 'run') player.run(message.speed);
  return undefined;
}

self.addEventListener('message', (event) => {
  take(event).catch((error) => post({ type: 'error', message: reason(error) }));
});
