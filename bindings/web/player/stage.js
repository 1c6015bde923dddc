// The canvas: its size in pixels, and when it is drawn.

import { Context } from './context.js';
import { Renderer } from './renderer.js';

/** Milliseconds from picture to picture above which fewer pixels are drawn, and below which more. */
const SLOW = 24;
const FAST = 17.5;
/** Pictures that are counted before the number of pixels changes. */
const COUNTED = 10;
/** The smallest share of the lines that is drawn in motion. */
const COARSEST = 0.4;
/** After so many milliseconds without motion, all pixels are drawn. */
const STILL = 180;

/** How many pixels are drawn: fewer where pictures come slowly, all of them as soon as nothing moves. */
export class Resolution {
  scale = 1;
  /** A scale that was too slow; it is not tried again for a while. */
  #slow = Infinity;
  #intervals = [];

  /** Takes the time since the picture before, milliseconds, while pictures follow each other. */
  sample(interval) {
    this.#intervals.push(interval);
    if (this.#intervals.length < COUNTED) return;
    const mean = this.#intervals.reduce((sum, one) => sum + one) / this.#intervals.length;
    this.#intervals = [];
    if (mean > SLOW && this.scale > COARSEST) {
      this.#slow = this.scale;
      this.scale = Math.max(COARSEST, this.scale * Math.max(0.7, Math.sqrt(SLOW / mean)));
    } else if (mean < FAST && this.scale < 1) {
      const next = Math.min(1, this.scale * 1.15);
      if (next < this.#slow) this.scale = next;
      else this.#slow *= 1.03;
    }
  }

  /** The pictures that follow are others. */
  pause() {
    this.#intervals = [];
  }
}

/** Draws scenes side by side into a canvas, when something has changed. */
export class Stage {
  /** Called before each picture with the time in milliseconds; whether things go on moving. */
  ontick = () => false;
  /** Called after each picture with the milliseconds since the one before. */
  ondraw = () => {};
  background = [0, 0, 0];
  /** Where the second scene starts, as a share of the width. */
  split = 0.5;
  isAdaptive = true;
  #canvas;
  #controls;
  #scenes;
  #resolution = new Resolution();
  #isDirty = true;
  #isRunning = false;
  #last = null;
  #still = null;
  /** Whether the next picture is one of something that stands still. */
  #isSharp = false;

  /** `scenes` gives the scenes, one or two of them. */
  constructor(canvas, controls, scenes) {
    this.#canvas = canvas;
    this.#controls = controls;
    this.#scenes = scenes;
    this.renderer = new Renderer(canvas);
    this.context = new Context(this.renderer.gl);
    new ResizeObserver(() => this.invalidate()).observe(canvas);
  }

  /** Something has changed: a picture is drawn soon. */
  invalidate() {
    this.#isDirty = true;
    if (!this.#isRunning) {
      this.#isRunning = true;
      requestAnimationFrame((now) => this.#run(now));
    }
  }

  /** Draws at once, for whoever reads the pixels. */
  draw(scale = 1) {
    const { clientWidth, clientHeight } = this.#canvas;
    const ratio = Math.min(2, globalThis.devicePixelRatio || 1) * scale;
    this.renderer.resize(Math.max(1, Math.round(clientWidth * ratio)), Math.max(1, Math.round(clientHeight * ratio)));
    const { width, height } = this.#canvas;
    const camera = this.#controls.camera(width, height);
    const scenes = this.#scenes();
    const parts = scenes.length > 1 ? [[0, this.split], [this.split, 1]] : [[0, 1]];
    scenes.forEach((scene, place) => this.renderer.draw(scene, camera, this.background, parts[place]));
  }

  #run(now) {
    const isMoving = this.ontick(now);
    if (this.#isDirty) {
      this.#isDirty = false;
      const interval = this.#last === null ? null : now - this.#last;
      this.#last = now;
      // After a pause the interval says nothing.
      if (this.isAdaptive && interval !== null && interval < 400) this.#resolution.sample(interval);
      const isCoarse = this.isAdaptive && this.#resolution.scale < 1 && !(this.#isSharp && !isMoving);
      this.#isSharp = false;
      this.draw(isCoarse ? this.#resolution.scale : 1);
      this.ondraw(interval);
      this.#sharpenLater(isCoarse);
    } else if (!isMoving) {
      this.#last = null;
      this.#resolution.pause();
      this.#isRunning = false;
      return;
    }
    requestAnimationFrame((next) => this.#run(next));
  }

  /** Draws all pixels of a coarse picture once nothing has moved for a while. */
  #sharpenLater(isCoarse) {
    clearTimeout(this.#still);
    if (!isCoarse) return;
    this.#still = setTimeout(() => {
      this.#isSharp = true;
      this.invalidate();
    }, STILL);
  }
}
