"""Vectors: what a catalogue says of one, its vector.json, and its files."""

import json
import os

from oracle.conventions import crc32
from oracle.errors import CLASS_OF
from . import expectation, patches

LICENSE = "CC0-1.0"
IN_ORDER = ("schema", "name", "area", "kind", "purpose", "clauses", "requirements", "features", "profile", "level",
            "license", "bytes", "sha256", "inside", "expect", "acceptable", "sweep", "states", "points", "units", "parent",
            "patch", "fault", "generator")


class Vector:
    """A row of a catalogue. `build` gives the bytes; that of an invalid vector takes the bytes of its parent.

    requirements: the ids that it is about, its clauses follow from them; code: that of the first error, to be sure
    that the fault is the one that was meant; the purpose of an invalid vector follows from code and fault. acceptable: codes
    of which each is right, because the faults stand in one unit. inside: a function of the bytes that gives the offset at
    which decoding starts. sweep: whether the stream is cut at every byte.
    """

    def __init__(self, kind, area, name, purpose, requirements, build, recipe, seed=0, parent=None, fault=None,
                 code=None, acceptable=(), inside=None, sweep=False):
        self.kind, self.area, self.name, self.purpose = kind, area, name, purpose
        self.requirements, self.build, self.recipe, self.seed = sorted(set(requirements.split())), build, recipe, seed
        self.parent, self.fault, self.code = parent, fault, code
        self.acceptable, self.inside, self.sweep = acceptable, inside, sweep

    @property
    def folder(self):
        return os.path.join(self.kind, self.area, self.name)

    def record(self, data, clause_of, parent=None, parent_record=None):
        """vector.json as an object."""
        row = {"schema": "splatstream-vector/1", "name": self.name, "area": self.area, "kind": self.kind,
               "purpose": self.purpose, "requirements": self.requirements,
               "clauses": sorted({clause_of[r] for r in self.requirements}, key=clause_key),
               "license": LICENSE, "bytes": len(data), "sha256": expectation.sha256(data),
               "generator": {"recipe": self.recipe, "seed": self.seed}}
        if self.inside:
            row["inside"] = self.inside(data)
        if self.kind == "invalid":
            self.add_fault(row, data, parent, parent_record)
        else:
            row.update(expectation.accepted(data, row.get("inside")))
        if self.acceptable:
            row["acceptable"] = [{"class": CLASS_OF[code], "code": code} for code in self.acceptable]
        return {key: row[key] for key in IN_ORDER if key in row}

    def add_fault(self, row, data, parent, parent_record):
        row.update(expectation.swept(data) if self.sweep else expectation.rejected(data, row.get("inside")))
        row.update(parent=self.parent, fault=self.fault,
                   **{key: parent_record[key] for key in ("features", "profile", "level")})
        if not self.sweep:
            row["patch"] = patches.difference(parent, data)
        found = row["expect"]["code"]
        row["purpose"] = "Rejected as %s: %s" % (" or ".join(self.acceptable) or found, self.fault)
        if self.code not in (None, found) or self.acceptable and found not in self.acceptable:
            raise ValueError("%s: %s, not %s" % (self.name, row["expect"], self.code or self.acceptable))


def seed_of(name):
    """A seed that does not change when other vectors come or go."""
    return crc32(name.encode()) & 0xFFFF


def clause_key(clause):
    return [(0, int(part), "") if part.isdigit() else (1, 0, part) for part in clause.split(".")]


def text_of(record):
    """JSON with one line for each field, and for each entry of a list of objects."""
    lines = []
    for key, value in record.items():
        if isinstance(value, list) and value and isinstance(value[0], dict):
            rows = ",\n".join("  " + compact(row) for row in value)
            lines.append(" %s: [\n%s\n ]" % (compact(key), rows))
        else:
            lines.append(" %s: %s" % (compact(key), compact(value)))
    return "{\n" + ",\n".join(lines) + "\n}\n"


def compact(value):
    return json.dumps(value, ensure_ascii=False, separators=(",", ":"))


def write(root, vector, data, text):
    folder = os.path.join(root, vector.folder)
    os.makedirs(folder, exist_ok=True)
    with open(os.path.join(folder, "in.gss"), "wb") as f:
        f.write(data)
    with open(os.path.join(folder, "vector.json"), "w", encoding="utf-8") as f:
        f.write(text)
