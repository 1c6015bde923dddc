"""Coverage of the syntax: python3 -m generator.syntax_coverage, in the folder conformance

Decodes all vectors that are accepted and writes conformance/coverage/syntax.csv: for each element of the tables of
clause 5 whether its smallest, its largest and a middle value occur, for elements of few values each of them,
and each condition of
the tables both ways. Gaps need a row in syntax_waivers.csv.
"""

import csv
import glob
import os
import sys

from oracle import decoding, increment, models, network, parsing, semantics, syntax
from oracle.conventions import BitReader, bl
from .syntax_ranges import CONDITIONS, RANGES
from .text import CONFORMANCE, HERE

FEW = 10                                            # each value is asked for of integers that have at most so many
PARTS = (("INCREMENT_", "increment"), ("FRAME_", "frame_header"), ("SCENE_", "scene_description"))


def record_of(table):
    """The record of a table of the oracle; parts that may be absent have tables of their own."""
    for prefix, record in PARTS:
        if table.startswith(prefix):
            return record
    return table.lower().replace("_fixed", "")


TABLES = {id(table): record_of(name) for name, table in vars(syntax).items() if isinstance(table, list)}


class Seen:
    """Values of one element."""

    def __init__(self, low, high, holes, free=False):
        self.low, self.high, self.holes, self.free = low, high, holes, free
        self.values, self.least, self.most, self.middle = set(), None, None, False

    def add(self, value):
        self.least = value if self.least is None else min(self.least, value)
        self.most = value if self.most is None else max(self.most, value)
        self.middle = self.middle or self.low < value < self.high
        if self.high - self.low < FEW or value in (self.low, self.high) or value in self.holes:
            self.values.add(value)

    def gaps(self):
        few = isinstance(self.low, int) and self.high - self.low < FEW
        wanted = range(self.low, self.high + 1) if few else [self.low, self.high]
        wanted = [] if self.free else wanted
        missing = [value for value in [*wanted, *self.holes] if value not in self.values]
        return missing + ["middle"] * (self.high - self.low > 1 and not self.middle)


class Coverage:
    def __init__(self):
        self.elements = {key: Seen(*row) for key, row in RANGES.items()}
        self.conditions = {name: set() for name in CONDITIONS}

    def add(self, record, element, values):
        for value in values if isinstance(values, (list, tuple)) else [values]:
            self.elements[record + "." + element].add(value)

    def condition(self, name, holds):
        self.conditions[name].add(bool(holds))


SEEN = Coverage()

# ---- the places in which the oracle reads elements ----


def wrapped(owner, name, after):
    """Calls after(result, arguments) after each call of a function or method of the oracle."""
    original = getattr(owner, name)

    def function(*args, **kw):
        result = original(*args, **kw)
        after(result, args)
        return result

    setattr(owner, name, function)


def on_record(_, args):
    record, table = args[0], args[1]
    for element, _, _, _ in table:
        SEEN.add(TABLES[id(table)], element, getattr(record, element))


def on_transform(transform, _):
    SEEN.add("transform", "mean", transform.mean)
    SEEN.add("transform", "basis", transform.basis)
    SEEN.condition("transform: transform_kind == 1", transform.transform_kind == 1)


def on_codebook(book, _):
    SEEN.add("codebook", "entries as i8" if book.value_bytes == 1 else "entries as i16", book.values)


def on_increment(_, args):
    u = args[0]
    SEEN.add("increment", "codebook_ids", u.codebook_ids)
    present = {section.name for section in u.sections}
    for name in semantics.SECTIONS:
        SEEN.condition("increment: section %s is present" % name, name in present)
    for bit, part in enumerate(syntax.INCREMENT_PARTS):
        SEEN.condition("increment: %s is present" % part[0][0], u.increment_flags >> bit & 1)
    SEEN.condition("increment: sh_mode == 2", u.sh_mode == 2)
    SEEN.condition("increment: extrapolates_opacity == 1", u.extrapolates_opacity)


def on_frame_header(frame, _):
    SEEN.condition("frame_header: carried_digest is present", frame.frame_flags & 1)
    SEEN.condition("frame_header: cell_count is present", frame.frame_flags & 2)


def on_scene(scene, _):
    for bit, part in enumerate(("metres_per_unit", "background", "bounds_min", "title_length", "camera_count")):
        SEEN.condition("scene_description: %s is present" % part, scene.description_flags >> bit & 1)


def on_division(_, args):
    division = args[0]
    SEEN.add("section", "lanes_log2", division.lanes.bit_length() - 1)
    SEEN.add("section", "model_length", division.models_section.end - division.models_section.start)
    SEEN.add("section", "block_length", [section.end - section.start for section in division.block_sections])


def on_network(net, _):
    SEEN.condition("weights: model_source == 1", False)
    for name, kind, rows, columns in network.arrays(net):
        if "network: array %s is present" % name in SEEN.conditions:
            SEEN.condition("network: array %s is present" % name, rows * columns > 0)
        SEEN.add("network", "parameters as " + kind, [value for row in getattr(net, name) for value in row])


def on_block(_, args):
    block = args[0]
    SEEN.add("block", "word_count", block.word_count)
    SEEN.add("block", "state", block.x)
    SEEN.add("block", "word", block.words)
    SEEN.condition("block: raw_bits is empty", block.raw.bit == block.raw.end_bit)


def on_models(_, args):
    section, planes = args[0], args[1]
    walk_models(BitReader(section.data, section.start, section.end, "5.12"), planes)


# ---- the table of 5.12 ----


