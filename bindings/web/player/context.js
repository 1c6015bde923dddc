// The WebGL context of a canvas: given up while the canvas is in no page, taken back when it is again, and what the browser
// takes away is used again when it comes back. Browsers have few contexts, and take the oldest one for one more.

/** Those that the browser has taken away from canvases in pages, the first one first. */
const missing = new Set();

export class Context {
  /** Called when the browser has taken the context away. */
  onlost = () => {};
  /** Called when the context is there again, with nothing in it. */
  onrestored = () => {};
  #gl;
  #extension;
  #isUnused = false;
  /** Whether it has been given up here, and whether the canvas has heard of that: until then it cannot be taken back. */
  #isGivenUp = false;
  #isGone = false;

  constructor(gl) {
    this.#gl = gl;
    // A lost context gives no extension.
    this.#extension = gl.getExtension('WEBGL_lose_context');
    gl.canvas.addEventListener('webglcontextlost', (event) => this.#lost(event));
    gl.canvas.addEventListener('webglcontextrestored', () => this.#restored());
  }

  /** Gives the context up; one that is missing comes back for it. */
  release() {
    this.#isUnused = true;
    missing.delete(this);
    if (this.#gl.isContextLost()) return;
    this.#isGivenUp = true;
    this.#extension?.loseContext();
    // Chromium does not restore by itself what it has taken away.
    const [first] = missing;
    first?.#comeBack();
  }

  /** Takes the context back. */
  retake() {
    this.#isUnused = false;
    const isTold = this.#isGone || !this.#isGivenUp;
    if (!this.#gl.isContextLost() || !isTold) return;
    [this.#isGivenUp, this.#isGone] = [false, false];
    this.#comeBack();
  }

  /** Asks for the context. Until it is there, it is the last one of those that are missing. */
  #comeBack() {
    missing.delete(this);
    missing.add(this);
    this.#extension?.restoreContext();
  }

  #lost(event) {
    // Without this it would never be restored.
    event.preventDefault();
    if (!this.#isGivenUp) return this.#miss();
    this.#isGone = true;
    // It may have been wanted back meanwhile. Browsers restore nothing as long as they tell of the loss.
    setTimeout(() => this.#isUnused || this.retake());
  }

  #miss() {
    if (this.#isUnused) return;
    missing.add(this);
    this.onlost();
  }

  #restored() {
    missing.delete(this);
    if (this.#isUnused) this.release();
    else this.onrestored();
  }
}
