// Streams in scenes of the PlayCanvas engine. The engine reads the textures of the decoder's worker on the GPU; of a frame
// only the rows are copied that it has changed.

import { ROW } from '@splatstream/decoder';
import { BoundingBox, Entity, FILTER_NEAREST, GSplatContainer, GSplatFormat, PIXELFORMAT_RGBA32U, RenderTarget, Texture, Vec3, WORKBUFFER_UPDATE_ONCE } from 'playcanvas';
import { playable } from './playable.js';
import { SLOTS } from './shaders.js';
import { BASE_TEXELS, SH_TEXELS, TEXEL } from './texels.js';

export { upright } from './playable.js';

/** Rows that are copied at a time. */
const STAGED = 32;
/** Above this share of changed rows everything is copied at once. */
const MOST_ROWS = 0.5;
const BASE_WORDS = BASE_TEXELS * TEXEL;

/** What the engine calls to read a Gaussian. Rotations are w, x, y, z. */
const READ = `
uniform highp usampler2D gssBase;
uniform highp usampler2D gssHarmonicsOf;
${SLOTS}
uvec4 gssLow;
uvec4 gssHigh;
vec3 getCenter() {
  gssLow = gssTexel(gssBase, int(splat.index), 0, ${BASE_TEXELS});
  gssHigh = gssTexel(gssBase, int(splat.index), 1, ${BASE_TEXELS});
  return uintBitsToFloat(gssLow.xyz);
}
vec4 getColor() { return vec4(gssColour(gssHigh), gssOpacity(gssHigh)); }
vec4 getRotation() { return gssRotation(gssHigh); }
vec3 getScale() { return gssScale(gssLow, gssHigh); }
#if SH_BANDS > 0
void readSHData(out vec3 sh[SH_COEFFS], out float scale) {
  for (int number = 0; number < SH_COEFFS; number++) {
    sh[number] = gssCoefficient(gssHarmonicsOf, int(splat.index), number, gssHarmonicTexels(SH_BANDS));
  }
  scale = 1.0;
}
#endif
`;

const textureOf = (device, name, width, height) =>
  new Texture(device, { name, width, height, format: PIXELFORMAT_RGBA32U, mipmaps: false, minFilter: FILTER_NEAREST, magFilter: FILTER_NEAREST });

/** A texture of Gaussians on the GPU and in memory. */
class Rows {
  #device;
  #staging = null;

  constructor(device, name, texels, slots) {
    this.#device = device;
    this.texture = textureOf(device, name, ROW * texels, slots / ROW);
    this.words = this.texture.lock();
    this.texture.unlock();
  }

  /** Takes rows that have changed; gives the bytes that are copied for them. */
  write(runs) {
    const { width, height } = this.texture;
    const changed = runs.reduce((sum, { rows }) => sum + rows, 0);
    if (changed === 0) return 0;
    const isWhole = changed > MOST_ROWS * height;
    if (isWhole) this.texture.lock();
    for (const { row, words } of runs) this.words.set(words, row * width * TEXEL);
    if (isWhole) this.texture.unlock();
    else for (const run of runs) this.#stage(run);
    return 4 * TEXEL * width * (isWhole ? height : changed);
  }

  destroy() {
    this.texture.destroy();
    this.#staging?.target.destroy();
    this.#staging?.texture.destroy();
  }

  /** Copies rows by way of a small texture: the engine has no other way to copy a part of one. */
  #stage({ row, rows, words }) {
    const { width } = this.texture;
    this.#staging ??= this.#makeStaging();
    for (let from = 0; from < rows; from += STAGED) {
      const height = Math.min(STAGED, rows - from);
      const part = words.subarray(from * width * TEXEL, (from + height) * width * TEXEL);
      this.#staging.texture.lock().set(part);
      this.#staging.texture.unlock();
      this.#staging.texture.upload();
      this.texture.copy(this.#staging.texture, { destY: row + from, width, height, sourceRenderTarget: this.#staging.target });
    }
  }

  #makeStaging() {
    const texture = textureOf(this.#device, `${this.texture.name} staging`, this.texture.width, STAGED);
    return { texture, target: new RenderTarget({ colorBuffer: texture, depth: false }) };
  }
}

/** The Gaussians of a stream, as long as their number of slots is the same. */
class StreamContainer extends GSplatContainer {
  #base;
  #sh;

