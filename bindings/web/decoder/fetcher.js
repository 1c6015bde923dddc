// Fetches a package: asks the decoder what to do, does it with `fetch`, and says what becomes of it.

/** Milliseconds without an answer, or without more of it, after which a request has failed. */
const SILENCE = 10_000;
/** Requests that were of no use and are remembered. */
const DOUBTS = 64;
/** Attempts to read the manifest, and milliseconds before the second one; each further one waits twice as long, up to the last. */
const ATTEMPTS = 8;
const FIRST_WAIT = 100, LAST_WAIT = 3200;
/** Bytes of a manifest, at most. */
const LARGEST_MANIFEST = 1 << 28;
const FINAL = [401, 403, 404, 410, 451];

/** Why a request is of no use; the kinds are those of `gss_package_failed`. */
class Fault extends Error {
  constructor(kind, { value = 0, message = '' } = {}) {
    super(message);
    Object.assign(this, { kind, value });
  }

  static status = (value) => new Fault(0, { value, message: `the server answers with status ${value}` });
  static failed = (message) => new Fault(1, { message });
  static short = (value) => new Fault(2, { value });
  static wrong = () => new Fault(3);
  static changed = () => new Fault(4);
}

const pause = (time) => new Promise((resolve) => setTimeout(resolve, time));

/** Where the manifest of a package is: at a folder, beside an MPD, or at the address itself. */
export function manifestAddress(address) {
  const url = new URL(address, globalThis.location?.href);
  if (url.pathname.endsWith('/')) url.pathname += 'manifest.json';
  else if (url.pathname.endsWith('.mpd')) url.pathname = url.pathname.replace(/[^/]*$/, 'manifest.json');
  return url.href;
}

/** All bytes of a manifest, which is asked for once. */
async function readOnce(address) {
  const response = await fetch(address, { cache: 'no-cache', signal: AbortSignal.timeout(SILENCE) });
  if (!response.ok) throw Fault.status(response.status);
  const bytes = new Uint8Array(await response.arrayBuffer());
  if (bytes.length > LARGEST_MANIFEST) throw new Error('the manifest is too large');
  return bytes;
}

/** Reads a manifest, with as many attempts as it gets. */
export async function readManifest(address) {
  for (let attempt = 1, wait = FIRST_WAIT; ; attempt++, wait = Math.min(2 * wait, LAST_WAIT)) {
    try {
      return await readOnce(address);
    } catch (error) {
      if (attempt >= ATTEMPTS || FINAL.includes(error.value)) throw new Error(`${address}: ${error.message}`);
      await pause(wait);
    }
  }
}

/** Fetches what the decoder wants of a package whose manifest it has. */
export class Fetcher {
  #decoder;
  #address;
  #onchange;
  #ontick;
  #onfail;
  /** What aborts the running requests; null if none run. */
  #running = null;
  #timer = null;
  #isClosed = false;
  /** `ETag` of each file, and requests that were of no use: what they asked for is not taken from a cache again. */
  #tags = new Map();
  #doubtful = [];

