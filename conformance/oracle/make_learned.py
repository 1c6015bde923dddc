#!/usr/bin/env python3
"""Writes vectors of learned prediction: make_learned.py FOLDER

FOLDER/valid and FOLDER/invalid are in the form of conformance/vectors/dynamic; RECORDS.md explains the records."""

import os
import sys

import constants as c
from decoding import Decoder
from encoding import unit
from make_vectors import faulty_record, intra_records, intra_with_points, point_records, whole_record, write
from network import REGISTRY
from synth_learned import REGISTERED, VALID, learned_stream, predicted_by_network
from synth_learned_faults import LEARNED_FAULTS, faulty_learned
from synth_limit import empty_reference_set, over_limit
from synth_mutations import Unit, stream_of, units_of
from semantics import parse_unit_header

LARGEST = 30000
SEEDS = 20000                                       # seeds of a row start 100 apart


def dynamic_record(data):
    decoder, record = whole_record(data)
    assert record["outcome"] == "accept", record
    record["points"] = point_records(data, decoder.sequence)
    return record


def write_valid(folder):
    rows = VALID + (REGISTERED if REGISTRY else [])
    for place, (name, asked) in enumerate(rows):
        for seed in range(SEEDS + 100 * place, SEEDS + 100 * place + 100):
            data, synth = learned_stream(seed, asked)
            if len(data) < LARGEST and synth.asked["least"] <= predicted_by_network(synth) <= 200:
                break
        write(folder, "learned-" + name, data, dynamic_record(data))
    data = empty_reference_set(SEEDS)
    write(folder, "learned-limit-without-references", data, dynamic_record(data))
    data = intra_with_skipped(500)
    write(folder, "learned-intra-skipped", data, intra_records(data))


def intra_with_skipped(seed):
    """A stream of profile 0 with units of types 9 and 10 that are skipped, and not counted in operating_points."""
    data = b"x" * LARGEST
    while len(data) > 8192:
        head, units = units_of(intra_with_points(seed))
        seed += 1
        for kind in (c.UT_WEIGHTS, c.UT_INCREMENT):
            skipped = unit(kind, b"skipped", flags=0)
            place = next(i for i, u in enumerate(units) if u.kind == c.UT_FRAME)
            units.insert(place, Unit(parse_unit_header(skipped, 0, 0), b"skipped"))
        data = stream_of(head, units)
    return data


def write_invalid(folder):
    for place, row in enumerate(LEARNED_FAULTS):
        data, seed = None, SEEDS + 10000 + 100 * place
        while data is None or len(data) > 10000 or not Decoder(data).decode().errors:
            data = faulty_learned(row, seed)
            seed += 1
        write(folder, "learned-" + row[0], data, faulty_record(data, row[0], row[1]))
    data = over_limit(SEEDS)
    write(folder, "learned-over-limit", data, faulty_record(data, "over-limit", "OVER_LIMIT"))


def main():
    for name, maker in (("valid", write_valid), ("invalid", write_invalid)):
        path = os.path.join(sys.argv[1], name)
        os.makedirs(path, exist_ok=True)
        maker(path)


if __name__ == "__main__":
    main()
