"""Truncation at every byte: of a whole stream, and of payloads behind which the stream goes on.

A stream that ends early is truncated (B.1). A payload that ends early, of which length and check sums are right, is malformed
in the element that does not fit.
"""

import oracle_path  # noqa: F401
import constants as c
from catalogue_order import increment
from catalogue_stream import one_frame
from faults import in_bytes, invalid, kind, payload

STREAM, PREDICTED = "stream-one-gaussian", "stability-one-gaussian"
REFINED, INCREMENT = kind(c.UT_REFINEMENT), increment(2)
REFINED_BYTES, FIXED_BYTES, INCREMENT_BYTES = 62, 58, 228


def of_stream():
    for size in range(len(one_frame(1))):
        yield ("bytes-truncated-at-%03d" % size, STREAM, "TRUNCATED", "SS-BS-007", "the stream has %d bytes" % size,
               in_bytes(lambda data, size=size: data[:size]))


def of_payload(name, parent, select, sizes):
    """The payload of one unit; index and end unit are those of the stream that comes of it."""
    for size in sizes:
        yield ("bytes-%s-truncated-at-%03d" % (name, size), parent, "SHORT_SECTION", "SS-ER-003",
               "the payload of one %s has %d bytes, as its header says" % (name, size),
               payload(select, lambda data, size=size: data[:size]))


def rows():
    refinements = of_payload("refinement", STREAM, REFINED, range(REFINED_BYTES))
    increments = of_payload("increment", PREDICTED, INCREMENT, range(FIXED_BYTES, INCREMENT_BYTES))
    for table in (of_stream(), refinements, increments):
        yield from invalid("bytes", "truncation", table)
