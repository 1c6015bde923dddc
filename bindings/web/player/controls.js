// The camera in the hands of somebody: pointer, touch, wheel and keys. It circles a point (orbit) or moves freely (fly).

import { add, cross, dot, normalize, scale, subtract } from './vectors.js';

/** Radians of a drag across the height of the picture. */
const TURN = Math.PI;
/** The steepest look up or down, radians. */
const STEEPEST = (88 / 180) * Math.PI;
/** Keys that move, and the direction: right, up, ahead. */
const MOVES = { KeyW: [0, 0, 1], KeyS: [0, 0, -1], KeyA: [-1, 0, 0], KeyD: [1, 0, 0], KeyE: [0, 1, 0], KeyQ: [0, -1, 0] };

const clamp = (value, low, high) => Math.min(high, Math.max(low, value));

/** A camera that pointers and keys move. `onchange` is called when it has moved. */
export class Controls {
  mode = 'orbit';
  onchange = () => {};
  /** A camera { position, axes, field } in place of the one that moves; its angle is vertical. */
  fixed = null;
  #axes = [[1, 0, 0], [0, -1, 0], [0, 0, -1]];
  #position = [0, 0, -4];
  #distance = 4;
  #radius = 1;
  #yaw = 0;
  #pitch = 0;
  #field = 0.7;
  /** The rotation of a camera of the stream, until somebody moves it. */
  #exact = null;
  #pointers = new Map();
  #keys = new Set();

  constructor(target) {
    const on = (type, handler, options) => target.addEventListener(type, handler, options);
    on('pointerdown', (event) => this.#down(event, target));
    on('pointermove', (event) => this.#move(event, target));
    for (const type of ['pointerup', 'pointercancel']) on(type, (event) => this.#pointers.delete(event.pointerId));
    on('wheel', (event) => this.#wheel(event), { passive: false });
    on('contextmenu', (event) => event.preventDefault());
    on('keydown', (event) => this.#key(event, true));
    on('keyup', (event) => this.#key(event, false));
    on('blur', () => this.#keys.clear());
  }

  /** Stands where a camera of a scene stands: see `framing`. */
  place({ axes, middle, radius }, camera) {
    this.#axes = axes;
    this.#radius = radius;
    this.#field = camera.field;
    this.#position = camera.position;
    this.#exact = camera.axes;
    const ahead = camera.axes ? camera.axes[2] : camera.ahead;
    const [right, up, front] = axes;
    this.#pitch = clamp(Math.asin(clamp(-dot(ahead, up), -1, 1)), -STEEPEST, STEEPEST);
    this.#yaw = Math.atan2(-dot(ahead, right), -dot(ahead, front));
    // A camera that looks past the scene circles a point near it.
    this.#distance = Math.max(0.1 * radius, dot(subtract(middle, camera.position), ahead));
    this.onchange();
  }

  /** The camera for a picture of so many pixels: see Camera in index.d.ts. */
  camera(width, height) {
    if (this.fixed) return { ...this.fixed, focal: (0.5 * height) / Math.tan(0.5 * this.fixed.field) };
    // The angle holds for the shorter side, so that a telephone held upright shows what it showed before.
    const focal = (0.5 * Math.min(height, width)) / Math.tan(0.5 * this.#field);
    return { position: this.#position, axes: this.#exact ?? this.#ownAxes(), focal };
  }

  /** Where the camera is and looks, for the worker. */
  view() {
    if (this.fixed) return { position: this.fixed.position, ahead: this.fixed.axes[2] };
    return { position: this.#position, ahead: (this.#exact ?? this.#ownAxes())[2] };
  }

  /** Whether keys keep the camera in motion. */
  get isMoving() {
    return this.#keys.size > 0;
  }

  /** Moves by the keys that are held for so many seconds. */
  tick(seconds) {
    if (!this.isMoving) return;
    let move = [0, 0, 0];
    for (const key of this.#keys) move = add(move, MOVES[key]);
    this.#shift(move.map((part) => part * this.#radius * 0.9 * seconds), 1);
  }

  /** Turns by angles, radians: to the right and upwards. */
  turn(yaw, pitch) {
    const pivot = add(this.#position, scale(this.#ahead(), this.#distance));
    this.#exact = null;
    this.#yaw += yaw;
    this.#pitch = clamp(this.#pitch + pitch, -STEEPEST, STEEPEST);
    if (this.mode === 'orbit') this.#position = subtract(pivot, scale(this.#ahead(), this.#distance));
    this.onchange();
  }

  /** Comes nearer by a factor below 1, goes away by one above 1. */
  zoom(factor) {
    const ahead = this.#ahead();
    if (this.mode === 'fly') return this.#shift([0, 0, -Math.log(factor) * this.#radius], 1);
    const distance = clamp(this.#distance * factor, 0.01 * this.#radius, 100 * this.#radius);
    this.#position = add(this.#position, scale(ahead, this.#distance - distance));
    this.#distance = distance;
    return this.onchange();
  }

  #ahead() {
    return (this.#exact ?? this.#ownAxes())[2];
  }

  #ownAxes() {
    const [right, up, front] = this.#axes;
    const level = add(scale(right, Math.sin(this.#yaw)), scale(front, Math.cos(this.#yaw)));
    const towards = add(scale(level, Math.cos(this.#pitch)), scale(up, Math.sin(this.#pitch)));
    const ahead = scale(towards, -1);
    const across = normalize(cross(scale(up, -1), ahead), right);
    return [across, cross(ahead, across), ahead];
  }

  /** Moves along right, up and ahead. */
  #shift([right, up, ahead], factor) {
    const axes = this.#exact ?? this.#ownAxes();
    let moved = add(scale(axes[0], right * factor), scale(axes[1], -up * factor));
    moved = add(moved, scale(axes[2], ahead * factor));
    this.#position = add(this.#position, moved);
    this.onchange();
  }

  #down(event, target) {
    target.setPointerCapture(event.pointerId);
    this.#pointers.set(event.pointerId, [event.clientX, event.clientY]);
  }

  #move(event, target) {
    const before = this.#pointers.get(event.pointerId);
    if (!before) return;
    const now = [event.clientX, event.clientY];
    const [x, y] = [now[0] - before[0], now[1] - before[1]];
    const height = target.clientHeight || 1;
    const perPixel = (2 * this.#distance * Math.tan(0.5 * this.#field)) / height;
    if (this.#pointers.size === 2) {
      const [other] = [...this.#pointers].filter(([id]) => id !== event.pointerId).map(([, place]) => place);
      const apart = (place) => Math.hypot(place[0] - other[0], place[1] - other[1]) || 1;
      this.#shift([-x, y, 0], 0.5 * perPixel);
      this.zoom(apart(before) / apart(now));
    } else if (event.buttons & 6 || event.shiftKey) {
      this.#shift([-x, y, 0], perPixel);
    } else {
      const direction = this.mode === 'orbit' ? 1 : -1;
      this.turn((-direction * x * TURN) / height, (direction * y * TURN) / height);
    }
    this.#pointers.set(event.pointerId, now);
  }

  #wheel(event) {
    event.preventDefault();
    const lines = event.deltaMode === 1 ? 16 : 1;
    this.zoom(Math.exp(clamp(event.deltaY * lines, -120, 120) * 0.0015));
  }

  #key(event, isDown) {
    if (!(event.code in MOVES) || event.ctrlKey || event.metaKey || event.altKey) return;
    if (isDown) this.#keys.add(event.code);
    else this.#keys.delete(event.code);
    this.onchange();
  }
}
