#!/usr/bin/env python3
"""Checks of the text that need no decoder: bounds of annex F, references to clauses, symbols of clause 3."""

import re
import sys
from pathlib import Path

TYPES = {"i32": 2**31 - 1, "u32": 2**32 - 1, "i64": 2**63 - 1, "u64": 2**64 - 1}
HERE = Path(__file__).parent
TEXTS = {path.name: path.read_text() for glob in ("0*.md", "[abf]-*.md") for path in sorted(HERE.glob(glob))}
# Numbers with a point that are no clauses: versions, steps of 9.3, code.
NUMBERS = re.compile(r"[Vv]ersion \d+\.\d+|steps? \d+\.\d+( to \d+\.\d+)?|`[^`]*`")
CLAUSE = re.compile(r"(?<![\w.-])([1-9A-F](?:\.\d+)+)(?![\w-]|\.\d)")
BOUND = re.compile(r"[0-9^*+() -]+")


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
    wrong = [*widths(TEXTS["f-numeric-widths.md"]), *references(known), *symbols(known)]
    sys.exit("\n".join(wrong) or 0)


if __name__ == "__main__":
    main()
