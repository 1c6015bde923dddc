#!/usr/bin/env python3
"""Puts the suites and the decoder class into a checkout of fluster: install.py FLUSTER SUITES

FLUSTER is the folder with fluster.py; SUITES has the JSON files that make.py wrote. Fluster lists its codecs in one enumeration, into
which a line for this one goes. Running it again changes nothing.
"""

import pathlib
import shutil
import sys

LINE = '    SPLATSTREAM = "SplatStream"\n'
BEFORE = "\n    def __str__(self) -> str:"


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    fluster, suites = map(pathlib.Path, sys.argv[1:])
    codecs = fluster / "fluster/codec.py"
    text = codecs.read_text(encoding="utf-8")
    if LINE not in text:
        head, found, rest = text.partition(BEFORE)
        if not found:
            sys.exit("%s: there is no enumeration of codecs as this program knows it; add there: %s" % (codecs, LINE.strip()))
        codecs.write_text(head + LINE + found + rest, encoding="utf-8")
    shutil.copy(pathlib.Path(__file__).with_name("splatstream.py"), fluster / "fluster/decoders")
    target = fluster / "test_suites/splatstream"
    target.mkdir(parents=True, exist_ok=True)
    for suite in sorted(suites.glob("*.json")):
        shutil.copy(suite, target)
        print(target / suite.name)


if __name__ == "__main__":
    main()
