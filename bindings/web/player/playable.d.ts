import type { Bytes, Description, Frame, OperatingPoint } from '@splatstream/decoder';

/** How a stream is played in the scene of an engine. */
export interface StreamOptions {
  /** Plays as soon as there is a frame; default is true. */
  autoplay?: boolean;
  /** Starts again at the end; default is true. */
  loop?: boolean;
  /** Default is everything. */
  point?: OperatingPoint;
  /** The decoder's module or its bytes, for pages without its file. */
  module?: WebAssembly.Module | Uint8Array | null;
  /** Makes a worker, for pages without its file. */
  startWorker?: () => Worker;
}

/** What objects of engines have that play a stream. The engine's pictures drive the clock. */
export interface Playable {
  /** The frame that is shown; null before the first. */
  readonly frame: Frame | null;
  /** What the stream says of itself; null before the first frame. */
  readonly description: Description | null;
  readonly isPlaying: boolean;
  /** Whether the scene was made for a renderer that compensates its low-pass filter. */
  readonly isAntialiased: boolean;
  isLooping: boolean;
  /** 1 is the speed of the stream. */
  speed: number;
  operatingPoint: OperatingPoint;
  readonly statistics: {
    /** Milliseconds, means of the last frames. */
    decode: number;
    pack: number;
    upload: number;
    /** Bytes copied to the GPU per frame. */
    uploaded: number;
    /** Bytes a second of the stream. */
    rate: number;
    /** Bytes of memory of the decoder. */
    memory: number;
  };
  play(): void;
  pause(): void;
  /**
   * Goes to a frame; resolves with the frame that is shown then. Of a stream that is the frame `index` or, where it is missing,
   * the next one. Of a package it is that frame too, as soon as the network has brought it; if the operating point has no such
   * frame, or no more of it can be had, it is the nearest one before, which stands for it: `frame.index <= index < frame.until`.
   * An operating point that is chosen with its highest temporal layer has all frames. A package that plays stands still
   * for this for a second at most; then it plays on, and resolves with what is shown.
   */
  seek(index: number): Promise<Frame | null>;
  /** The next bytes of a source that is pushed; `total` is the length of the stream, if that is known. */
  push(bytes: Bytes, total?: number | null): void;
  /** No more bytes will be pushed. */
  finish(): void;
  /** Ends the worker and frees what is on the GPU. */
  dispose(): void;
}

/** `detail` of the events of a Playable. */
export interface StreamEvents {
  /** The first frame is shown. */
  ready: Description;
  /** A frame is shown: engines that draw on demand draw now. */
  frame: Frame;
  lost: { warnings: string[]; index: number | null };
  failed: { message: string };
}

/** The rotation x, y, z, w that makes what a stream says is up point to +y. */
export function upright(description: Description): [number, number, number, number];
