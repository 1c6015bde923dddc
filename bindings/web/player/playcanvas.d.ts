import type { Source } from '@splatstream/decoder';
import type { AppBase, Entity } from 'playcanvas';
import type { Playable, StreamOptions } from './playable.js';

export { upright } from './playable.js';
export type { Playable, StreamEvents, StreamOptions } from './playable.js';

/** How a stream is played in a scene of PlayCanvas. */
export interface EntityOptions extends StreamOptions {
  /** The name of the entity. */
  name?: string;
}

/**
 * A stream in a scene of PlayCanvas: an Entity with a gsplat component. Events are fired on the entity, as StreamEvents has
 * them. The engine compensates the low-pass filter of all scenes or of none: `app.scene.gsplat.antiAlias` should be what
 * `isAntialiased` says. Needs a device of WebGL 2.
 */
export interface StreamEntity extends Playable {}
export class StreamEntity extends Entity {
  constructor(app: AppBase, source: Source, options?: EntityOptions);
}
