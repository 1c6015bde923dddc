// Reads the files of a package with mp4box, a reader that knows nothing of this project, and compares what it finds: levels,
// tracks, sizes of subsegments and of their levels. Usage: node boxes.mjs FOLDER_OF_MP4BOX DIRECTORY...
import assert from "node:assert/strict";
import fs from "node:fs";
import path from "node:path";
import { createRequire } from "node:module";

const [modules, ...directories] = process.argv.slice(2);
const { createFile, MP4BoxBuffer } = createRequire(path.resolve(modules, "x.js"))("mp4box");

function parse(name) {
  const bytes = fs.readFileSync(name);
  const file = createFile();
  let ready = null;
  file.onError = (error) => assert.fail(`${name}: ${error}`);
  file.onReady = (info) => (ready = info);
  file.appendBuffer(MP4BoxBuffer.fromArrayBuffer(new Uint8Array(bytes).buffer, 0), true);
  file.flush();
  assert.ok(ready, `${name}: mp4box finds no movie`);
  return { file, info: ready, size: bytes.length };
}

// The boxes of fragments in order, as [moof, mdat] pairs.
function fragments(file) {
  const boxes = file.boxes.filter((box) => box.type === "moof" || box.type === "mdat");
  return boxes.flatMap((box, index) => (box.type === "moof" ? [[box, boxes[index + 1]]] : []));
}

function check(name) {
  const { file, info, size } = parse(name);
  const levels = info.tracks.length;
  info.tracks.forEach((track, index) => {
    assert.equal(track.id, index + 1);
    assert.equal(track.codec, "gss1");
    assert.equal(track.nb_samples, info.tracks[0].nb_samples, `${name}: tracks have the same samples`);
  });
  const pairs = fragments(file);
  const sidx = file.boxes.find((box) => box.type === "sidx");
  const ssix = file.boxes.find((box) => box.type === "ssix");
  assert.equal(pairs.length, sidx.references.length * levels);
  if (levels > 1) {
    const leva = file.moov.mvex.boxes.find((box) => box.type === "leva");
    const of = leva.levels.map((level) => [level.track_ID, level.assignment_type]);
    assert.deepEqual(of, info.tracks.map((track) => [track.id, 3]));
    assert.equal(ssix.subsegments.length, sidx.references.length);
  }
  let at = sidx.start + sidx.size + sidx.first_offset;
  sidx.references.forEach((reference, index) => {
    const of = pairs.slice(index * levels, (index + 1) * levels);
    const sizes = of.map(([moof, mdat]) => moof.size + mdat.size);
    assert.equal(of[0][0].start, at, `${name}: subsegment ${index} is where sidx says`);
    assert.equal(sizes.reduce((sum, one) => sum + one, 0), reference.referenced_size);
    at += reference.referenced_size;
    if (levels > 1) {
      const ranges = new Array(levels).fill(0);
      ssix.subsegments[index].ranges.forEach((range) => (ranges[range.level - 1] += range.range_size));
      assert.deepEqual(ranges, sizes, `${name}: levels of subsegment ${index}`);
    }
  });
  const tail = file.boxes.find((box) => box.type === "gssT")?.size ?? 0;
  assert.equal(at + tail, size, `${name}: nothing is left over`);
  return { subsegments: sidx.references.length, samples: info.tracks[0].nb_samples * levels };
}

for (const directory of directories) {
  const names = fs.readdirSync(directory).filter((name) => name.endsWith(".mp4"));
  assert.ok(names.length > 0, `${directory} has no files`);
  const found = names.map((name) => check(path.join(directory, name)));
  const sum = (key) => found.reduce((all, one) => all + one[key], 0);
  console.log(`${directory}: ${names.length} files, ${sum("subsegments")} subsegments, ${sum("samples")} samples`);
}