  /**
   * `onchange` is called when something has come or failed, `ontick` when all was done that is to be done for now, `onfail`
   * with a message when nothing more can be played.
   */
  constructor(decoder, address, { onchange, ontick, onfail }) {
    [this.#decoder, this.#address] = [decoder, address];
    [this.#onchange, this.#ontick, this.#onfail] = [onchange, ontick, onfail];
  }

  /** Does what is to be done now. */
  tick() {
    if (this.#isClosed) return;
    clearTimeout(this.#timer);
    for (;;) {
      this.#decoder.clock(performance.now());
      const { type, requests, until } = this.#decoder.decide();
      if (type === 'wait') {
        this.#timer = setTimeout(() => this.tick(), Math.max(1, until - performance.now()));
        this.#ontick();
        return;
      }
      if (type === 'manifest') this.#renew();
      else if (type === 'poll') this.#poll();
      else this.#stop();
      if (type === 'fetch') this.#fetch(requests);
    }
  }

  /** Ends all of it. */
  close() {
    this.#isClosed = true;
    clearTimeout(this.#timer);
    this.#stop();
  }

  #stop() {
    this.#running?.abort();
    this.#running = null;
  }

  async #renew() {
    try {
      const manifest = await readManifest(this.#address);
      this.#take((decoder) => decoder.renewPackage(manifest));
    } catch (error) {
      this.#fail(error);
    }
  }

  /** Reads the manifest of a presentation that grows. The decoder says when to do it again, whatever comes of it. */
  async #poll() {
    const read = await readOnce(this.#address).catch((error) => error);
    try {
      this.#take((decoder) => (read instanceof Error ? decoder.unreadablePackage(read.message) : decoder.polledPackage(read)));
    } catch (error) {
      this.#fail(error);
    }
  }

  /** Lets the decoder take a manifest. Files may be others than before, and new ones are not to pile up. */
  #take(renew) {
    if (this.#isClosed) return;
    this.#tags.clear();
    this.#decoder.clock(performance.now());
    renew(this.#decoder);
    this.#changed();
  }

  #fail({ message }) {
    this.close();
    this.#onfail(message);
  }

  #changed() {
    if (this.#isClosed) return;
    this.tick();
    this.#onchange();
  }

  /** Sends requests, each when the one before has ended. */
  async #fetch(requests) {
    const control = new AbortController();
    this.#running = control;
    const isWanted = () => this.#running === control;
    for (const request of requests) {
      if (!isWanted()) return;
      this.#decoder.sent();
      const fault = await this.#request(request, control, isWanted).catch((error) => error);
      if (!isWanted()) return;
      if (fault) {
        this.#doubt(request);
        this.#decoder.clock(performance.now());
        this.#decoder.failed(fault instanceof Fault ? fault : Fault.failed(fault.message));
        this.#running = null;
        this.#changed();
        return;
      }
    }
    if (isWanted()) this.#running = null;
  }

  /** One request; gives or throws why it was of no use. */
  async #request(request, control, isWanted) {
    const watch = new Watch(control);
    try {
      const response = await this.#answer(request, control.signal);
      if (!isWanted()) return undefined;
      watch.reset();
      this.#decoder.clock(performance.now());
      this.#decoder.begun();
      return await this.#read(request, response, watch, isWanted);
    } catch (error) {
      throw watch.isOver ? Fault.failed('the server does not answer in time') : error;
    } finally {
      watch.stop();
    }
  }

  /** The response, if it is the range asked for, or the whole file. */
  async #answer({ file, offset, size }, signal) {
    const last = offset + size - 1;
    const isDoubtful = this.#doubtful.some((other) => other.file === file && other.offset <= last && offset < other.offset + other.size);
    const cache = isDoubtful ? 'reload' : 'default';
    const url = new URL(file, this.#address);
    url.search = new URL(this.#address).search;
    const response = await fetch(url, { headers: { range: `bytes=${offset}-${last}` }, signal, cache });
    if (response.status === 412 || response.status === 416) throw Fault.changed();
    if (response.status !== 206 && response.status !== 200) throw Fault.status(response.status);
    // Pages of other origins may not see these headers; digests hold for all.
    const range = response.headers.get('content-range');
    if (response.status === 206 && range && !range.startsWith(`bytes ${offset}-${last}/`)) throw Fault.wrong();
    const tag = response.headers.get('etag');
    if (tag && (this.#tags.get(file) ?? tag) !== tag) throw Fault.changed();
    if (tag) this.#tags.set(file, tag);
    return response;
  }

  /** Hands on the bytes of a response. A server that ignores ranges sends those before and after too. */
  async #read(request, response, watch, isWanted) {
    const { offset, size } = request;
    let skip = response.status === 200 ? offset : 0;
    let got = 0;
    const reader = response.body.getReader();
    for (;;) {
      const { done, value } = await reader.read();
      // To read to the end lets the next request have the connection.
      if (!isWanted()) return void (got === size || reader.cancel().catch(() => {}));
      if (done) return got === size ? undefined : Fault.short(got);
      watch.reset();
      const bytes = value.subarray(Math.min(skip, value.length));
      skip -= value.length - bytes.length;
      const own = bytes.subarray(0, size - got);
      got += own.length;
      if (own.length > 0) this.#receive(own, request);
      if (got === size && response.status === 200) return void reader.cancel().catch(() => {});
      if (own.length < bytes.length) return Fault.wrong();
    }
  }

  #receive(bytes, request) {
    this.#decoder.clock(performance.now());
    if (!this.#decoder.received(bytes)) this.#doubt(request);
    // All has come, or something of it is not what was packaged.
    if (!this.#decoder.isFetching) this.#running = null;
    this.#changed();
  }

  #doubt(request) {
    this.#doubtful.push(request);
    if (this.#doubtful.length > DOUBTS) this.#doubtful.shift();
  }
}

/** Gives requests up that are silent for too long. */
class Watch {
  isOver = false;
  #control;
  #timer = null;

  constructor(control) {
    this.#control = control;
    this.reset();
  }

  reset() {
    clearTimeout(this.#timer);
    this.#timer = setTimeout(() => {
      this.isOver = true;
      this.#control.abort();
    }, SILENCE);
  }

  stop() {
    clearTimeout(this.#timer);
  }
}
