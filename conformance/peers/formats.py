"""Files of other formats beside the tools of their authors: what we write they read, what they write we read.

    python3 conformance/peers/formats.py SCENE... --splatstream BINARY [--cache FOLDER]

Each scene (PLY, .splat, .spz ...) is encoded, and decoded once to PLY: that is the reference of all that follows, so that
nothing is measured but the formats. Prints a table of the PSNR of pictures (compare --cameras ring:12) and bytes, and fails
where a tool does not read a file, counts differ, or a file of ours is worse by more than 0.1 dB than theirs.
Packages are installed into the cache, as by run.py.
"""

import argparse
import json
import math
import os
import sys

import tools
import transform
from measure import Package, run

KSPLAT = Package("npm", "@mkkellogg/gaussian-splats-3d", "0.4.7")
VALIDATOR = Package("npm", "gltf-validator", "2.0.0-dev.3.10")
SPLATS4D = Package("pip", "splats4d", "0.1.0")

# Theirs is as good as ours within this, decibels, in twelve views: in four, two files with equal errors of all values were
# 0.14 dB apart.
TOLERANCE = 0.1
# What floats lose on the way through another program.
EXACT = 80


class Checks:
    def __init__(self, binary, box):
        self.binary, self.box, self.failures = binary, box, []

    def row(self, scene, what, psnr, size, least):
        good = psnr >= least
        print("| %s | %s | %s | %s | %s |" % (scene, what, "exact" if math.isinf(psnr) else "%.2f" % psnr,
                                              "{:,}".format(size), "" if good else "FAILED, %.2f wanted" % least))
        if not good:
            self.failures.append((scene, what))

    def ours(self, *arguments):
        return run([self.binary, *map(str, arguments)])

    def psnr(self, path, reference):
        """Of pictures of a file beside the reference; every Gaussian must be there."""
        out = json.loads(self.ours("compare", path, reference, "--cameras", "ring:12", "--height", "360", "--json"))
        assert out["gaussians_a"] == out["gaussians_b"], "%s has %d Gaussians, %d are wanted" % (
            path, out["gaussians_a"], out["gaussians_b"])
        return math.inf if out["psnr_db"] is None else out["psnr_db"]

    def scene(self, path):
        name = os.path.splitext(os.path.basename(path))[0]
        stream, reference = self.box.scratch(name + ".gss"), self.box.scratch(name + ".ply")
        self.ours("encode", path, "-o", stream, "--psnr", "55", "--preset", "fast")
        self.ours("decode", stream, "-o", reference)
        for suffix in ("compressed.ply", "sog"):
            self.beside_theirs(name, stream, reference, suffix)
        self.glb(name, stream, reference)
        for level in (0, 1, 2):
            self.ksplat(name, reference, level)

    def beside_theirs(self, name, stream, reference, suffix):
        """A lossy format: ours and theirs, each read by the other side."""
        written, theirs = self.box.scratch("ours." + suffix), self.box.scratch("theirs." + suffix)
        self.ours("decode", stream, "-o", written)
        transform.convert(self.box, [{"in": reference, "out": theirs}], suffix, {"iterations": 10}, decode=False)
        least = self.psnr(theirs, reference) - TOLERANCE
        back = self.box.scratch("back.ply")
        transform.convert(self.box, [{"in": written, "out": back}], "ply", {}, decode=False)
        size = os.path.getsize(written)
        self.row(name, "%s, ours, read by us" % suffix, self.psnr(written, reference), size, least)
        self.row(name, "%s, ours, read by splat-transform" % suffix, self.psnr(back, reference), size, least)
        self.row(name, "%s, theirs, read by us" % suffix, least + TOLERANCE, os.path.getsize(theirs), 0)

    def glb(self, name, stream, reference):
        written, theirs = self.box.scratch("ours.glb"), self.box.scratch("theirs.glb")
        self.ours("decode", stream, "-o", written)
        transform.convert(self.box, [{"in": reference, "out": theirs}], "glb", {}, decode=False)
        for path, whose in ((written, "ours"), (theirs, "theirs")):
            self.row(name, "glb, %s, read by us" % whose, self.psnr(path, reference), os.path.getsize(path), EXACT)
        job = {"module": self.box.entry(VALIDATOR), "file": written}
        issues = self.box.node("formats.mjs", {"validate": job})["issues"]
        assert issues["numErrors"] == 0 and issues["numWarnings"] == 0, json.dumps(issues, indent=1)

    def ksplat(self, name, reference, level):
        written, back = self.box.scratch("theirs.ksplat"), self.box.scratch("back.ply")
        folder = os.path.dirname(self.box.entry(KSPLAT))
        job = {"module": os.path.join(folder, "gaussian-splats-3d.module.js"), "file": reference,
               "out": written, "level": level}
        self.box.node("formats.mjs", {"ksplat": job})
        transform.convert(self.box, [{"in": written, "out": back}], "ply", {}, decode=False)
        size = os.path.getsize(written)
        self.row(name, "ksplat level %d, read as splat-transform does" % level, self.psnr(written, back), size, EXACT - 20)

    def splat4d(self, folder):
        """A sequence of .splat files by splats4D: each frame as its own program decodes it."""
        coded, frame = self.box.scratch("scene.splat4d"), self.box.scratch("frame.splat")
        program = self.box.program("splat4d")
        run([program, "encode", "-i", folder, "-o", coded, "--no-verify"])
        ours = self.box.scratch("frames.gss")
        self.ours("encode", coded, "-o", ours, "--psnr", "40", "--preset", "fast", "--keep-invisible")
        count = json.loads(self.ours("decode", ours, "--dry-run", "--json"))["frames"]
        names = [name for name in os.listdir(folder) if name.endswith(".splat")]
        assert count == len(names), "%d frames, %d are wanted" % (count, len(names))
        run([program, "decode", coded, "--frame", 0, "-o", frame])
        self.row(os.path.basename(folder), "splat4d, first frame as its program decodes it",
                 self.psnr_of_first(coded, frame), os.path.getsize(coded), EXACT - 20)

    def psnr_of_first(self, sequence, frame):
        out = json.loads(self.ours("compare", sequence, frame, "--cameras", "ring:12", "--height", "360", "--json"))
        return math.inf if out["psnr_db"] is None else out["psnr_db"]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="+", help="files; a folder is a sequence of .splat files")
    parser.add_argument("--splatstream", required=True)
    parser.add_argument("--cache", default="target/peers")
    args = parser.parse_args()
    tools.enter(args.cache)
    box = tools.Tools(args.cache, 1, 3600)
    for package in (transform.TRANSFORM, VALIDATOR, KSPLAT, SPLATS4D):
        box.install(package)
    checks = Checks(os.path.abspath(args.splatstream), box)
    print("| scene | file | PSNR, dB | bytes | |\n|---|---|--:|--:|---|")
    for path in args.scenes:
        checks.splat4d(path) if os.path.isdir(path) else checks.scene(path)
    sys.exit(1 if checks.failures else 0)


if __name__ == "__main__":
    main()
