"""Writes MANIFEST beside a folder of vectors: python3 -m generator.manifest FOLDER [--check]

How many vectors there are, and SHA-256 over a line `sha256 name` for each in the order of the names; the digest in it is that
of vector.json, which has that of the stream. With it the runner notices a suite that is not whole.
"""

import hashlib
import os
import sys


def text_of(folder):
    """What MANIFEST says of the vectors that are there."""
    lines = []
    for part, _, files in os.walk(folder):
        if "vector.json" in files:
            with open(os.path.join(part, "vector.json"), "rb") as f:
                lines.append((os.path.basename(part), hashlib.sha256(f.read()).hexdigest()))
    whole = "".join("%s %s\n" % (sha256, name) for name, sha256 in sorted(lines))
    return "%d\n%s\n" % (len(lines), hashlib.sha256(whole.encode()).hexdigest())


def path_of(folder):
    return os.path.join(os.path.dirname(os.path.abspath(folder)), "MANIFEST")


def problems(folder):
    """What is wrong with the file, as lines."""
    path = path_of(folder)
    if os.path.exists(path) and open(path).read() == text_of(folder):
        return []
    return ["differs: %s; make.py writes it" % path]


def write(folder):
    with open(path_of(folder), "w") as f:
        f.write(text_of(folder))


def main():
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    found = problems(sys.argv[1]) if "--check" in sys.argv else write(sys.argv[1])
    print("\n".join(found or [text_of(sys.argv[1]).replace("\n", " ")]))
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
