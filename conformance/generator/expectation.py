"""What the oracle finds in a stream, in the form of vector.json: outcome, states, points, units, features."""

import hashlib
import json
import struct

import oracle_path  # noqa: F401
import constants as c
from decoding import Decoder
from dynamic import DynamicFrame
from entropy_state import entropy_state
from extraction import extract
from homes import canonical_planes
from output import float_planes
from points import EVERYTHING
from reconstruction import i32le
from semantics import parse_unit_header

PLANE_GROUPS = (("position", 0, 3), ("log_scale", 3, 6), ("opacity", 6, 7), ("rotation", 7, 10), ("dc", 10, 13),
                ("sh", 13, None))
MOST_POINTS = 24                                    # of more operating points a selection is recorded

UNIT_NAMES = {c.UT_SEQUENCE: "sequence_parameters", c.UT_GOP: "gop_header", c.UT_FRAME: "frame_header",
              c.UT_TRANSFORM: "transform", c.UT_CODEBOOK: "codebook", c.UT_REFINEMENT: "refinement",
              c.UT_INDEX: "index", c.UT_END: "end", c.UT_WEIGHTS: "weights", c.UT_INCREMENT: "increment",
              c.UT_POINTS: "operating_points"}


def sha256(data):
    return hashlib.sha256(data).hexdigest()


def name_of_point(point):
    return "s%d,t%d,r%d" % point


# ---- states ----


def shown_planes(frame, subset):
    """(type, exact, carried, planes) of a frame as it is shown."""
    if not isinstance(frame, DynamicFrame):
        return "I", frame.gaussians, 0, frame.planes
    shown = frame.shown(subset)
    return "IPB"[frame.frame_type], shown.exact, shown.carried, canonical_planes(shown.gaussians, frame.plane_count)


def state_of(frame, sequence, subset):
    kind, exact, carried, planes = shown_planes(frame, subset)
    groups = {name: sha256(b"".join(map(i32le, planes[low:high]))) for name, low, high in PLANE_GROUPS
              if name != "sh" or len(planes) > 13}
    floats = b"".join(struct.pack("<%df" % len(plane), *plane) for plane in float_planes(sequence, planes).values())
    return {"frame": frame.number, "type": kind, "gaussians": exact + carried, "exact": exact, "carried": carried,
            "planes": groups, "f32": sha256(floats)}


class States:
    """States without repetition; add() gives the place of one."""

    def __init__(self):
        self.rows, self.places = [], {}

    def add(self, state):
        text = json.dumps(state)
        if text not in self.places:
            self.places[text] = len(self.rows)
            self.rows.append(state)
        return self.places[text]

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
    if len(every) > MOST_POINTS:
        top = tuple(n - 1 for n in counts)
        ends = [{0, n} for n in top]
        every = [p for p in every if all(x in end for x, end in zip(p, ends))
                 or sum(a != b for a, b in zip(p, top)) == 1]
    return sorted(every, reverse=True)


def point_rows(data, point, states, verdict, with_extraction):
    """The rows of one operating point: mode full, and mode subset if it shows something else."""
    decoder = Decoder(data, point).decode()
    row = {"op": name_of_point(point), "mode": "full", "states": states.of(decoder, False)}
    if outcome(decoder) != verdict:
        row["expect"] = outcome(decoder)
    if with_extraction:
        row["extraction"] = sha256(extract(data, point))
    dynamic = any(isinstance(frame, DynamicFrame) for frame in decoder.frames)
    subset = states.of(decoder, True) if dynamic else row["states"]
    found = outcome(decoder, True)
    if subset == row["states"] and found == outcome(decoder):
        return [row]
    other = {"op": row["op"], "mode": "subset", "states": subset}
    if found != verdict:
        other["expect"] = found
    return [row, other]


def unit_rows(data, decoder):
    """Place and type of each unit, and how its sections were decoded."""
    rows, pos, profile = [], c.FILE_HEADER_BYTES, decoder.file_header.profile
    while pos < len(data):
        unit = parse_unit_header(data, pos, 0, profile)
        row = {"at": pos, "bytes": unit.end - pos,
               "type": UNIT_NAMES[unit.unit_type] if unit.known else "skipped"}
        if unit.known and unit.unit_type in (c.UT_FRAME, c.UT_REFINEMENT, c.UT_INCREMENT):
            row["frame"] = unit.frame
        if unit.known and unit.unit_type in (c.UT_REFINEMENT, c.UT_INCREMENT):
            row.update(spatial_layer=unit.spatial_layer, refinement=unit.refinement)
        if decoder.coded.get(pos):
            row["entropy"] = "%016x" % entropy_state(decoder.coded[pos])
        rows.append(row)
        pos = unit.end
    return rows


# ---- features ----


def features(decoder):
    """The tools that a stream uses, in the order of the schema."""
    sequence = decoder.sequence
    frames = [frame for frame in decoder.frames if isinstance(frame, DynamicFrame)]
    increments = [u for frame in frames for u in frame.increments.values()]
    headers = [coded for sections in decoder.coded.values() for coded in sections]
    present = {
        "predicted": any(not frame.intra for frame in frames),
        "b-frames": any(frame.frame_type == c.TYPE_B for frame in frames),
        "spatial-layers": sequence is not None and sequence.spatial_layer_count > 1,
        "prefixes": sequence is not None and sequence.refinement_count > 1,
        "sh": sequence is not None and sequence.sh_degree > 0,
        "vq": any(plane.alphabet == "index" for planes, _, _ in headers for plane in planes),
        "cells": any(u.cell_count for u in increments),
        "carried": any(shown_planes(frame, False)[2] for frame in frames),
        "learned": bool(decoder.networks),
        "full-attention": any(network.full_attention for network in decoder.networks),
        "several-gops": len(decoder.gops) > 1,
    }
    return [name for name, holds in present.items() if holds]


def accepted(data):
    """Fields of the record of a stream that is accepted: outcome, features, states, points, units."""
    decoder = Decoder(data).decode()
    if decoder.errors:
        raise ValueError("not accepted: %s" % decoder.errors[0])
    states, rows = States(), []
    for point in operating_points(decoder.sequence):
        rows += point_rows(data, point, states, outcome(decoder), True)
    found = features(decoder)
    if any(row["mode"] == "subset" for row in rows):
        found.append("subset")
    return {"features": found, "profile": decoder.file_header.profile, "level": decoder.file_header.level,
            "expect": outcome(decoder), "states": states.rows, "points": rows, "units": unit_rows(data, decoder)}


def rejected(data):
    """Fields of the record of a stream with an error; states only if the error lets frames come out."""
    decoder = Decoder(data).decode()
    if not decoder.errors:
        raise ValueError("accepted")
    record = {"expect": outcome(decoder)}
    if decoder.frames:
        states, sequence = States(), decoder.sequence
        top = (sequence.top, sequence.temporal_layer_count - 1, sequence.refinement_count - 1)
        lower = [tuple(0 if axis == k else n for k, n in enumerate(top)) for axis in range(3)]
        rows = []
        for point in dict.fromkeys([EVERYTHING, (0, 0, 0)] + [point for point in lower if point != top]):
            rows += point_rows(data, point, states, record["expect"], False)
        record.update(states=states.rows, points=rows)
    return record
