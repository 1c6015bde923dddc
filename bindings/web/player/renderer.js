// Draws Gaussians with WebGL 2: instanced quads, farthest first.

import { ROW } from '@splatstream/decoder';
import { FRAGMENT, VERTEX } from './shaders.js';

/** Texels of a Gaussian in the base texture, and in that of the spherical harmonics by their degree. */
const BASE_TEXELS = 2;
const SH_TEXELS = [0, 2, 3, 6];

/** The Gaussians of one stream on the GPU. */
export class Scene {
  #gl;
  #base = null;
  #sh = null;
  #buffer;
  #slots = 0;

  constructor(renderer) {
    this.#gl = renderer.gl;
    this.#buffer = this.#gl.createBuffer();
    this.array = this.#arrayOf(this.#buffer);
    this.count = 0;
    this.near = 0;
    this.shDegree = 0;
    this.isAntialiased = false;
  }

  /** Takes what a frame has changed, as the worker posts it; gives the bytes that were copied to the GPU. */
  update({ slots, isNew, shDegree, isAntialiased, base, sh }) {
    if (isNew) this.#allocate(slots, shDegree);
    this.isAntialiased = isAntialiased;
    return this.#copy(this.#base, base, BASE_TEXELS) + this.#copy(this.#sh, sh, SH_TEXELS[shDegree]);
  }

  /** Takes an order to draw in. */
  setOrder({ slots, near }) {
    const gl = this.#gl;
    gl.bindBuffer(gl.ARRAY_BUFFER, this.#buffer);
    gl.bufferData(gl.ARRAY_BUFFER, slots, gl.DYNAMIC_DRAW);
    this.count = slots.length;
    this.near = near;
  }

  /** Binds the textures: the base to unit 0, the spherical harmonics to unit 1. */
  bind() {
    const gl = this.#gl;
    for (const [unit, texture] of [this.#base, this.#sh ?? this.#base].entries()) {
      gl.activeTexture(gl.TEXTURE0 + unit);
      gl.bindTexture(gl.TEXTURE_2D, texture);
    }
    gl.bindVertexArray(this.array);
  }

  /** Frees what it has on the GPU. */
  delete() {
    const gl = this.#gl;
    gl.deleteTexture(this.#base);
    gl.deleteTexture(this.#sh);
    gl.deleteBuffer(this.#buffer);
    gl.deleteVertexArray(this.array);
  }

  #allocate(slots, shDegree) {
    const gl = this.#gl;
    gl.deleteTexture(this.#base);
    gl.deleteTexture(this.#sh);
    const rows = slots / ROW;
    const limit = gl.getParameter(gl.MAX_TEXTURE_SIZE);
    if (rows > limit) throw new Error(`${slots} Gaussians are more than this GPU takes: ${limit * ROW}`);
    this.#base = this.#texture(BASE_TEXELS, rows);
    this.#sh = shDegree > 0 ? this.#texture(SH_TEXELS[shDegree], rows) : null;
    this.#slots = slots;
    this.shDegree = shDegree;
  }

  #texture(texels, rows) {
    const gl = this.#gl;
    const texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.texStorage2D(gl.TEXTURE_2D, 1, gl.RGBA32UI, ROW * texels, rows);
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

  #arrayOf(buffer) {
    const gl = this.#gl;
    const array = gl.createVertexArray();
    gl.bindVertexArray(array);
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.enableVertexAttribArray(0);
    gl.vertexAttribIPointer(0, 1, gl.UNSIGNED_INT, 0, 0);
    gl.vertexAttribDivisor(0, 1);
    gl.bindVertexArray(null);
    return array;
  }
}

/** Draws scenes into a canvas. */
export class Renderer {
  #program;
  #uniforms = {};

  constructor(canvas) {
    const gl = canvas.getContext('webgl2', { antialias: false, depth: false, powerPreference: 'high-performance' });
    if (!gl) throw new Error('This browser has no WebGL 2.');
    this.gl = gl;
    this.canvas = canvas;
    this.prepare();
  }

  /** Makes what a context needs, also after it was lost and restored; scenes have to be made again then. */
  prepare() {
    const gl = this.gl;
    this.#program = link(gl, VERTEX, FRAGMENT);
    const names = ['base', 'harmonics', 'shDegree', 'isAntialiased', 'position', 'axes', 'focal', 'size', 'near'];
    for (const name of names) this.#uniforms[name] = gl.getUniformLocation(this.#program, name);
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
    gl.uniform1i(uniforms.base, 0);
    gl.uniform1i(uniforms.harmonics, 1);
    gl.uniform1i(uniforms.shDegree, scene.shDegree);
    gl.uniform1i(uniforms.isAntialiased, scene.isAntialiased ? 1 : 0);
    gl.uniform3fv(uniforms.position, position);
    gl.uniformMatrix3fv(uniforms.axes, false, axes.flat());
    gl.uniform2f(uniforms.focal, focal, focal);
    gl.uniform2fv(uniforms.size, size);
    gl.uniform1f(uniforms.near, scene.near);
    gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, scene.count);
    gl.bindVertexArray(null);
  }
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
