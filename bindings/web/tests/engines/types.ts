// What programs in TypeScript write with engines: it compiles if the types fit those of the engines.
import { StreamEntity } from '@splatstream/player/playcanvas';
import { StreamMesh, upright, type Playable } from '@splatstream/player/spark';
import type { AppBase } from 'playcanvas';
import type { Scene } from 'three';

/** A stream in a scene of three.js. */
export function inThree(scene: Scene, url: string): StreamMesh {
  const mesh = new StreamMesh({ url }, { point: { refinement: 1 }, loop: false, editable: false });
  mesh.addEventListener('ready', ({ detail }) => mesh.quaternion.set(...upright(detail)));
  mesh.addEventListener('frame', ({ detail }) => console.log(detail.index, mesh.numSplats));
  scene.add(mesh);
  return mesh;
}

/** A stream in a scene of PlayCanvas. */
export function inPlayCanvas(app: AppBase, bytes: Uint8Array): StreamEntity {
  const entity = new StreamEntity(app, { bytes }, { autoplay: false });
  entity.on('lost', ({ warnings }: { warnings: string[] }) => console.warn(warnings));
  app.root.addChild(entity);
  entity.setPosition(1, 0, 0);
  return entity;
}

/** Either of them. */
export async function last(stream: Playable): Promise<number> {
  stream.operatingPoint = { spatial: 0 };
  const frame = await stream.seek((stream.description?.frames ?? 1) - 1);
  stream.dispose();
  return frame?.index ?? 0;
}
