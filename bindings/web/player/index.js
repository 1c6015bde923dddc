import { SplatPlayer } from './element.js';

export { SplatPlayer } from './element.js';
export { Renderer, Scene } from './renderer.js';
export { Controls } from './controls.js';
export { framing } from './framing.js';

// Servers that render pages have no elements.
if (globalThis.customElements && !customElements.get('splat-player')) customElements.define('splat-player', SplatPlayer);
