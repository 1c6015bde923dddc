"""peers.json, whose schema README.md describes; written after every point, so that nothing measured is lost."""

import json
import os
import platform


class Report:
    def __init__(self, folder):
        self.folder = folder
        self.path = os.path.join(folder, "peers.json")
        self.scenes, self.results, self.missing = [], [], []
        if os.path.exists(self.path):
            with open(self.path) as file:
                held = json.load(file)
            self.scenes, self.results, self.missing = held["scenes"], held["results"], held["missing"]

    def scene(self, scene):
        path = os.path.dirname(scene.paths[0]) if scene.sequence else scene.paths[0]
        _replace(self.scenes, {"scene": scene.name, "source": scene.source,
                               "reference": os.path.relpath(path, self.folder), "gaussians": scene.gaussians,
                               "frames": len(scene.paths)}, ["scene"])
        self._save()

    def places(self, rate, scene):
        """Where the decoded scene goes: (relative to the report, one path for every frame)."""
        label = "%s.%s.%s" % (scene.name, rate.peer, rate.options)
        label = "".join(c if c.isalnum() or c in "._-" else "_" for c in label)
        names = [os.path.join(label, os.path.basename(path)) for path in scene.paths] if scene.sequence else [
            label + ".ply"]
        paths = [os.path.join(self.folder, "decoded", name) for name in names]
        os.makedirs(os.path.dirname(paths[0]), exist_ok=True)
        return os.path.join("decoded", label if scene.sequence else names[0]), paths

    def result(self, rate, scene, coded, version, place):
        _replace(self.results, {
            "scene": scene.name, "peer": rate.peer, "version": version or "Python " + platform.python_version(),
            "options": rate.options, "bytes": coded.bytes, "gaussians": coded.gaussians, "frames": len(scene.paths),
            "encode_s": round(coded.encode_s, 4), "decode_s": round(coded.decode_s, 4), "timing": coded.timing,
            "decoded": place, "command": coded.command}, ["scene", "peer", "options"])
        self._save()

    def miss(self, peer, scene, why):
        _replace(self.missing, {"peer": peer, "scene": scene, "why": why}, ["peer", "scene", "why"])
        self._save()

    def forget(self, peer, scene, options=""):
        """What is tried again is no longer missing."""
        self.missing = [row for row in self.missing
                        if (row["peer"], row["scene"]) != (peer, scene) or not row["why"].startswith(options)]

    def print_table(self):
        gaussians = {scene["scene"]: scene["gaussians"] for scene in self.scenes}
        row = "%-15s %-14s %-41s %10s %7s %9s %9s"
        print(row % ("scene", "peer", "options", "bytes", "BPG", "encode s", "decode s"))
        for r in sorted(self.results, key=lambda r: (r["scene"], r["peer"])):
            bits = "%.1f" % (8 * r["bytes"] / gaussians[r["scene"]])
            print(row % (r["scene"], r["peer"], r["options"], r["bytes"], bits, r["encode_s"], r["decode_s"]))
        for missing in self.missing:
            print("missing: %(peer)s, scene %(scene)s: %(why)s" % missing)

    def _save(self):
        with open(self.path, "w") as file:
            json.dump({"version": 1, "scenes": self.scenes, "results": self.results, "missing": self.missing}, file,
                      indent=1)
            file.write("\n")


def _replace(rows, row, keys):
    rows[:] = [other for other in rows if any(other[key] != row[key] for key in keys)] + [row]
