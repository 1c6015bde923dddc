"""What the oracle finds in a stream, in the form of vector.json: outcome, states, points, units, features."""

import hashlib
import json
import struct

from oracle import constants as c
from oracle.decoding import Decoder
from oracle.entropy_state import entropy_state
from oracle.extraction import extract
from oracle.lists import canonical_planes
from oracle.output import float_planes
from oracle.points import EVERYTHING
from oracle.reconstruction import i32le
from oracle.semantics import parse_unit_header

PLANE_GROUPS = (("position", 0, 3), ("log_scale", 3, 6), ("opacity", 6, 7), ("rotation", 7, 10), ("dc", 10, 13),
                ("sh", 13, None))
MAX_POINTS = 24                                    # of more operating points a selection is recorded

UNIT_NAMES = {c.UT_SEQUENCE: "sequence_parameters", c.UT_GOP: "gop_header", c.UT_FRAME: "frame_header",
              c.UT_TRANSFORM: "transform", c.UT_CODEBOOK: "codebook", c.UT_INCREMENT: "increment",
              c.UT_INDEX: "index", c.UT_END: "end", c.UT_WEIGHTS: "weights", c.UT_SCENE: "scene_description",
              c.UT_POINTS: "operating_points"}


def sha256(data):
    return hashlib.sha256(data).hexdigest()


def name_of_point(point):
    return "s%d,t%d,r%d" % point


# ---- states ----


def state_of(frame, sequence, subset):
    shown = frame.shown(subset)
    planes = canonical_planes(shown.gaussians, 13 + sequence.sh_planes)
    groups = {name: sha256(b"".join(map(i32le, planes[low:high]))) for name, low, high in PLANE_GROUPS
              if name != "sh" or len(planes) > 13}
    floats = b"".join(struct.pack("<%df" % len(plane), *plane) for plane in float_planes(sequence, planes).values())
    return {"frame": frame.number, "type": "IPB"[frame.frame_type], "gaussians": shown.exact + shown.carried,
            "exact": shown.exact, "carried": shown.carried, "planes": groups, "f32": sha256(floats)}


class States:
    """States without repetition; add() gives the index of one."""

    def __init__(self):
        self.rows, self.index = [], {}

    def add(self, state):
        text = json.dumps(state)
        if text not in self.index:
            self.index[text] = len(self.rows)
            self.rows.append(state)
        return self.index[text]

    def of(self, decoder, subset):
        return [self.add(state_of(frame, decoder.sequence, subset)) for frame in decoder.frames]


# ---- outcomes and points ----


def outcome(decoder, subset=False):
    errors = decoder.found(subset)
    if not errors:
        return {"outcome": "accept"}
    return {"outcome": "reject", **errors[0].as_dict()}


def operating_points(sequence):
    """All points of a sequence, the highest first; of many the corners of the three axes and what lies on the axes."""
    counts = (sequence.spatial_layer_count, sequence.temporal_layer_count, sequence.refinement_count)
    every = [(s, t, r) for s in range(counts[0]) for t in range(counts[1]) for r in range(counts[2])]
    if len(every) > MAX_POINTS:
        top = tuple(n - 1 for n in counts)
        ends = [{0, n} for n in top]
        every = [p for p in every if all(x in end for x, end in zip(p, ends))
                 or sum(a != b for a, b in zip(p, top)) == 1]
    return sorted(every, reverse=True)


def point_rows(decoder, point, states, verdict, extraction=None):
    """The rows of one operating point: mode full, and mode subset if it shows something else and decoding starts at the start."""
    rows = []
    for mode in ("full", "subset") if decoder.inside is None else ("full",):
        row = {"op": name_of_point(point), "mode": mode, "states": states.of(decoder, mode == "subset")}
        if decoder.lost:
            row["lost"] = [list(part) for part in decoder.lost]
        if outcome(decoder, mode == "subset") != verdict:
            row["expect"] = outcome(decoder, mode == "subset")
        if extraction and mode == "full":
            row["extraction"] = extraction
        if mode == "full" or any(row.get(key) != rows[0].get(key) for key in ("states", "expect")):
            rows.append(row)
    return rows


