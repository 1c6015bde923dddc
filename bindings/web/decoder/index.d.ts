/** Which units of a stream are decoded. Axes that are left out, and what the stream does not have, are at their highest. */
export interface OperatingPoint {
  spatial?: number;
  temporal?: number;
  refinement?: number;
}

/** A frame that has been decoded. */
export interface Frame {
  isEnd: false;
  /** Position in display order, from 0. */
  index: number;
  /** When it is shown, seconds from the start. */
  time: number;
  gaussians: number;
  /** How many of the Gaussians are those of an earlier frame, moved: they stand in for refinements that are not there. */
  carried: number;
  /** How many refinements it shows exactly. */
  refinements: number;
  /** Whether it refers to no other frame. */
  isKeyframe: boolean;
  /** The operating point that it was decoded at. */
  point: Required<OperatingPoint>;
  /** Digest of clause 7.9, 16 hexadecimal digits; null where nothing is exact. */
  digest: string | null;
  /** Bytes of the units that were decoded; from the worker, of all frames since the one given before. */
  bytes: number;
  /** The frame stands until the one with this index: `index + 1`, of packages that of the next frame at the operating point. */
  until: number;
  /** Of packages: the clock goes on from this frame, since it is the first one, or GOPs before it were skipped. */
  isJump: boolean;
  /** What was lost since the frame before, in English. */
  warnings: string[];
}

/** After the last frame. */
export interface End {
  isEnd: true;
  warnings: string[];
}

/** Rows of a texture that have changed: four 32-bit words a texel, 512 Gaussians a row. */
export interface Run {
  row: number;
  rows: number;
  words: Uint32Array;
}

/** What a frame has changed in the textures. A Gaussian keeps its slot as long as it lives; free slots have opacity 0. */
export interface Update {
  /** Slots of the textures, a multiple of 512. */
  slots: number;
  /** The textures have another size than before, and all rows are there. */
  isNew: boolean;
  shDegree: 0 | 1 | 2 | 3;
  /** The scene was made for a renderer that compensates its low-pass filter. */
  isAntialiased: boolean;
  kept: number;
  appeared: number;
  disappeared: number;
  /** Texture of geometry and colour, two texels a Gaussian; `wasm/src/texels.rs` of the repository has the words. */
  base: Run[];
  /** Texture of the spherical harmonics: 0, 2, 3 or 6 texels a Gaussian. */
  sh: Run[];
}

/** An order to draw in. */
export interface Order {
  /** Slots in front of the camera, farthest first. */
  slots: Uint32Array;
  /** Depth from which Gaussians are drawn. */
  near: number;
}

export type Vector = [number, number, number];

/** A camera of a stream. */
export interface Pose {
  position: Vector;
  /** From the camera (x right, y down, z ahead) to the world: w, x, y, z. */
  rotation: [number, number, number, number];
  /** Vertical angle of view, radians. */
  field: number;
}

/** What a stream says of itself. */
export interface Description {
  title: string;
  /** 0 if the stream does not say it. */
  frames: number;
  frameSeconds: number;
  /** The operating point of everything. */
  highest: Required<OperatingPoint>;
  upAxis: 'unknown' | '+x' | '-x' | '+y' | '-y' | '+z' | '-z';
  /** Red, green and blue, 0 to 1. */
  background: Vector | null;
  cameras: Pose[];
}

/** Bytes: an ArrayBuffer, or any view of one. Of a Blob that is `await blob.arrayBuffer()`. */
export type Bytes = ArrayBufferLike | ArrayBufferView;

/** Gaussians in a row of a texture: 512. */
export const ROW: number;

/** Whether this engine has the instructions that the faster module uses. */
export function hasSimd(): boolean;

/** The module for this engine, from the files of the package: for streams, or for packages too. */
export function loadModule(options?: { packages?: boolean }): Promise<WebAssembly.Module>;

/** Decodes one stream in the thread that calls. */
export class Decoder {
  constructor(module: WebAssembly.Module);
  /** A decoder with the module for this engine. */
  static load(): Promise<Decoder>;
  /** Bytes of memory that the decoder has taken. */
  readonly memory: number;
  /** Takes the next bytes. Throws if they are more than 1 GiB in all; a TypeError if they are of another type. */
  push(bytes: Bytes): void;
  /** No more bytes will come. */
  end(): void;
  /** Decodes the next frame; null if more bytes have to come first. Throws if the stream cannot be decoded at all. */
  next(): Frame | End | null;
  /** Puts the frame that was decoded last into the textures. */
  show(): Update;
  /** All rows of the textures as they are after `show`, for those whose GPU has lost them; null before that. */
  whole(): Update | null;
  /** Sorts the frame that was shown last for a camera; `ahead` is a unit vector. */
  sort(position: Vector, ahead: Vector): Order;
  /** Goes to a frame: the next one has this index, or a higher one where that is missing. */
  seek(index: number): void;
  /** Changes the operating point, from the next GOP on, and where it is lower on some axis, from the next frame on. */
  setPoint(point: OperatingPoint): void;
  /** What the stream says of itself; null before the first frame. */
  describe(): Description | null;
}