def walk_models(bits, planes):
    for plane in planes:
        reuse = read(bits, "reuse", 1)
        SEEN.condition("plane_model: reuse == 0", reuse == 0)
        if reuse == 0:
            walk_model(bits, plane)


def read(bits, element, width):
    value = bits.u(width) if isinstance(width, int) else getattr(bits, width)()
    SEEN.add("plane_model", element, value)
    return value


def walk_model(bits, plane):
    SEEN.condition("plane_model: the alphabet is signed", plane.alphabet == "signed")
    if plane.alphabet == "signed":
        read(bits, "bias", "se")
    name = "direct_log2_minus2 of position" if plane.alphabet == "position" else "direct_log2_minus2"
    direct_log2 = read(bits, name, 3) + 2
    contexts = 1
    for letter in "ab":
        source = read(bits, "source_" + letter, 4)
        SEEN.condition("plane_model: source_%s != 0" % letter, source != 0)
        if source == 0:
            break
        count = read(bits, "threshold_%s_count_minus1" % letter, 4)
        read(bits, "threshold_%s_first" % letter, "se")
        SEEN.condition("plane_model: threshold_%s_count_minus1 == 0" % letter, count == 0)
        for _ in range(count):
            read(bits, "threshold_%s_step_minus1" % letter, "ue")
        contexts *= count + 2
    for _ in range(contexts):
        walk_table(bits, plane.alphabet == "signed", bl(plane.largest_token(direct_log2)))


def walk_table(bits, signed, token_bits):
    kind = read(bits, "table_kind", 2)
    if kind == 1:
        reference = read(bits, "is_reference", 1)
        SEEN.condition("plane_model: is_reference == 1", reference == 1)
        read(bits, "table_index" if reference else "token", 6 if reference else token_bits)
    if kind == 3:
        is_parametric, last = read(bits, "is_parametric", 1), read(bits, "last", token_bits)
        SEEN.condition("plane_model: is_parametric == 1", is_parametric == 1)
        if is_parametric:
            for element, width in (("shape", 2), ("zero_level", 4), ("scale", 6)):
                read(bits, element, width)
            if signed:
                read(bits, "centre", "se")
            return
        mode, length = read(bits, "mode", bl(last)), 0
        SEEN.condition("plane_model: mode == last", mode == last)
        for t in range(last + 1):
            if t != mode:
                length += read(bits, "length_delta", "se")
                read(bits, "mantissa", min(max(length - 1, 0), 3))


def hook():
    wrapped(syntax.Record, "read", on_record)
    wrapped(semantics, "parse_transform", on_transform)
    wrapped(semantics, "parse_codebook", on_codebook)
    wrapped(semantics, "parse_frame_header", on_frame_header)
    wrapped(increment, "divide_increment", on_increment)
    wrapped(decoding, "parse_scene_description", on_scene)
    wrapped(semantics.Division, "__init__", on_division)
    wrapped(network, "parse_network", on_network)
    wrapped(parsing.BlockDecoder, "__init__", on_block)
    wrapped(models, "parse_models", on_models)
    wrapped(decoding, "parse_weights", lambda net, args: SEEN.condition(
        "weights: model_source == 1", args[0].data[args[0].start] == 1))


def waivers():
    with open(os.path.join(HERE, "syntax_waivers.csv"), encoding="utf-8", newline="") as f:
        return {(row["element"], row["value"]): row["reason"] for row in csv.DictReader(f)}


def report(path):
    """Writes the table; gives (elements, conditions, covered, problems)."""
    reasons, problems, covered, rows = waivers(), [], 0, []
    for name, seen in sorted(SEEN.elements.items()):
        gaps = [str(gap) for gap in seen.gaps()]
        notes = ["%s: %s" % (gap, reasons.pop((name, gap))) for gap in gaps if (name, gap) in reasons]
        problems += ["%s: no value %s" % (name,
                                          gap) for gap in gaps if not any(note.startswith(gap + ":") for note in notes)]
        covered += not gaps
        rows.append([name, seen.low, seen.high, seen.least, seen.most, "yes" if seen.middle else "no", " ".join(gaps),
                     "; ".join(notes)])
    for name, ways in sorted(SEEN.conditions.items()):
        gaps = [str(way) for way in (True, False) if way not in ways]
        notes = ["%s: %s" % (gap, reasons.pop((name, gap))) for gap in gaps if (name, gap) in reasons]
        problems += ["%s: never %s" % (name,
                                       gap) for gap in gaps if not any(note.startswith(gap + ":") for note in notes)]
        covered += not gaps
        rows.append([name, "", "", "", "", "", " ".join(gaps), "; ".join(notes)])
    problems += ["%s %s: waived needlessly" % key for key in reasons]
    with open(path, "w", encoding="utf-8", newline="") as f:
        out = csv.writer(f, lineterminator="\n")
        out.writerow(["element", "low", "high", "least_seen", "most_seen", "middle_seen", "gaps", "waivers"])
        out.writerows(rows)
    return len(SEEN.elements), len(SEEN.conditions), covered, problems


def main():
    hook()
    root = CONFORMANCE
    for kind in ("valid", "either"):
        for path in sorted(glob.glob(os.path.join(root, "vectors", kind, "*", "*", "in.gss"))):
            with open(path, "rb") as f:
                decoding.Decoder(f.read()).decode()
    os.makedirs(os.path.join(root, "coverage"), exist_ok=True)
    elements, conditions, covered, problems = report(os.path.join(root, "coverage", "syntax.csv"))
    print("\n".join(problems + ["%d elements and %d conditions: %d covered in full, %d problems" % (
        elements, conditions, covered, len(problems))]))
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