def unit_rows(data, decoder):
    """Place and type of each unit, and how its sections were decoded."""
    rows, pos = [], c.FILE_HEADER_BYTES
    while pos < len(data):
        unit = parse_unit_header(data, pos)
        row = {"at": pos, "bytes": unit.end - pos,
               "type": UNIT_NAMES[unit.unit_type] if unit.known else "skipped"}
        if unit.known and unit.unit_type in (c.UT_FRAME, c.UT_INCREMENT):
            row["frame"] = unit.frame
        if unit.known and unit.unit_type == c.UT_INCREMENT:
            row.update(spatial_layer=unit.spatial_layer, refinement=unit.refinement)
        if decoder.coded.get(pos):
            row["entropy"] = "%016x" % entropy_state(decoder.coded[pos])
        rows.append(row)
        pos = unit.end
    return rows


# ---- features ----


def features(decoder, states, rows):
    """The tools that a stream uses, in the order of the schema."""
    sequence = decoder.sequence
    sections = [coded for sections in decoder.coded.values() for coded in sections]
    present = {
        "predicted": any(not frame.intra for frame in decoder.frames),
        "b-frames": any(frame.frame_type == c.TYPE_B for frame in decoder.frames),
        "spatial-layers": sequence is not None and sequence.spatial_layer_count > 1,
        "prefixes": sequence is not None and sequence.refinement_count > 1,
        "sh": sequence is not None and sequence.sh_degree > 0,
        "vq": any(plane.alphabet == "index" for planes, _, _ in sections for plane in planes),
        "cells": any(planes[0].attribute == "cell" for planes, _, _ in sections),
        "carried": any(state["carried"] for state in states.rows),
        "learned": bool(decoder.networks),
        "full-attention": any(network.full_attention for network in decoder.networks),
        "several-gops": len(decoder.gops) > 1,
        "subset": any(row["mode"] == "subset" for row in rows),
    }
    return [name for name, holds in present.items() if holds]


def accepted(data, inside=None):
    """Fields of the record of a stream that is accepted: outcome, features, states, points, units."""
    decoder = Decoder(data, None, inside).decode()
    if decoder.errors:
        raise ValueError("not accepted: %s" % decoder.errors[0])
    states, rows = States(), []
    for point in operating_points(decoder.sequence):
        extraction = sha256(extract(data, point)) if inside is None else None
        rows += point_rows(Decoder(data, point, inside).decode(), point, states, outcome(decoder), extraction)
    return {"features": features(decoder, states, rows), "profile": decoder.file_header.profile,
            "level": decoder.file_header.level, "expect": outcome(decoder), "states": states.rows, "points": rows,
            "units": unit_rows(data, decoder if inside is None else Decoder(data).decode())}


def rejected(data, inside=None):
    """Fields of the record of a stream with an error; states only if frames come out."""
    decoder = Decoder(data, None, inside).decode()
    if not decoder.errors:
        raise ValueError("accepted")
    record = {"expect": outcome(decoder)}
    if decoder.sequence is not None and (decoder.frames or decoder.lost):
        states, sequence = States(), decoder.sequence
        top = (sequence.top, sequence.temporal_layer_count - 1, sequence.refinement_count - 1)
        lower = [tuple(0 if axis == k else n for k, n in enumerate(top)) for axis in range(3)]
        rows = []
        for point in dict.fromkeys([EVERYTHING, (0, 0, 0)] + [point for point in lower if point != top]):
            rows += point_rows(Decoder(data, point, inside).decode(), point, states, outcome(decoder))
        record.update(states=states.rows, points=rows)
    return record


def swept(data):
    """Fields of the record of a stream that is cut at every byte: what comes out of prefixes of so many bytes or more.

    Every cut inside a unit has the same result, so that one is tried at each end of a unit, one byte after and before it.
    """
    ends, states, steps = [0, c.FILE_HEADER_BYTES], States(), []
    while ends[-1] < len(data):
        ends.append(parse_unit_header(data, ends[-1]).end)
    for size in sorted({size for end in ends for size in (end - 1, end, end + 1) if 0 <= size < len(data)}):
        decoder = Decoder(data[:size]).decode()
        found = outcome(decoder)
        if found.get("code") != "TRUNCATED":
            raise ValueError("%d bytes: %s" % (size, found))
        shown = states.of(decoder, False)
        if not steps or steps[-1]["states"] != shown:
            steps.append({"bytes": size, "states": shown})
    expect = {key: found[key] for key in ("outcome", "class", "code")}
    return {"expect": expect, "states": states.rows, "sweep": {"cut": "every byte", "steps": steps}}
