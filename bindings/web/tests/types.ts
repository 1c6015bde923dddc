// What programs in TypeScript write: it compiles if the types fit each other.
import { Decoder, DecoderWorker, type Frame, type WorkerEvents } from '@splatstream/decoder';
import { Renderer, Scene, type SplatPlayer } from '@splatstream/player';

/** Decodes what has come. */
export function take(decoder: Decoder, chunk: Uint8Array): Frame[] {
  decoder.push(chunk);
  const frames: Frame[] = [];
  for (let frame = decoder.next(); frame && !frame.isEnd; frame = decoder.next()) frames.push(frame);
  return frames;
}

/** A player of one's own. */
export function play(url: string, canvas: HTMLCanvasElement): void {
  const renderer = new Renderer(canvas);
  const scene = new Scene(renderer);
  const worker = new DecoderWorker({ url }, { point: { temporal: 0 } });
  worker.addEventListener('frame', (event) => {
    const { update, order } = (event as CustomEvent<WorkerEvents['frame']>).detail;
    scene.update(update);
    scene.setOrder(order);
    renderer.draw(scene, { position: [0, 0, -5], axes: [[1, 0, 0], [0, 1, 0], [0, 0, 1]], focal: 800 }, [0, 0, 0]);
  });
  worker.show(0, { position: [0, 0, -5], ahead: [0, 0, 1] });
}

/** A package of one's own; gives the seconds that are buffered. */
export function stream(url: string): () => number {
  let buffered = 0;
  const worker = new DecoderWorker({ package: url });
  worker.addEventListener('package', (event) => {
    buffered = (event as CustomEvent<WorkerEvents['package']>).detail.state.buffer;
  });
  worker.run(0.5);
  return () => buffered;
}

/** The element. */
export async function last(player: SplatPlayer): Promise<string | null> {
  player.src = 'talk.gss';
  player.controls = false;
  player.theme = 'dark';
  player.operatingPoint = { refinement: 0 };
  player.operatingPoint = (player.statistics.package?.stalls ?? 0) > 0 ? { spatial: 0 } : null;
  const frame = await player.seek((player.description?.frames ?? 1) - 1);
  return frame?.digest ?? null;
}