/**
 * A stream: at an address, which may be relative to the page, in memory, or pushed in pieces. Or a package for DASH: at the address of its `manifest.json`, of its
 * folder, or of its MPD. `url` takes both: a folder ends with a slash, an MPD with `.mpd`, and anything else is a package if it
 * is JSON. `package` needs no slash.
 */
export type Source = { url: string } | { package: string } | { bytes: Bytes } | Record<string, never>;

/** What is known of the playback of a package. */
export interface PackageState {
  /** The playhead waits for bytes. */
  isWaiting: boolean;
  /** The GOP that the playhead is in. */
  gop: number;
  /** Seconds that are buffered. */
  buffer: number;
  /** Display index up to which frames are buffered. */
  buffered: number;
  /** Bits a second that the network carried in the last seconds, 0 if that is not known; seconds to the first byte. */
  throughput: number;
  latency: number;
  /** What is shown of the GOP that began last: without a temporal layer one picture stands for all of it. */
  point: { spatial: number; temporal: number | null; refinement: number } | null;
  /** Its quality as the manifest says it, dB, and its bits a second. */
  quality: number;
  rate: number;
  /** Times that playback stood still between two GOPs, and seconds of these. */
  stalls: number;
  stalled: number;
  bytes: number;
  requests: number;
  failures: number;
  /** Fetches that were given up for others. */
  abandoned: number;
  /** Whether the presentation still grows. The next four are display indices, and change then. */
  isLive: boolean;
  /** The first frame that can be shown. */
  first: number;
  /** The frame after the last one that is there. */
  frames: number;
  /** Where playback near the end starts: who seeks this or a later frame follows the presentation. */
  edge: number;
  /** Whether playback stays behind, after a seek to an earlier frame or a pause; otherwise it keeps to the latency that is aimed at. */
  isBehind: boolean;
  /** Seconds from capture to display; null where nothing grows. */
  delay: number | null;
  /** Rate of playback that keeps to the latency that is aimed at: 1, or a little less or more. */
  pace: number;
}

/** From where a scene is seen; `ahead` is a unit vector. */
export interface View {
  position: Vector;
  ahead: Vector;
}

export interface WorkerOptions {
  /** Without any axis: everything, and of a package what the network allows. */
  point?: OperatingPoint;
  /** The module or its bytes; by default the file of the package. */
  module?: WebAssembly.Module | Uint8Array | null;
  /** Makes the worker, in pages that have no file of it. */
  startWorker?: () => Worker;
}

/** `detail` of the events of a DecoderWorker. */
export interface WorkerEvents {
  description: { description: Description };
  frame: {
    wanted: number;
    frame: Frame;
    update: Update;
    order: Order;
    /** Milliseconds. */
    times: { decode: number; pack: number; sort: number };
    memory: number;
  };
  order: { order: Order; time: number };
  /** All of what is shown, after `renew`. */
  renewed: { update: Update; order: Order };
  received: { bytes: number; total: number | null };
  /** More bytes have to come before the frame that was asked for. */
  waiting: Record<string, never>;
  /** Several times a second, of a package. */
  package: { state: PackageState };
  /** The frame that stands still can be had better: ask for it again. */
  better: { index: number };
  /** The frame that stands still is the best that can be had, since all of its GOP is there that the operating point has. */
  best: { index: number };
  end: { wanted: number; warnings: string[] };
  error: { message: string };
}

/** Decodes and sorts in a worker: events are CustomEvents with the details of WorkerEvents. */
export class DecoderWorker extends EventTarget {
  /** Throws a TypeError where bytes of the source are of another type. */
  constructor(source: Source, options?: WorkerOptions);
  /** The next bytes of a source that is pushed; `total` is the length of the stream, if that is known. */
  push(bytes: Bytes, total?: number | null): void;
  /** No more bytes will be pushed. */
  finish(): void;
  /** Asks for a frame, sorted for a view, or with null not sorted: the answer is `frame` with this index or a higher one, or `end`. */
  show(index: number, view: View | null): void;
  /** Asks for all rows of what is shown and an order, where the GPU has lost them: the answer is `renewed`; none before the first frame. */
  renew(): void;
  /** Sorts the frame that was given last for another view. */
  sort(view: View): void;
  /** Changes the operating point; frames that are asked for after this have it. `{}` leaves that of a package to the network. */
  setPoint(point: OperatingPoint): void;
  /** Says how fast a package is played, 1 being its own speed; 0 while it stands still, in which time what is shown gets better. */
  run(speed: number): void;
  /** Ends the worker. */
  close(): void;
}
