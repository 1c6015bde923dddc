#!/usr/bin/env python3
"""Checks of the text that need no decoder.

Bounds of annex F, numbers of A.3, sizes of clause 5, references to clauses, symbols of clause 3.
"""

import re
import sys
from pathlib import Path

TYPES = {"i32": 2**31 - 1, "u32": 2**32 - 1, "i64": 2**63 - 1, "u64": 2**64 - 1}
HERE = Path(__file__).parent
TEXTS = {path.name: path.read_text() for glob in ("0*.md", "[abcfg]-*.md") for path in sorted(HERE.glob(glob))}
# Numbers with a point that are not clauses: versions, rounded numbers of A.3, code.
NUMBERS = re.compile(r"(?:[Vv]ersion|SplatStream) \d+\.\d+|\d+\.\d+ (?:k|M|G|MB)\b|`[^`]*`")
CLAUSE = re.compile(r"(?<![\w.-])([1-9A-F](?:\.\d+)+)(?![\w-]|\.\d)")
BOUND = re.compile(r"[0-9^*+() -]+")
# The limits of A.2 that the bounds of A.3 are computed from, by the first word of their rows.
LIMITS = {"N": "Gaussians of a frame", "M": "cells of a frame", "T": "new Gaussians of an increment with", "V": "codebook values"}
SUFFIXES = {"k": 10**3, "M": 10**6, "G": 10**9}
SIZES = {"u8": 1, "u16": 2, "u32": 4, "u64": 8, "i8": 1, "i32": 4, "f32": 4}


def cells(line):
    return [cell.strip() for cell in re.split(r"(?<!\\)\|", line)[1:-1]]


def widths(text):
    """The rows of annex F whose bound does not fit the type, or is not written in numbers."""
    rows = [row for row in map(cells, text.splitlines()) if len(row) == 5 and row[4] in TYPES]
    assert len(rows) > 80, "the tables of annex F are found"
    for quantity, _, _, bound, kind in rows:
        bound = bound.strip("`")
        if not BOUND.fullmatch(bound):
            yield f"annex F: {quantity}: `{bound}` is no expression in numbers"
        elif not 0 < eval(bound.replace("^", "**"), {}) <= TYPES[kind]:
            yield f"annex F: {quantity}: {bound} does not fit {kind}"


def clauses():
    """The text of each clause by its number, without the clauses below it."""
    found = {}
    for text in TEXTS.values():
        for part in re.split(r"^(?=#+ )", text, flags=re.M):
            title = part.partition("\n")[0].lstrip("#").split()
            if title:
                found[title[1] if title[0] == "Annex" else title[0]] = part
    return found


def references(known):
    """Clauses that the prose refers to and that are not there."""
    for name, text in TEXTS.items():
        for line in re.sub(r"```.*?```", "", text, flags=re.S).splitlines():
            for clause in CLAUSE.findall(NUMBERS.sub("", line)):
                if clause not in known:
                    yield f"{name}: there is no clause {clause}: {line[:60]}"


def work(known):
    """Numbers of A.3 that do not follow from the limits of A.2 by the bound of their row."""
    limits = {name: [int(cell[2:]) for cell in cells(line)[-4:]] for line in known["A.2"].splitlines()
              for name, title in LIMITS.items() if line.startswith(f"| {title}")}
    rows = [row for row in map(cells, known["A.3"].splitlines()) if len(row) == 6 and row[1].startswith("`")]
    assert len(rows) > 10 and len(limits) == len(LIMITS), "the tables of annex A are found"
    for quantity, bound, *numbers in rows:
        for level, number in enumerate(numbers):
            value = eval(bound.strip("`"), {name: 2 ** powers[level] for name, powers in limits.items()})
            digits, _, suffix = number.partition(" ")
            if abs(float(digits) * SUFFIXES[suffix] - value) > value * 0.005:
                yield f"A.3: {quantity}: level {level + 1} is {value}, not {number}"


def sizes(known):
    """Records of clause 5 whose fixed part has not the bytes that stand above the table."""
    for clause, text in known.items():
        said = re.search(r"^(?:The fixed part has )?(\d+) bytes?[.,]", text, re.M)
        if not said or not clause.startswith("5."):
            continue
        total = 0
        for row in map(cells, text.splitlines()):
            kind = re.fullmatch(r"(\w+)(?:\[(\d+)\])?", row[1]) if len(row) == 3 else None
            if row[:1] == ["Element"] or row[:1] and row[0].startswith("---"):
                continue
            if len(row) == 3 and (not kind or kind[1] not in SIZES):
                break
            total += SIZES[kind[1]] * int(kind[2] or 1) if kind else 0
        if total != int(said[1]):
            yield f"clause {clause}: the fixed part has {total} bytes, not {said[1]}"


def symbols(known):
    """Rows of 3.3 whose clauses do not have the symbol they are said to define."""
    for line in known["3.3"].splitlines():
        names, defined = re.findall(r"`(\w+)", line.rpartition("|")[0]), CLAUSE.findall(line)
        if not line.startswith("| `") or names[0] == "v_name":
            continue
        words = {word for number, part in known.items() for word in re.findall(r"\w+", part)
                 if any(f"{number}.".startswith(f"{clause}.") for clause in defined)}
        if names[0] not in words:
            yield f"clause 3.3: {names[0]} is not in {', '.join(defined)}"


def main():
    known = clauses()
    wrong = [*widths(TEXTS["f-numeric-widths.md"]), *work(known), *sizes(known), *references(known), *symbols(known)]
    sys.exit("\n".join(wrong) or 0)


if __name__ == "__main__":
    main()
