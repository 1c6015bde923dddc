// The page of engines.test.mjs: an engine with objects that play streams.

const pause = (time) => new Promise((resolve) => setTimeout(resolve, time));
/** Pictures in a row in which an engine that sorts beside drawing has nothing to do, and the time between pictures, milliseconds. */
const [CALM, BETWEEN] = [3, 10];
/** Pictures after which an engine would be at rest. */
const MOST = 500;

globalThis.objects = {};

globalThis.start = async (name, width, height) => {
  const { makeEngine } = await import(`./${name}.js`);
  globalThis.engine = await makeEngine(width, height);
};

/** Adds an object that plays; resolves once it has its first frame. */
globalThis.add = async (name, url, options) => {
  const object = engine.add(url, options);
  objects[name] = object;
  await new Promise((resolve, reject) => {
    engine.listen(object, 'ready', resolve);
    engine.listen(object, 'failed', ({ message }) => reject(new Error(message)));
  });
};

globalThis.remove = (name) => {
  engine.remove(objects[name]);
  delete objects[name];
};

/** Draws once, and waits for the GPU: where it is slow, pictures would queue up. */
async function draw() {
  await engine.draw();
  const gl = engine.canvas.getContext('webgl2');
  const drawn = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
  do await pause(BETWEEN);
  while (gl.clientWaitSync(drawn, gl.SYNC_FLUSH_COMMANDS_BIT, 0) === gl.TIMEOUT_EXPIRED);
  gl.deleteSync(drawn);
}

/** Draws until nothing changes any more. */
async function settle() {
  for (let calm = 0, count = 0; calm < CALM; calm = engine.isBusy() ? 0 : calm + 1, count++) {
    if (count > MOST) throw new Error('the engine does not come to rest');
    await draw();
  }
}

/** The picture of a camera, or of the one before, as PNG in base64. */
globalThis.picture = async (camera) => {
  if (camera) engine.look(camera);
  await settle();
  return engine.canvas.toDataURL().split(',')[1];
};

/** Indices of the frames that are shown until the stream has started again, and so many frames more. */
globalThis.seenFrames = async (name, more) => {
  const seen = [];
  engine.listen(objects[name], 'frame', ({ index }) => seen.push(index));
  const round = () => seen.findIndex((index, place) => place > 0 && index < seen[place - 1]);
  for (let count = 0; count < 3000 && (round() < 0 || seen.length < round() + more); count++) await draw();
  return seen;
};

/** Textures that the engine has once nothing changes. */
globalThis.settledTextures = async () => {
  await settle();
  return engine.textures();
};
