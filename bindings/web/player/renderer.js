// Draws Gaussians with WebGL 2: instanced quads, farthest first.

import { ROW } from '@splatstream/decoder';
import { FRAGMENT, VERTEX } from './shaders.js';
import { BASE_TEXELS, SH_TEXELS } from './texels.js';

/** Slots in a row of the texture of the order, and Gaussians of an instance: few vertices keep a GPU waiting. */
const ORDER_ROW = 1024;
const BATCH = 128;

/** The Gaussians of one stream on the GPU. */
export class Scene {
  #renderer;
  #gl;
  /** The generation of the renderer that the textures are of. */
  #generation = null;
  #count = 0;
  #base = null;
  #sh = null;
  #order = null;
  #slots = 0;

  constructor(renderer) {
    this.#renderer = renderer;
    this.#gl = renderer.gl;
    this.near = 0;
    this.shDegree = 0;
    this.isAntialiased = false;
  }

  /** Gaussians that are drawn. */
  get count() {
    return this.#isThere ? this.#count : 0;
  }

  /** Whether the GPU has its textures, and has not lost them. */
  get #isThere() {
    return this.#generation === this.#renderer.generation && !this.#gl.isContextLost();
  }

  /**
   * Takes what a frame has changed, as the worker posts it; gives the bytes that were copied to the GPU. Where that has lost
   * everything, nothing is taken up to an update of all rows.
   */
  update({ slots, isNew, shDegree, isAntialiased, base, sh }) {
    if (isNew && !this.#gl.isContextLost()) this.#allocate(slots, shDegree);
    if (!this.#isThere) return 0;
    this.isAntialiased = isAntialiased;
    return this.#copy(this.#base, base, BASE_TEXELS) + this.#copy(this.#sh, sh, SH_TEXELS[shDegree]);
  }

  /** Takes an order to draw in. */
  setOrder({ slots, near }) {
    const gl = this.#gl;
    this.#count = Math.min(slots.length, this.#slots);
    this.near = near;
    const { count } = this;
    if (count === 0) return;
    gl.bindTexture(gl.TEXTURE_2D, this.#order);
    const rows = Math.floor(count / ORDER_ROW);
    const put = (row, width, height, from) =>
      gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, row, width, height, gl.RED_INTEGER, gl.UNSIGNED_INT, slots, from);
    if (rows > 0) put(0, ORDER_ROW, rows, 0);
    if (count > rows * ORDER_ROW) put(rows, count - rows * ORDER_ROW, 1, rows * ORDER_ROW);
  }

  /** Binds the textures: the base to unit 0, the spherical harmonics to unit 1, the order to unit 2. */
  bind() {
    const gl = this.#gl;
    for (const [unit, texture] of [this.#base, this.#sh ?? this.#base, this.#order].entries()) {
      gl.activeTexture(gl.TEXTURE0 + unit);
      gl.bindTexture(gl.TEXTURE_2D, texture);
    }
  }

  /** Frees what it has on the GPU. */
  delete() {
    if (!this.#isThere) return;
    for (const texture of [this.#base, this.#sh, this.#order]) this.#gl.deleteTexture(texture);
  }

  #allocate(slots, shDegree) {
    const gl = this.#gl;
    this.delete();
    const rows = slots / ROW;
    const limit = gl.getParameter(gl.MAX_TEXTURE_SIZE);
    if (rows > limit) throw new Error(`${slots} Gaussians are more than this GPU takes: ${limit * ROW}`);
    this.#base = this.#texture(gl.RGBA32UI, ROW * BASE_TEXELS, rows);
    this.#sh = shDegree > 0 ? this.#texture(gl.RGBA32UI, ROW * SH_TEXELS[shDegree], rows) : null;
    this.#order = this.#texture(gl.R32UI, ORDER_ROW, Math.ceil(slots / ORDER_ROW));
    this.#slots = slots;
    this.#generation = this.#renderer.generation;
    this.shDegree = shDegree;
  }

  #texture(format, width, height) {
    const gl = this.#gl;
    const texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.texStorage2D(gl.TEXTURE_2D, 1, format, width, height);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
    return texture;
  }

  #copy(texture, runs, texels) {
    const gl = this.#gl;
    gl.bindTexture(gl.TEXTURE_2D, texture);
    let bytes = 0;
    for (const { row, rows, words } of runs) {
      gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, row, ROW * texels, rows, gl.RGBA_INTEGER, gl.UNSIGNED_INT, words);
      bytes += words.byteLength;
    }
    return bytes;
  }
}

/** Draws scenes into a canvas. */
export class Renderer {
  /** How many times it was prepared. */
  generation = 0;
  #program;
  #uniforms = {};
  /** The triangles of an instance. */
  #triangles;

  constructor(canvas) {
    const gl = canvas.getContext('webgl2', { antialias: false, depth: false, powerPreference: 'high-performance' });
    if (!gl) throw new Error('This browser has no WebGL 2.');
    this.gl = gl;
    this.canvas = canvas;
    this.prepare();
  }

  /** Makes what a context needs, also after it was lost and restored; scenes need an update of all rows then. */
  prepare() {
    const gl = this.gl;
    this.generation += 1;
    this.#program = link(gl, VERTEX, FRAGMENT);
    const names = ['base', 'harmonics', 'shDegree', 'isAntialiased', 'position', 'axes', 'focal', 'size', 'near', 'order', 'count'];
    for (const name of names) this.#uniforms[name] = gl.getUniformLocation(this.#program, name);
    this.#triangles = triangles(gl);
    gl.disable(gl.DEPTH_TEST);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
  }

  /** Sets the size of the picture, pixels. */
  resize(width, height) {
    if (this.canvas.width === width && this.canvas.height === height) return;
    this.canvas.width = width;
    this.canvas.height = height;
  }

  /**
   * Draws a scene as a camera sees it: see Camera in index.d.ts. `part` is the share of the width to draw in, from and to,
   * 0 to 1; what lies outside stays.
   */
  draw(scene, camera, background, [from, to] = [0, 1]) {
    const { gl, canvas: { width, height } } = this;
    const [left, right] = [Math.round(from * width), Math.round(to * width)];
    gl.viewport(0, 0, width, height);
    gl.enable(gl.SCISSOR_TEST);
    gl.scissor(left, 0, Math.max(0, right - left), height);
    gl.clearColor(...background, 1);
    gl.clear(gl.COLOR_BUFFER_BIT);
    if (scene.count > 0 && right > left) this.#drawGaussians(scene, camera, [width, height]);
    gl.disable(gl.SCISSOR_TEST);
  }

  #drawGaussians(scene, { position, axes, focal }, size) {
    const { gl } = this;
    const uniforms = this.#uniforms;
    gl.useProgram(this.#program);
    scene.bind();
    gl.bindVertexArray(this.#triangles);
    for (const [unit, name] of ['base', 'harmonics', 'order'].entries()) gl.uniform1i(uniforms[name], unit);
    gl.uniform1i(uniforms.count, scene.count);
    gl.uniform1i(uniforms.shDegree, scene.shDegree);
    gl.uniform1i(uniforms.isAntialiased, scene.isAntialiased ? 1 : 0);
    gl.uniform3fv(uniforms.position, position);
    gl.uniformMatrix3fv(uniforms.axes, false, axes.flat());
    gl.uniform2f(uniforms.focal, focal, focal);
    gl.uniform2fv(uniforms.size, size);
    gl.uniform1f(uniforms.near, scene.near);
    gl.drawElementsInstanced(gl.TRIANGLES, 6 * BATCH, gl.UNSIGNED_SHORT, 0, Math.ceil(scene.count / BATCH));
    gl.bindVertexArray(null);
  }
}

/** The vertex array of an instance: two triangles for each of its Gaussians. */
function triangles(gl) {
  const indices = Uint16Array.from({ length: 6 * BATCH }, (_, at) => 4 * Math.floor(at / 6) + [0, 1, 2, 2, 1, 3][at % 6]);
  const array = gl.createVertexArray();
  gl.bindVertexArray(array);
  gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
  gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, indices, gl.STATIC_DRAW);
  gl.bindVertexArray(null);
  return array;
}

function link(gl, vertex, fragment) {
  const program = gl.createProgram();
  for (const [kind, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    gl.attachShader(program, shader);
  }
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS) && !gl.isContextLost()) {
    const logs = gl.getAttachedShaders(program).map((shader) => gl.getShaderInfoLog(shader));
    throw new Error(`The GPU refuses the program: ${gl.getProgramInfoLog(program)} ${logs.join(' ')}`);
  }
  return program;
}
