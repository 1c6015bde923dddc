// <splat-player>: plays a stream of SplatStream. README.md has its attributes, properties and events.

import { pointOf, reflect, takeEarly } from './attributes.js';
import { Controls } from './controls.js';
import { listenToFiles } from './drops.js';
import { framing } from './framing.js';
import { icon } from './icons.js';
import { listenToKeys } from './keys.js';
import { Losses } from './losses.js';
import { Message } from './message.js';
import { pointText } from './panel.js';
import { Playback } from './playback.js';
import { Scene } from './renderer.js';
import { Side } from './side.js';
import { Splitter } from './splitter.js';
import { Stage } from './stage.js';
import { TEMPLATE } from './template.js';
import { Timeline } from './timeline.js';
import { Track } from './track.js';

/** Radians that an arrow key turns by. */
const STEP = 0.07;
const SPEEDS = [0.25, 0.5, 1, 2];
const LOWEST = { spatial: 0, temporal: 0, refinement: 0 };

/** Where there is none, as in Node, the class can be named, but not made. */
const Base = globalThis.HTMLElement ?? class {};

export class SplatPlayer extends Base {
  static observedAttributes = ['src', 'operating-point', 'controls', 'resolution', 'theme'];
  /** Given to the worker: see DecoderWorker. Pages that hold everything themselves set them. */
  module = null;
  startWorker = undefined;
  #tracks = [];
  #playback = null;
  #stage = null;
  #controls = null;
  #source = null;
  #description = null;
  #framing = null;
  #received = { bytes: 0, total: null };
  #losses = null;
  #timeline = null;
  #interval = null;
  #side;
  #message;
  #isReady = false;
  #drawn = null;
  #background = null;
  #pointShown = null;
  /** The operating point of the source that comes next, if it is not that of the attribute. */
  #pending = null;
  /** Whether a presentation was followed when the page was hidden. */
  #isAway = false;
  #scheme = null;

  constructor() {
    super();
    this.attachShadow({ mode: 'open' }).innerHTML = TEMPLATE;
    this.#message = new Message(this.shadowRoot);
    this.#side = new Side(this.shadowRoot, () => this.#known(), (track, point) => this.#choose(track, point));
  }

