// Streams in scenes of Spark, which draws Gaussians with three.js. Spark reads the textures of the decoder's worker on the
// GPU; of a frame only the rows are copied that it has changed.

import { ROW } from '@splatstream/decoder';
import { SplatMesh, dyno } from '@sparkjsdev/spark';
import { Color, DataTexture, Quaternion, RGBAIntegerFormat, UnsignedIntType, Vector3 } from 'three';
import { playable } from './playable.js';
import { SLOTS } from './shaders.js';
import { BASE_TEXELS, SH_TEXELS, TEXEL, gaussian } from './texels.js';

export { upright } from './playable.js';

/** Above this share of changed rows one copy of everything is made, which is faster then than one of each row. */
const MOST_ROWS = 0.5;

/** A texture of Gaussians on the GPU and in memory. */
class Rows {
  /** Whether all rows wait for being copied. */
  #isWhole = true;

  constructor(texels, slots) {
    this.words = new Uint32Array(slots * texels * TEXEL);
    this.texture = new DataTexture(this.words, ROW * texels, slots / ROW, RGBAIntegerFormat, UnsignedIntType);
    this.texture.internalFormat = 'RGBA32UI';
    this.texture.onUpdate = () => (this.#isWhole = false);
  }

  /** Takes rows that have changed; gives the bytes that are copied for them. */
  write(runs) {
    const { width, height } = this.texture.image;
    const changed = runs.reduce((sum, { rows }) => sum + rows, 0);
    if (changed === 0) return 0;
    for (const { row, words } of runs) this.words.set(words, row * width * TEXEL);
    this.#isWhole ||= changed > MOST_ROWS * height;
    if (this.#isWhole) this.texture.clearUpdateRanges();
    else for (const run of runs) this.#mark(run, width * TEXEL);
    this.texture.needsUpdate = true;
    return 4 * TEXEL * width * (this.#isWhole ? height : changed);
  }

  /** three.js copies ranges that lie in one row. */
  #mark({ row, rows }, words) {
    for (let at = row; at < row + rows; at++) this.texture.addUpdateRange(at * words, words);
  }
}

/** Reads Gaussian `index` as Spark has it; those of opacity 0 are not active. */
const STATEMENTS = ({ index, base, harmonics, degree, origin }, out) => `
  ${out}.flags = 0u;
  uvec4 gssLow = gssTexel(${base}, ${index}, 0, ${BASE_TEXELS});
  uvec4 gssHigh = gssTexel(${base}, ${index}, 1, ${BASE_TEXELS});
  float gssAlpha = gssOpacity(gssHigh);
  if (gssAlpha > 0.0) {
    ${out}.flags = GSPLAT_FLAG_ACTIVE;
    ${out}.index = ${index};
    ${out}.center = uintBitsToFloat(gssLow.xyz);
    ${out}.scales = gssScale(gssLow, gssHigh);
    ${out}.quaternion = gssRotation(gssHigh).yzwx;
    vec3 gssLight = gssColour(gssHigh);
    if (${degree} > 0) gssLight += gssHarmonics(${harmonics}, ${index}, ${degree}, normalize(${out}.center - ${origin}));
    ${out}.rgba = vec4(max(gssLight, 0.0), gssAlpha);
  }`;

/** What Spark draws: a SplatSource, and the scene of a track. */
class StreamSplats {
  isAntialiased = false;
  /** Called when something has changed. */
  onchange = () => {};
  #slots = 0;
  #shDegree = 0;
  #maxSh = 3;
  #base = new Rows(BASE_TEXELS, ROW);
  #sh = null;
  #uniforms = {
    base: dyno.dynoUsampler2D(this.#base.texture, 'base'),
    harmonics: dyno.dynoUsampler2D(this.#base.texture, 'harmonics'),
    degree: dyno.dynoInt(0, 'degree'),
  };

  /** Takes what a frame has changed; gives the bytes that are copied to the GPU. */
  update({ slots, isNew, shDegree, isAntialiased, base, sh }) {
    this.isAntialiased = isAntialiased;
    if (isNew) this.#allocate(slots, shDegree);
    const bytes = this.#base.write(base) + (this.#sh?.write(sh) ?? 0);
    this.onchange();
    return bytes;
  }

  /** Spark sorts. */
  setOrder() {}

  /** Frees what it has on the GPU. */
  delete() {
    this.#base.texture.dispose();
    this.#sh?.texture.dispose();
  }

  get count() {
    return this.#slots;
  }

  #allocate(slots, shDegree) {
    this.delete();
    this.#slots = slots;
    this.#shDegree = shDegree;
    this.#base = new Rows(BASE_TEXELS, slots);
    this.#sh = shDegree > 0 ? new Rows(SH_TEXELS[shDegree], slots) : null;
    this.#uniforms.base.value = this.#base.texture;
    this.#uniforms.harmonics.value = (this.#sh ?? this.#base).texture;
    this.setMaxSh(this.#maxSh);
  }

  // From here on what Spark asks of a SplatSource.

  prepareFetchSplat() {}

  dispose() {
    this.delete();
  }

  getNumSplats() {
    return this.#slots;
  }

  getNumSh() {
    return this.#shDegree;
  }

  hasRgbDir() {
    return this.#uniforms.degree.value > 0;
  }

  setMaxSh(maxSh) {
    this.#maxSh = maxSh;
    this.#uniforms.degree.value = Math.min(maxSh, this.#shDegree);
  }

  fetchSplat({ index, viewOrigin = dyno.dynoConst('vec3', new Vector3()) }) {
    return new dyno.Dyno({
      inTypes: { index: 'int', base: 'usampler2D', harmonics: 'usampler2D', degree: 'int', origin: 'vec3' },
      outTypes: { gsplat: dyno.Gsplat },
      inputs: { index, ...this.#uniforms, origin: viewOrigin },
      globals: () => [dyno.defineGsplat, SLOTS],
      statements: ({ inputs, outputs }) => STATEMENTS(inputs, outputs.gsplat).split('\n'),
    }).outputs.gsplat;
  }

  forEachSplat(callback) {
    const [position, scale, rotation, colour] = [new Vector3(), new Vector3(), new Quaternion(), new Color()];
    for (let slot = 0; slot < this.#slots; slot++) {
      const found = gaussian(this.#base.words, slot);
      if (found.opacity === 0) continue;
      const [w, ...rest] = found.rotation;
      callback(slot, position.set(...found.position), scale.set(...found.scale), rotation.set(...rest, w), found.opacity, colour.set(...found.colour));
    }
  }
}

/** A stream as a SplatMesh: see spark.d.ts. */
export class StreamMesh extends playable(SplatMesh) {
  #splats;

  constructor(source, options = {}) {
    const splats = new StreamSplats();
    super({ raycastable: false, ...options, splats });
    this.#splats = splats;
    splats.onchange = () => this.updateVersion();
    this.openStream(source, options, splats);
  }

  /** Whether the scene was made for a renderer that compensates its low-pass filter. */
  get isAntialiased() {
    return this.#splats.isAntialiased;
  }

  /** Spark calls it before each picture. */
  update(context) {
    this.tick();
    super.update(context);
  }

  dispose() {
    this.closeStream();
    super.dispose();
  }

  announce(type, detail) {
    this.dispatchEvent({ type, detail });
  }
}
