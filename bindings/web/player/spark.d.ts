import type { Source } from '@splatstream/decoder';
import type { SplatMesh, SplatMeshOptions } from '@sparkjsdev/spark';
import type { Playable, StreamEvents, StreamOptions } from './playable.js';

export { upright } from './playable.js';
export type { Playable, StreamEvents, StreamOptions } from './playable.js';

/** What a SplatMesh takes beside where its Gaussians are from. */
export type MeshOptions = StreamOptions &
  Pick<SplatMeshOptions, 'editable' | 'onFrame' | 'objectModifier' | 'objectModifiers' | 'worldModifier' | 'worldModifiers'>;

/** An event of a StreamMesh, as three.js has them. */
export type StreamListener<Type extends keyof StreamEvents> = (event: { type: Type; detail: StreamEvents[Type] }) => void;

/**
 * A stream in a scene with a SparkRenderer: a SplatMesh, with everything that it can do but raycasting and levels of detail.
 * Spark compensates the low-pass filter of all scenes by default. Of those that are not made for that, as `isAntialiased`
 * says, `new SparkRenderer({ preBlurAmount: 0.3, blurAmount: 0, ... })` gives the picture that they were made for.
 */
export interface StreamMesh extends Playable {}
export class StreamMesh extends SplatMesh {
  constructor(source: Source, options?: MeshOptions);
  dispose(): void;
  addEventListener(type: string, listener: (event: any) => void): void;
  addEventListener<Type extends keyof StreamEvents>(type: Type, listener: StreamListener<Type>): void;
}
