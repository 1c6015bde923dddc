#!/usr/bin/env python3
"""Writes vectors of profile 1: make_vectors.py FOLDER [VALID INVALID]

The fields of the records are explained in RECORDS.md."""

import hashlib
import json
import os
import random
import struct
import sys

import constants as c
import points
from decode import report
from decoding import Decoder
from extraction import extract
from homes import canonical_planes
from output import float_planes
from synth import Synth
from synth_dynamic import valid_stream
from synth_faults import FAULTS, faulty_stream
from synth_mutations import MUTATIONS, mutated, stream_of, units_of

SUBSET_FIELDS = ("frame", "gaussians", "shown")


def sha256(data):
    return hashlib.sha256(data).hexdigest()


def float_hash(decoder, frame, subset=False):
    """SHA-256 of the f32 planes of a shown frame in the order of output.float_planes."""
    planes = canonical_planes(frame.shown(subset).gaussians, frame.plane_count)
    values = float_planes(decoder.sequence, planes)
    return sha256(b"".join(struct.pack("<%df" % len(plane), *plane) for plane in values.values()))


def subset_records(decoder):
    return [{key: record[key] for key in SUBSET_FIELDS} for record in report(decoder, True)["frames"]]


def whole_record(data):
    """What a decoder finds at the operating point s3,t3,r9."""
    decoder = Decoder(data).decode()
    record = report(decoder)
    for frame, entry in zip(decoder.frames, record["frames"]):
        entry["f32"] = float_hash(decoder, frame)
    record["subset"] = subset_records(decoder)
    return decoder, record


def point_records(data, sequence):
    """For each operating point below the highest one of the sequence; a repeated result names the first one."""
    result, seen = {}, {}
    for s in range(sequence.spatial_layer_count):
        for t in range(sequence.temporal_layer_count):
            for r in range(sequence.refinement_count):
                decoder = Decoder(data, (s, t, r)).decode()
                record = report(decoder)
                record["subset"] = subset_records(decoder)
                record["extraction"] = sha256(extract(data, (s, t, r)))
                name, text = "s%d,t%d,r%d" % (s, t, r), json.dumps(record)
                result[name] = seen.get(text, record)
                seen.setdefault(text, name)
    return result


def write(folder, name, data, record):
    with open(os.path.join(folder, name + ".gss"), "wb") as f:
        f.write(data)
    with open(os.path.join(folder, name + ".expect.json"), "w") as f:
        json.dump(record, f, separators=(",", ":"))
        f.write("\n")


def intra_with_points(seed):
    """A stream of profile 0 with an operating_points unit (6.16) before its index or end unit."""
    head, units = units_of(Synth(seed).stream())
    decoder = Decoder(stream_of(head, units)).decode()
    entries = b""
    for r in range(decoder.sequence.refinement_count):
        point = (0, 0, r)
        gaussians = sum(points.intra_gaussians(frame, decoder.sequence, point) for frame in decoder.frames)
        entries += struct.pack("<4BIQQ", *point, 0, decoder.ledger.frame_count(point, decoder.sequence), gaussians,
                               decoder.ledger.byte_count(point, decoder.sequence))
    new = units[0].copy()
    new.kind, new.flags, new.frame = c.UT_POINTS, 0, 0
    new.payload = struct.pack("<HH", decoder.sequence.refinement_count, 0) + entries
    place = next(i for i, u in enumerate(units) if u.kind in (c.UT_INDEX, c.UT_END))
    return stream_of(head, units[:place] + [new] + units[place:])


def intra_records(data):
    """The record of a stream of profile 0, with what its operating points give."""
    decoder = Decoder(data).decode()
    record = report(decoder)
    record["points"] = {}
    for r in range(decoder.sequence.refinement_count):
        entry = report(Decoder(data, (0, 0, r)).decode())
        entry["extraction"] = sha256(extract(data, (0, 0, r)))
        record["points"]["s0,t0,r%d" % r] = entry
    return record


def write_intra(folder, count):
    seed, written = 500, 0
    while written < count:
        data = intra_with_points(seed)
        if len(data) < 8192:
            write(folder, "intra-points-%03d" % seed, data, intra_records(data))
            written += 1
        seed += 1


def write_valid(folder, count):
    seed, written = 0, 0
    while written < count:
        if written % 8 == 7:                        # sections of several blocks
            data, limit = valid_stream(seed, most=220), 20000
        elif written % 2 == 1:
            data, limit = valid_stream(seed, most=12, deep=True), 10000
        else:
            data, limit = valid_stream(seed), 8192
        if len(data) < limit:
            decoder, record = whole_record(data)
            sequence = decoder.sequence
            if sequence.spatial_layer_count * sequence.temporal_layer_count * sequence.refinement_count <= 48:
                record["points"] = point_records(data, sequence)
                write(folder, "dyn-%03d" % seed, data, record)
                written += 1
        seed += 1


def faulty_record(data, fault, code):
    """The record of a stream with a fault, whose first error has the given code, any if it is None."""
    decoder, record = whole_record(data)
    if code is not None and record.get("code") != code:
        raise ValueError("%s gives %s" % (fault, record.get("code")))
    record["fault"] = fault
    if len(decoder.frames) > 0 and decoder.sequence.refinement_count > 1:
        sequence = decoder.sequence
        low = (sequence.top, sequence.temporal_layer_count - 1, 0)
        record["points"] = {"s%d,t%d,r%d" % low: report(Decoder(data, low).decode())}
    return record


def write_invalid(folder, count):
    """All faults and mutations in turn, until there are enough; without a number, each of them once."""
    rows = [("fault", fault) for fault in FAULTS] + [("mutation", mutation) for mutation in MUTATIONS]
    random.Random(2).shuffle(rows)
    written, seed = 0, 10000
    count = count or len(rows)
    while written < count:
        kind, row = rows[written % len(rows)]
        data, name = None, "%s-%03d" % (row[0], written)
        while data is None or len(data) > 12000:
            seed += 1
            if kind == "fault":
                data, seed = faulty_stream(row, seed)
            else:
                losses = row[0].startswith(("increment-", "several-", "reference-"))
                stream = valid_stream(seed, most=12, deep=True) if losses else valid_stream(seed)
                data = mutated(row, stream, seed)
            if data is not None and not Decoder(data).decode().errors:
                data = None                         # noise where it does not matter
        write(folder, name, data, faulty_record(data, row[0], row[1]))
        written += 1


def main():
    folder = sys.argv[1]
    counts = [int(x) for x in sys.argv[2:4]] or [60, 0]
    for name, maker, count in (("valid", write_valid, counts[0]), ("invalid", write_invalid, counts[1])):
        path = os.path.join(folder, name)
        os.makedirs(path, exist_ok=True)
        maker(path, count)
    write_intra(os.path.join(folder, "valid"), 4)


if __name__ == "__main__":
    main()
