// What engines.test.mjs does with Spark, in the page.
import { SparkRenderer } from '@sparkjsdev/spark';
import { StreamMesh } from '@splatstream/player/spark';
import * as THREE from 'three';

/** A scene of a size in pixels. Its picture is that of scenes which are not made for compensated filters. */
export async function makeEngine(width, height) {
  const renderer = new THREE.WebGLRenderer({ antialias: false, preserveDrawingBuffer: true });
  renderer.setPixelRatio(1);
  renderer.setSize(width, height);
  document.body.append(renderer.domElement);
  const scene = new THREE.Scene();
  scene.background = new THREE.Color(0, 0, 0);
  const spark = new SparkRenderer({ renderer, preBlurAmount: 0.3, blurAmount: 0, sortRadial: false, accumExtSplats: true });
  scene.add(spark);
  const camera = new THREE.PerspectiveCamera(40, width / height, 0.01, 100);
  camera.matrixAutoUpdate = false;
  return {
    canvas: renderer.domElement,
    add(url, options) {
      const mesh = new StreamMesh({ url }, options);
      scene.add(mesh);
      return mesh;
    },
    listen: (mesh, type, handler) => mesh.addEventListener(type, ({ detail }) => handler(detail)),
    transform(mesh, { move, turn }) {
      mesh.position.set(...move);
      mesh.rotation.y = turn;
    },
    look({ position, axes: [right, down, ahead], field }) {
      camera.fov = (field * 180) / Math.PI;
      camera.updateProjectionMatrix();
      const [up, back] = [down, ahead].map((axis) => axis.map((part) => -part));
      const columns = [right, up, back, position].map((column) => new THREE.Vector3(...column));
      camera.matrix.makeBasis(...columns).setPosition(columns[3]);
      camera.updateMatrixWorld(true);
    },
    isBusy: () => spark.sorting || spark.sortDirty || spark.display !== spark.current,
    draw: () => renderer.render(scene, camera),
    remove(mesh) {
      scene.remove(mesh);
      mesh.dispose();
    },
    textures: () => renderer.info.memory.textures,
  };
}
