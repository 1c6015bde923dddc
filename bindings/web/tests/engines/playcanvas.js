// What engines.test.mjs does with PlayCanvas, in the page.
import { StreamEntity } from '@splatstream/player/playcanvas';
import * as pc from 'playcanvas';

/** A scene of a size in pixels. */
export async function makeEngine(width, height) {
  const canvas = document.createElement('canvas');
  document.body.append(canvas);
  const app = new pc.Application(canvas, { graphicsDeviceOptions: { antialias: false, preserveDrawingBuffer: true } });
  app.graphicsDevice.maxPixelRatio = 1;
  app.setCanvasFillMode(pc.FILLMODE_NONE, width, height);
  app.setCanvasResolution(pc.RESOLUTION_FIXED, width, height);
  app.autoRender = false;
  const camera = new pc.Entity('camera', app);
  camera.addComponent('camera', { clearColor: new pc.Color(0, 0, 0), nearClip: 0.01, farClip: 100 });
  app.root.addChild(camera);
  let isReady = false;
  app.systems.gsplat.on('frame:ready', (_camera, _layer, ready) => (isReady = ready));
  app.start();
  return {
    canvas,
    add(url, options) {
      const entity = new StreamEntity(app, { url }, options);
      app.root.addChild(entity);
      return entity;
    },
    listen: (entity, type, handler) => entity.on(type, handler),
    transform(entity, { move, turn }) {
      entity.setPosition(...move);
      entity.setEulerAngles(0, (turn * 180) / Math.PI, 0);
    },
    look({ position, axes: [right, down, ahead], field }) {
      camera.camera.fov = (field * 180) / Math.PI;
      const columns = [right, down.map((part) => -part), ahead.map((part) => -part)].map((column) => new pc.Vec3(column));
      camera.setPosition(...position);
      camera.setRotation(new pc.Quat().setFromMat4(new pc.Mat4().set([...columns.flatMap(({ x, y, z }) => [x, y, z, 0]), 0, 0, 0, 1])));
    },
    isBusy: () => !isReady,
    draw: () => new Promise((resolve) => {
      app.once('frameend', resolve);
      app.renderNextFrame = true;
    }),
    remove(entity) {
      entity.dispose();
      // Where nothing is left, nothing is said any more.
      isReady = true;
    },
    textures: () => app.graphicsDevice.textures.size,
  };
}
