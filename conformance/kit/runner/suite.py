"""The vectors of a suite, and the cases that follow from them: a vector at an operating point in a mode."""

import hashlib
import json
import os
import zlib

VECTOR_SCHEMA = "splatstream-vector/1"
EVERYTHING = "s3,t3,r9"                             # the highest operating point: every unit belongs to it
FILE_HEADER_BYTES, UNIT_HEADER_BYTES, SEQUENCE_PARAMETERS = 16, 20, 1


class SuiteError(Exception):
    """A suite that cannot be read, in words."""


def sha256(data):
    return hashlib.sha256(data).hexdigest()


def point(op):
    """The three numbers of an operating point as 7.2 writes it."""
    return tuple(int(part[1:]) for part in op.split(","))


class Vector:
    """A record, and where its stream is."""

    def __init__(self, folder):
        self.folder = folder
        with open(os.path.join(folder, "vector.json"), "rb") as f:
            text = f.read()
        self.record, self.sha256 = json.loads(text), sha256(text)
        if self.record["schema"] != VECTOR_SCHEMA:
            raise SuiteError("%s: the schema is %s, this runner knows %s" % (folder, self.record["schema"], VECTOR_SCHEMA))
        if sha256(self.stream()) != self.record["sha256"]:
            raise SuiteError("%s: in.gss is not the stream of its record; get the suite again" % folder)

    def stream(self):
        with open(os.path.join(self.folder, "in.gss"), "rb") as f:
            return f.read()

    def cases(self):
        rows = self.record.get("points") or [None]
        return [Case(self, row) for row in rows]


class Case:
    """One request to a decoder, and the right answers."""

    def __init__(self, vector, row, cut=None):
        self.vector, self.record, self.row, self.cut = vector, vector.record, row, cut
        self.op = row["op"] if row else EVERYTHING
        self.mode = "inside" if "inside" in self.record else row["mode"] if row else "full"
        self.name = "%s@%s/%s" % (self.record["name"], self.op, self.mode)

    def prefixes(self):
        """The cases of all proper prefixes of a stream with `sweep`; none for another vector."""
        if "sweep" not in self.record:
            return []
        return [Case(self.vector, self.row, cut) for cut in range(self.record["bytes"])]

    def input(self):
        data = self.vector.stream()[:self.cut]
        return started_inside(data, self.record["inside"]) if "inside" in self.record else data

    def verdicts(self):
        """The right answers, that of the reference first."""
        if self.row and "expect" in self.row:
            return [self.row["expect"]]
        first = self.record["expect"]
        others = [{"outcome": "reject", **fault} for fault in self.record.get("acceptable", [])]
        is_other = lambda fault: (fault["class"], fault.get("code")) != (first.get("class"), first.get("code"))
        return [first] + [fault for fault in others if is_other(fault)]

    def states(self):
        """The frames that are shown, in display order; None if any are right."""
        states = self.record.get("states", [])
        if "sweep" in self.record:
            steps = [step for step in self.record["sweep"]["steps"] if step["bytes"] <= self.cut]
            return [states[index] for index in steps[-1]["states"]] if steps else []
        if self.row and "states" in self.row:
            return [states[index] for index in self.row["states"]]
        return states or None

    def is_extreme(self, highest):
        """Whether no operating point of the vector is above this one, or below it."""
        beyond = (lambda own, other: own < other) if highest else (lambda own, other: own > other)
        own = point(self.op)
        others = [point(row["op"]) for row in self.record.get("points", [])]
        return not any(beyond(a, b) for other in others for a, b in zip(own, other))


def started_inside(data, gop):
    """What a decoder gets that starts at the gop_header at `gop` (B.3): the file_header, the first intact
    sequence_parameters unit, and the units from there on."""
    at, sequence = FILE_HEADER_BYTES, b""
    while at + UNIT_HEADER_BYTES <= len(data) and not sequence:
        header = data[at:at + UNIT_HEADER_BYTES]
        end = at + UNIT_HEADER_BYTES + int.from_bytes(header[12:16], "little")
        payload = data[at + UNIT_HEADER_BYTES:end]
        # SS-UH-001, SS-UH-009
        is_intact = (zlib.crc32(header[:6] + header[8:]) & 0xFFFF == int.from_bytes(header[6:8], "little")
                     and zlib.crc32(payload) == int.from_bytes(header[16:20], "little"))
        if header[0] == SEQUENCE_PARAMETERS and is_intact:
            sequence = data[at:end]
        at = end
    return data[:FILE_HEADER_BYTES] + sequence + data[gop:]


class Suite:
    """All vectors below a folder, and what VERSION and MANIFEST beside it say of them."""

    def __init__(self, folder):
        areas = [os.path.join(folder, kind, area) for kind in ("valid", "invalid", "either")
                 if os.path.isdir(os.path.join(folder, kind)) for area in sorted(os.listdir(os.path.join(folder, kind)))]
        folders = [os.path.join(area, name) for area in areas for name in sorted(os.listdir(area))]
        self.vectors = [Vector(path) for path in folders if os.path.exists(os.path.join(path, "vector.json"))]
        if not self.vectors:
            raise SuiteError("%s: no vectors here: there should be folders valid/AREA/NAME with a vector.json" % folder)
        lines = sorted((vector.record["name"], vector.sha256) for vector in self.vectors)
        self.sha256 = sha256("".join("%s %s\n" % (digest, name) for name, digest in lines).encode())
        beside = os.path.dirname(os.path.abspath(folder))
        self.version, self.specification = (self.text(beside, "VERSION") + ["", ""])[:2]
        count, digest = (self.text(beside, "MANIFEST") + ["", ""])[:2]
        self.changed = None
        if not digest:
            self.changed = "it has no MANIFEST next to the vectors"
        elif digest != self.sha256:
            self.changed = "it has %d vectors that are not the %s of MANIFEST" % (len(self.vectors), count)

    @staticmethod
    def text(folder, name):
        try:
            with open(os.path.join(folder, name), encoding="utf-8") as f:
                return f.read().split()
        except FileNotFoundError:
            return []

    def cases(self):
        return [case for vector in self.vectors for case in vector.cases()]