  /** A page that nobody sees does not follow a presentation that grows; it goes on where that is when it is seen again. */
  #onvisibility = () => {
    const { isLive, isPlaying } = this.#playback ?? {};
    if (!isLive) return;
    if (document.hidden && isPlaying) {
      this.#isAway = !this.#tracks[0].package.isBehind;
      this.pause();
    } else if (!document.hidden && this.#isAway) {
      this.#isAway = false;
      this.goLive();
    }
  };

  /** The page has changed between light and dark. */
  #onscheme = () => this.#retheme();

  connectedCallback() {
    takeEarly(this);
    document.addEventListener('visibilitychange', this.#onvisibility);
    // Both would hold an element that is in no page.
    this.#scheme = matchMedia('(prefers-color-scheme: dark)');
    this.#scheme.addEventListener('change', this.#onscheme);
    if (!this.#stage && !this.#setUp()) return;
    this.#stage.context.retake();
    this.#applyAttributes();
    if (this.src) this.open({ url: new URL(this.src, document.baseURI).href });
    else this.#message.say('Drop a stream here, or choose one. It stays on this device.', { isOpen: true });
  }

  disconnectedCallback() {
    document.removeEventListener('visibilitychange', this.#onvisibility);
    this.#scheme.removeEventListener('change', this.#onscheme);
    this.#close();
    this.#stage?.context.release();
  }

  attributeChangedCallback(name, before, value) {
    if (!this.isConnected || !this.#stage || before === value) return;
    if (name === 'operating-point') this.operatingPoint = pointOf(value);
    else if (name !== 'src') this.#applyAttributes();
    else if (value !== null) this.open({ url: new URL(value, document.baseURI).href });
  }

  /** Looks as its attributes say. */
  #applyAttributes() {
    this.#find('bar').hidden = !this.#isReady || !this.controls;
    this.#stage.isAdaptive = this.resolution !== 'full';
    this.#retheme();
  }

  /** The frame that is shown: see Frame of the decoder; null before the first. */
  get frame() {
    return this.#tracks[0]?.frame ?? null;
  }

  /** What the stream says of itself; null before the first frame. */
  get description() {
    return this.#description;
  }

  /** What was lost, line by line. */
  get losses() {
    return this.#losses?.lines ?? [];
  }

  get isPlaying() {
    return this.#playback?.isPlaying ?? false;
  }

  /** The operating point; axes that are left out are at their highest. Null if a package is played at what the network allows. */
  get operatingPoint() {
    const [track] = this.#tracks;
    return track?.isAutomatic ? null : track?.point ?? {};
  }

  set operatingPoint(point) {
    const [track] = this.#tracks;
    // What is set before there is a source is for the first one.
    if (!track) this.#pending = point;
    track?.setPoint(point ?? {}, this.#playback.index);
    if (this.#side.open === 'quality') this.#side.fill();
  }

  /** A camera { position, axes, field } in place of the viewer's; null gives it back. */
  set camera(camera) {
    this.#controls.fixed = camera;
    this.#moved();
  }

  /** The colour around the scene, red, green and blue from 0 to 1; null: that of the stream, or else of the page. */
  set backgroundColour(colour) {
    this.#background = colour;
    this.#retheme();
  }

  /** Figures of decoding and of drawing. */
  get statistics() {
    const [track] = this.#tracks;
    return { ...track?.statistics, interval: this.#interval, ...this.#received, package: track?.package ?? null };
  }

  /** Opens a source: { url } of a stream or a package, { package: url }, { bytes }, or {} if chunks are pushed. */
  open(source) {
    // First, since it throws at bytes that are none: what is there goes on then.
    const first = this.#makeTrack(source, this.#pending ?? pointOf(this.getAttribute('operating-point')));
    this.#close();
    this.#pending = null;
    this.#source = source;
    this.#tracks.push(first);
    this.#message.say('', { isBusy: true });
    this.#find('bar').hidden = true;
    this.#playback = new Playback(this.#tracks);
    this.#playback.isLooping = this.#find('loop').getAttribute('aria-pressed') === 'true';
    this.#playback.speed = Number(this.#find('speed').value);
    first.addEventListener('description', ({ detail }) => this.#describe(detail.description));
    first.addEventListener('received', ({ detail }) => this.#receive(detail));
    first.addEventListener('ended', () => this.#ended(first));
  }

  /** The next bytes of a source that is pushed; `total` is the length of the stream, if that is known. */
  push(bytes, total = null) {
    this.#tracks[0].push(bytes, total);
  }

  /** No more bytes will be pushed. */
  finish() {
    this.#tracks[0].finish();
  }

  play() {
    this.#playback?.play();
    this.#stage?.invalidate();
    this.#showPlay();
  }

  pause() {
    this.#playback?.pause();
    this.#showPlay();
  }

  togglePlay() {
    if (this.isPlaying) this.pause();
    else this.play();
  }

  /** Goes to a frame; resolves with the frame that is shown then: see index.d.ts. */
  async seek(index) {
    await this.#playback?.reach(index);
    return this.frame;
  }

  /** Goes to where a presentation that grows is followed, and plays. */
  goLive() {
    if (!this.#playback?.isLive) return;
    this.#playback.goLive();
    this.play();
  }

  /** Pauses and goes some frames on or back. */
  step(frames) {
    this.pause();
    this.#playback?.seek((this.frame?.index ?? 0) + frames);
  }

  look(right, up) {
    this.#controls.turn(right * STEP, up * STEP);
  }

  changeSpeed(by) {
    const select = this.#find('speed');
    const place = SPEEDS.indexOf(Number(select.value)) + by;
    if (!(place in SPEEDS)) return;
    select.value = SPEEDS[place];
    this.#playback.speed = SPEEDS[place];
  }

  /** Presses one of the keys of the bar by its id. */
  press(id) {
    this.#find(id).click();
  }

  /** Draws at once and gives the pixels as a PNG, as many as the picture has on the screen. */
  async snapshot() {
    this.#stage.draw();
    return new Promise((resolve) => this.#find('canvas').toBlob(resolve));
  }

  /** Makes what lasts as long as the element; false if it cannot draw. */
  #setUp() {
    const canvas = this.#find('canvas');
    this.#find('full').hidden = !document.fullscreenEnabled;
    this.#controls = new Controls(canvas);
    try {
      this.#stage = new Stage(canvas, this.#controls, () => this.#tracks.map((track) => track.scene));
    } catch (error) {
      this.#message.say(error.message);
      return false;
    }
    this.#stage.ontick = (now) => this.#tick(now);
    this.#stage.ondraw = (interval) => this.#drewPicture(interval);
    this.#controls.onchange = () => this.#moved();
    this.#timeline = new Timeline(this.shadowRoot);
    this.#losses = new Losses(this.#find('lost'), this.#find('lost-count'), this.#find('lost-list'));
    this.splitter = new Splitter(this.shadowRoot, this.#stage);
    this.#stage.context.onlost = () => this.#loseContext();
    this.#stage.context.onrestored = () => this.#restoreContext();
    this.#listen();
    return true;
  }

  /** The browser has taken the context away; it gives it back when it can. Playback goes on. */
  #loseContext() {
    if (this.#isReady) this.#message.say('The browser has taken the graphics away. The picture returns with them.');
    this.#emit('contextlost');
  }

  /** The context is there again, and the GPU has lost everything. */
  #restoreContext() {
    this.#stage.renderer.prepare();
    for (const track of this.#tracks) track.renew();
    this.#stage.invalidate();
    if (this.#isReady) this.#message.say('');
    this.#emit('contextrestored');
  }

  #find(id) {
    return this.shadowRoot.getElementById(id);
  }

  #makeTrack(source, point) {
    const options = { point, module: this.module, startWorker: this.startWorker };
    const track = new Track(source, options, new Scene(this.#stage.renderer), this.#controls);
    const on = (type, handler) => track.addEventListener(type, handler);
    on('shown', ({ detail }) => this.#shown(track, detail));
    for (const type of ['arrived', 'sorted', 'ended']) on(type, () => this.#stage.invalidate());
    on('package', ({ detail }) => this.#showPackage(track, detail));
    on('better', () => this.#playback.improve(track));
    on('warnings', ({ detail }) => this.#lost(detail));
    on('failed', ({ detail }) => this.#fail(detail.message));
    return track;
  }

  #close() {
    for (const track of this.#tracks.splice(0)) track.close();
    this.#playback = null;
    this.#description = null;
    this.#framing = null;
    this.#isReady = false;
    // The colour around the scene was that of the stream.
    this.#retheme();
    this.#losses?.clear();
    this.#side.show(null);
    this.splitter?.hide();
    this.#find('compare').setAttribute('aria-pressed', 'false');
  }

  #describe(description) {
    this.#description = description;
    const title = this.#find('title');
    title.textContent = description.title;
    title.hidden = !description.title;
    this.#playback.describe(description);
    this.#retheme();
    const [track] = this.#tracks;
    track.point = { ...description.highest, ...(track.isAutomatic ? track.frame?.point : track.point) };
    this.#find('compare').hidden = Object.values(description.highest).every((value) => value === 0);
    this.#find('quality').hidden = this.#find('compare').hidden;
  }

  /** The colour around scenes that say none: that of the page. */
  #surround() {
    const [red, green, blue] = getComputedStyle(this).backgroundColor.match(/[\d.]+/g) ?? [0, 0, 0];
    return [red, green, blue].map((part) => part / 255);
  }

  #shown(track, { frame, update }) {
    if (!this.#framing && this.#description && update.isNew) this.#frameScene(update);
    this.#stage.invalidate();
    if (!this.#isReady && track === this.#tracks[0]) this.#begin();
    this.#showPlace();
    if (track === this.#tracks[0]) this.#emit('frame', frame);
  }

  #frameScene({ base }) {
    this.#framing = framing(this.#description, base[0].words);
    this.#controls.place(this.#framing, this.#framing.cameras[0]);
  }

  /** The first picture is there. */
  #begin() {
    this.#isReady = true;
    this.#message.say('');
    const { isMoving } = this.#playback;
    this.#applyAttributes();
    this.#timeline.prepare(this.#playback);
    const calm = matchMedia('(prefers-reduced-motion: reduce)').matches;
    if (isMoving && !calm && this.autoplay) this.play();
    else this.#playback.pace();
    this.#showPlay();
    this.#emit('ready', this.#description);
  }

  #receive({ bytes, total }) {
    this.#received = { bytes, total };
    this.#timeline.fill(total ? bytes / total : 0);
  }

  /** What a package reports: how far it is buffered, whether it waits, and the operating point. */
  #showPackage(track, state) {
    if (track !== this.#tracks[0]) return;
    this.#received = { bytes: state.bytes, total: null };
    this.#timeline.follow(state, this.#playback);
    if (state.isLive) this.#showPlace();
    if (this.#isReady) this.#message.say('', { isBusy: state.isWaiting });
    const point = state.point && pointText(state.point);
    if (this.#side.open === 'quality' && track.isAutomatic && point !== this.#pointShown) this.#side.fill();
    this.#pointShown = point;
    this.#emit('package', state);
  }

  #ended(track) {
    this.#playback?.ended(track);
    if (!this.#isReady) this.#fail('There is no frame in it.');
  }

  #lost({ warnings, index }) {
    if (warnings.length === 0) return;
    this.#losses.add(warnings, index);
    this.#emit('lost', { warnings, index });
  }

  #fail(message) {
    if (this.#isReady) this.#losses.add([message], null);
    else this.#message.say(`This cannot be played: ${message}`, { isOpen: true });
    this.#emit('failed', { message });
  }

  #emit(type, detail) {
    this.dispatchEvent(new CustomEvent(type, { detail }));
  }

  #moved() {
    for (const track of this.#tracks) track.sort();
    this.#stage?.invalidate();
  }

  #tick(now) {
    const passed = this.#drawn === null ? 0 : (now - this.#drawn) / 1000;
    this.#drawn = now;
    this.#controls.tick(Math.min(0.1, passed));
    const wasPlaying = this.isPlaying;
    this.#playback?.tick(now);
    if (wasPlaying !== this.isPlaying) this.#showPlay();
    if (this.isPlaying) this.#showPlace();
    const isMoving = this.isPlaying || this.#controls.isMoving;
    if (!isMoving) this.#drawn = null;
    return isMoving;
  }

  #drewPicture(interval) {
    this.#interval = interval ?? this.#interval;
    this.#side.refresh();
  }

  #showPlay() {
    const [key, name] = [this.#find('play'), this.isPlaying ? 'Pause (space)' : 'Play (space)'];
    key.innerHTML = icon(this.isPlaying ? 'pause' : 'play');
    key.title = name;
    key.setAttribute('aria-label', name);
  }

  #showPlace() {
    this.#timeline.show(this.#playback, this.frame);
  }

  /** What the panels at the side show. */
  #known() {
    const canvas = this.#find('canvas');
    const { bytes, total } = this.#received;
    const shared = { interval: this.#interval, pixels: [canvas.width, canvas.height], received: bytes, total };
    return { tracks: this.#tracks, description: this.#description, shared };
  }

  #choose(track, point) {
    track.setPoint(point, this.#playback.index);
    this.splitter.name(this.#tracks);
    if (track.isAutomatic) this.#side.fill();
  }

  #compare() {
    const isOn = this.#tracks.length > 1;
    if (isOn) {
      this.#tracks.pop().close();
      this.splitter.hide();
    } else {
      this.#tracks.push(this.#makeTrack(this.#source, LOWEST));
      this.splitter.show(this.#tracks);
    }
    this.#find('compare').setAttribute('aria-pressed', String(!isOn));
    // On a telephone the panel would hide what is compared.
    if (!isOn && this.#side.open === null && this.clientWidth > 620) this.#side.show('quality');
    else this.#side.fill();
    this.#playback.seek(this.#playback.index);
    this.#stage.invalidate();
  }

  #listen() {
    listenToKeys(this, this.shadowRoot);
    const on = (id, type, handler) => this.#find(id).addEventListener(type, handler);
    on('play', 'click', () => this.togglePlay());
    on('place', 'input', ({ target }) => this.#playback.seek(Number(target.value)));
    on('speed', 'change', ({ target }) => (this.#playback.speed = Number(target.value)));
    on('live', 'click', () => this.goLive());
    on('loop', 'click', ({ currentTarget }) => (this.#playback.isLooping = flip(currentTarget)));
    on('fly', 'click', ({ currentTarget }) => (this.#controls.mode = flip(currentTarget) ? 'fly' : 'orbit'));
    on('compare', 'click', () => this.#compare());
    on('home', 'click', () => this.#framing && this.#controls.place(this.#framing, this.#framing.cameras[0]));
    on('full', 'click', () => (document.fullscreenElement ? document.exitFullscreen() : this.requestFullscreen()));
    for (const id of ['quality', 'info']) on(id, 'click', () => this.#side.toggle(id));
    listenToFiles(this, this.shadowRoot, (bytes) => this.open({ bytes }));
  }

  #retheme() {
    if (!this.#stage) return;
    this.#stage.background = this.#background ?? this.#description?.background ?? this.#surround();
    this.#stage.invalidate();
  }
}

reflect(SplatPlayer);

/** Presses a toggle; whether it is on then. */
function flip(key) {
  const isOn = key.getAttribute('aria-pressed') !== 'true';
  key.setAttribute('aria-pressed', String(isOn));
  return isOn;
}