  constructor(device, slots, shDegree) {
    super(device, slots, new GSplatFormat(device, [], { readGLSL: READ }));
    // The engine has colours computed again where the camera moves.
    this.gsplatData.shBands = shDegree;
    this.#base = new Rows(device, 'gssBase', BASE_TEXELS, slots);
    this.#sh = shDegree > 0 ? new Rows(device, 'gssHarmonicsOf', SH_TEXELS[shDegree], slots) : null;
    this.parameters.set('gssBase', this.#base.texture);
    if (this.#sh) this.parameters.set('gssHarmonicsOf', this.#sh.texture);
  }

  /** Takes rows that have changed; gives the bytes that are copied. */
  write(base, sh) {
    const bytes = this.#base.write(base) + (this.#sh?.write(sh) ?? 0);
    if (base.length > 0) {
      this.#place();
      this.update();
    }
    return bytes;
  }

  configureMaterialDefines(defines) {
    defines.set('SH_BANDS', String(this.gsplatData.shBands));
  }

  /** The engine calls it once it draws the container no more. */
  _actualDestroy() {
    super._actualDestroy();
    this.#base.destroy();
    this.#sh?.destroy();
  }

  /** Centres for sorting, and the box around them; free slots are put into its middle. */
  #place() {
    const { words } = this.#base;
    const numbers = new Float32Array(words.buffer, words.byteOffset, words.length);
    const [low, high, free] = [[Infinity, Infinity, Infinity], [-Infinity, -Infinity, -Infinity], []];
    const { centers } = this;
    for (let at = 0, to = 0; at < words.length; at += BASE_WORDS, to += 3) {
      if (words[at + TEXEL] >>> 16 === 0) {
        free.push(to);
        continue;
      }
      for (let axis = 0; axis < 3; axis++) {
        const place = numbers[at + axis];
        centers[to + axis] = place;
        if (place < low[axis]) low[axis] = place;
        if (place > high[axis]) high[axis] = place;
      }
    }
    if (free.length < centers.length / 3) this.aabb.setMinMax(new Vec3(low), new Vec3(high));
    const { x, y, z } = this.aabb.center;
    for (const to of free) centers.set([x, y, z], to);
  }
}

/** What a track shows its frames in. */
class EntityScene {
  isAntialiased = false;
  #entity;
  #container = null;

  constructor(entity) {
    this.#entity = entity;
  }

  /** Takes what a frame has changed; gives the bytes that are copied to the GPU. */
  update({ slots, isNew, shDegree, isAntialiased, base, sh }) {
    this.isAntialiased = isAntialiased;
    const before = this.#container;
    if (isNew) this.#container = new StreamContainer(this.#entity._app.graphicsDevice, slots, shDegree);
    const bytes = this.#container.write(base, sh);
    if (isNew) this.#show(before);
    // Otherwise the engine would only sort again.
    else this.#entity.gsplat.workBufferUpdate = WORKBUFFER_UPDATE_ONCE;
    return bytes;
  }

  /** The engine sorts. */
  setOrder() {}

  get count() {
    return this.#container?.numSplats ?? 0;
  }

  /** Frees what it has on the GPU. */
  delete() {
    if (this.#entity.gsplat) this.#entity.removeComponent('gsplat');
    this.#container?.destroy();
    this.#container = null;
  }

  #show(before) {
    if (this.#entity.gsplat) this.#entity.gsplat.resource = this.#container;
    else this.#entity.addComponent('gsplat', { resource: this.#container });
    before?.destroy();
  }
}

/** A stream as an Entity: see playcanvas.d.ts. */
export class StreamEntity extends playable(Entity) {
  #scene;
  #ticking;

  constructor(app, source, options = {}) {
    super(options.name ?? 'SplatStream', app);
    if (!app.graphicsDevice.isWebGL2) throw new Error('StreamEntity needs a device of WebGL 2.');
    this.#scene = new EntityScene(this);
    this.openStream(source, options, this.#scene);
    this.#ticking = app.on('update', () => this.tick());
  }

  /** Whether the scene was made for a renderer that compensates its low-pass filter: what `scene.gsplat.antiAlias` should be. */
  get isAntialiased() {
    return this.#scene.isAntialiased;
  }

  dispose() {
    this.destroy();
  }

  destroy() {
    this.#ticking.off();
    this.closeStream();
    super.destroy();
  }

  announce(type, detail) {
    this.fire(type, detail);
  }
}
