// From where a scene is looked at: a camera of the stream, or one that is made for its Gaussians as `render/` makes rings.

import { add, columns, normalize, scale, subtract } from './vectors.js';

/** Vertical angle of view of a camera that is made, radians: 40 degrees. */
const FIELD = (40 / 180) * Math.PI;
/** How much further away it stands than the sphere around the subject asks for: room for the bar and for strays. */
const MARGIN = 1.15;
/** How far above the subject a camera stands that is made, radians: 5 degrees. */
const ELEVATION = (5 / 180) * Math.PI;
/** Opacity below which Gaussians say nothing of where the scene is, as its code in the texture. */
const VISIBLE = 7813;
/** Gaussians that are looked at, at most. */
const SAMPLES = 30_000;
/** Percentiles between which the box of a scene is measured, from the outermost to the innermost. */
const BOXES = [[3, 97], [20, 80], [35, 65]];
/** A box that is more than this many times as large as the one inside it holds surroundings. */
const SURROUNDINGS = 4;

/** Right, up and front for each axis that points up. */
const AXES = {
  '+x': [[0, 1, 0], [1, 0, 0], [0, 0, -1]],
  '-x': [[0, 1, 0], [-1, 0, 0], [0, 0, 1]],
  '+y': [[1, 0, 0], [0, 1, 0], [0, 0, 1]],
  '-y': [[1, 0, 0], [0, -1, 0], [0, 0, -1]],
  '+z': [[1, 0, 0], [0, 0, 1], [0, -1, 0]],
  '-z': [[1, 0, 0], [0, 0, -1], [0, 1, 0]],
};

/** Positions of the visible Gaussians of a base texture that is whole, x, y and z apart; of many scenes a sample. */
function positions(words) {
  const numbers = new Float32Array(words.buffer, words.byteOffset, words.length);
  const step = Math.max(1, Math.floor(words.length / 8 / SAMPLES)) * 8;
  const planes = [[], [], []];
  for (let at = 0; at < words.length; at += step) {
    if (words[at + 4] >>> 16 > VISIBLE) for (const axis of [0, 1, 2]) planes[axis].push(numbers[at + axis]);
  }
  return planes;
}

/** The middle and the radius of what a camera shall see. */
function subject(words) {
  const sorted = positions(words).map((plane) => Float32Array.from(plane).sort());
  const at = (percent) => sorted.map((plane) => plane[Math.floor((plane.length * percent) / 100)] ?? 0);
  const boxes = BOXES.map((percents) => percents.map(at));
  const size = ([low, high]) => Math.hypot(...subtract(high, low));
  const inner = (box, next) => (size(box) > SURROUNDINGS * size(next) ? next : null);
  let box = boxes[0];
  for (const next of boxes.slice(1)) {
    if (inner(box, next) === null) break;
    box = next;
  }
  return { middle: scale(add(...box), 0.5), radius: 0.5 * size(box) || 1 };
}

/**
 * The views of a scene: axes of the world, what the cameras look at, and the cameras. `words` is the whole base texture of
 * the first frame.
 */
export function framing(description, words) {
  const { middle, radius } = subject(words);
  const [first] = description.cameras;
  const named = AXES[description.upAxis];
  const axes = named ?? (first ? axesOf(first) : AXES['-y']);
  const made = { ...seenFrom(middle, radius, axes), field: FIELD, axes: null };
  const given = description.cameras.map(({ position, rotation, field }) => ({ position, axes: columns(rotation), field }));
  return { axes, middle, radius, cameras: given.length > 0 ? given : [made] };
}

/** Axes of a world whose vertical is that of a camera's picture. */
function axesOf({ rotation }) {
  const [right, down, ahead] = columns(rotation);
  return [right, scale(down, -1), scale(ahead, -1)];
}

function seenFrom(middle, radius, [, up, front]) {
  const towards = add(scale(front, Math.cos(ELEVATION)), scale(up, Math.sin(ELEVATION)));
  return { position: add(middle, scale(towards, (MARGIN * radius) / Math.sin(FIELD / 2))), ahead: normalize(scale(towards, -1)) };
}
