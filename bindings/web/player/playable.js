// Playing inside the scene of an engine: what the adapters add to an object of the engine.

import { Playback } from './playback.js';
import { Track } from './track.js';

/** Engines sort themselves. */
const UNSORTED = { view: () => null };

const HALF = Math.SQRT1_2;
/** Quaternions x, y, z, w that turn an axis upwards, to +y. Where a stream does not say what points up, it mostly is -y. */
const UPWARDS = {
  unknown: [1, 0, 0, 0],
  '+x': [0, 0, HALF, HALF],
  '-x': [0, 0, -HALF, HALF],
  '+y': [0, 0, 0, 1],
  '-y': [1, 0, 0, 0],
  '+z': [-HALF, 0, 0, HALF],
  '-z': [HALF, 0, 0, HALF],
};

/** The rotation x, y, z, w that makes what a stream says is up point to +y, as it does in scenes of engines. */
export const upright = (description) => UPWARDS[description.upAxis];

/**
 * A class of objects that play a stream. Adapters call `openStream` once, `tick` before each picture and `closeStream` at
 * last, and have `announce(type, detail)`, which tells the listeners of the object. What else it has is Playable in playable.d.ts.
 */
export const playable = (Base) =>
  class extends Base {
    #track = null;
    #playback = null;
    #description = null;
    #isReady = false;

    /** Starts to play a source. `scene` takes what frames change: `update(update)`, `setOrder(order)`, `delete()`. */
    openStream(source, { autoplay = true, loop = true, point = {}, module = null, startWorker }, scene) {
      const track = new Track(source, { point, module, startWorker }, scene, UNSORTED);
      this.#track = track;
      this.#playback = new Playback([track]);
      this.#playback.isLooping = loop;
      const on = (type, handler) => track.addEventListener(type, ({ detail }) => handler(detail));
      on('description', ({ description }) => this.#describe(description));
      on('shown', ({ frame }) => this.#shown(frame, autoplay));
      on('better', () => this.#playback.improve(track));
      on('ended', () => this.#playback.ended(track));
      on('warnings', (lost) => lost.warnings.length > 0 && this.announce('lost', lost));
      on('failed', (failure) => this.announce('failed', failure));
    }

    get frame() {
      return this.#track.frame;
    }

    get description() {
      return this.#description;
    }

    get statistics() {
      return this.#track.statistics;
    }

    get isPlaying() {
      return this.#playback.isPlaying;
    }

    get isLooping() {
      return this.#playback.isLooping;
    }

    set isLooping(isLooping) {
      this.#playback.isLooping = isLooping;
    }

    get speed() {
      return this.#playback.speed;
    }

    set speed(speed) {
      this.#playback.speed = speed;
    }

    get operatingPoint() {
      return this.#track.point;
    }

    set operatingPoint(point) {
      this.#track.setPoint(point, this.#playback.index);
    }

    play() {
      this.#playback.play();
    }

    pause() {
      this.#playback.pause();
    }

    async seek(index) {
      await this.#playback.reach(index);
      return this.frame;
    }

    push(bytes, total = null) {
      this.#track.push(bytes, total);
    }

    finish() {
      this.#track.finish();
    }

    /** Shows what is due. */
    tick() {
      this.#playback.tick(performance.now());
    }

    /** Ends the worker and frees what the scene has. */
    closeStream() {
      this.#playback.pause();
      this.#track.close();
    }

    #describe(description) {
      this.#description = description;
      this.#playback.describe(description);
      this.#track.point = { ...description.highest, ...this.#track.point };
    }

    #shown(frame, autoplay) {
      if (!this.#isReady) {
        this.#isReady = true;
        if (autoplay) this.play();
        else this.#playback.pace();
        this.announce('ready', this.#description);
      }
      this.announce('frame', frame);
    }
  };
