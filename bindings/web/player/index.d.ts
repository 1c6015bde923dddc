import type { Bytes, Description, Frame, OperatingPoint, Order, PackageState, Source, Update, Vector, View } from '@splatstream/decoder';

/** A camera of a picture. */
export interface Camera {
  position: Vector;
  /** Right, down and ahead of the camera in the world. */
  axes: [Vector, Vector, Vector];
  /** Focal length, pixels. */
  focal: number;
}

/** A camera by its vertical angle of view, radians. */
export interface FixedCamera {
  position: Vector;
  axes: [Vector, Vector, Vector];
  field: number;
}

/** The element <splat-player>. README.md has its attributes; events are CustomEvents: `ready` (Description), `frame`
 * (Frame), `lost` ({ warnings, index }), `failed` ({ message }), of packages `package` (PackageState); `contextlost` and
 * `contextrestored`, without detail, when the browser takes the WebGL context away and gives it back. */
export class SplatPlayer extends HTMLElement {
  /** The decoder's module or its bytes, for pages without its file. */
  module: WebAssembly.Module | Uint8Array | null;
  /** The attribute: an address, which may be relative to the page; empty if there is none. To set another one opens it. */
  src: string;
  /** False: `autoplay="no"`. */
  autoplay: boolean;
  /** False: `controls="none"`. */
  controls: boolean;
  /** The attribute: `full`, or empty. */
  resolution: 'full' | '';
  /** The attribute: `light`, `dark`, or empty. */
  theme: 'light' | 'dark' | '';
  /** Makes a worker, for pages without its file. */
  startWorker: (() => Worker) | undefined;
  readonly frame: Frame | null;
  readonly description: Description | null;
  readonly losses: string[];
  readonly isPlaying: boolean;
  /** Null: what the network allows, of a package. To be set before a source is opened, too; the attribute `operating-point` is not changed. */
  operatingPoint: OperatingPoint | null;
  /** A camera in place of the viewer's; null gives it back. */
  set camera(camera: FixedCamera | null);
  /** Red, green and blue, 0 to 1; null: that of the stream, or else of the page. */
  set backgroundColour(colour: Vector | null);
  readonly statistics: {
    /** Milliseconds, means of the last frames. */
    decode: number;
    pack: number;
    sort: number;
    upload: number;
    /** Bytes copied to the GPU per frame. */
    uploaded: number;
    /** Bytes a second of the stream. */
    rate: number;
    /** Bytes of memory of the decoder. */
    memory: number;
    /** Milliseconds from picture to picture. */
    interval: number | null;
    bytes: number;
    total: number | null;
    /** Of a package; null of a stream. */
    package: PackageState | null;
  };
  /** Opens a source in place of the one that is there; throws a TypeError, and leaves that, where bytes are of another type. */
  open(source: Source): void;
  push(bytes: Bytes, total?: number | null): void;
  finish(): void;
  play(): void;
  pause(): void;
  togglePlay(): void;
  /**
   * Goes to a frame; resolves with the frame that is shown then. Of a stream that is the frame `index` or, where it is missing,
   * the next one. Of a package it is that frame too, as soon as the network has brought it; if the operating point has no such
   * frame, or no more of it can be had, it is the nearest one before, which stands for it: `frame.index <= index < frame.until`.
   * An operating point that is chosen with its highest temporal layer has all frames. A package that plays stands still
   * for this for a second at most; then it plays on, and resolves with what is shown.
   */
  seek(index: number): Promise<Frame | null>;
  /** Goes to where a presentation that grows is followed, and plays. */
  goLive(): void;
  /** Pauses and goes some frames on or back. */
  step(frames: number): void;
  /** Turns by steps to the right and upwards. */
  look(right: number, up: number): void;
  changeSpeed(by: 1 | -1): void;
  /** Presses a key of the bar: play, live, loop, quality, compare, info, fly, home, full. */
  press(id: string): void;
  /** Draws at once and gives the pixels as a PNG. */
  snapshot(): Promise<Blob | null>;
}

/** Draws scenes into a canvas with WebGL 2. */
export class Renderer {
  readonly gl: WebGL2RenderingContext;
  readonly canvas: HTMLCanvasElement;
  constructor(canvas: HTMLCanvasElement);
  /** To be called when a context that was lost is restored. Scenes then need an update of all rows: `DecoderWorker.renew`. */
  prepare(): void;
  resize(width: number, height: number): void;
  /** Draws a scene over a background, in a part of the width: from and to, 0 to 1. */
  draw(scene: Scene, camera: Camera, background: Vector, part?: [number, number]): void;
}

/** The Gaussians of one stream on the GPU. */
export class Scene {
  readonly count: number;
  constructor(renderer: Renderer);
  /** Takes what a frame has changed; gives the bytes that were copied. */
  update(update: Update): number;
  setOrder(order: Order): void;
  delete(): void;
}

/** A camera that pointers, touches, the wheel and keys move. */
export class Controls {
  mode: 'orbit' | 'fly';
  onchange: () => void;
  fixed: FixedCamera | null;
  constructor(target: HTMLElement);
  place(views: Views, camera: Views['cameras'][number]): void;
  camera(width: number, height: number): Camera;
  view(): View;
  /** Moves by the keys that are held for so many seconds. */
  tick(seconds: number): void;
  turn(yaw: number, pitch: number): void;
  zoom(factor: number): void;
}

/** From where a scene is looked at. */
export interface Views {
  /** Right, up and front of the world. */
  axes: [Vector, Vector, Vector];
  middle: Vector;
  radius: number;
  cameras: { position: Vector; axes: [Vector, Vector, Vector] | null; ahead?: Vector; field: number }[];
}

/** The views of a scene; `words` is the whole base texture of its first frame. */
export function framing(description: Description, words: Uint32Array): Views;

declare global {
  interface HTMLElementTagNameMap {
    'splat-player': SplatPlayer;
  }
}
