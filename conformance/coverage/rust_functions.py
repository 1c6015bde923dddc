"""Functions of a Rust file by line, as rustfmt leaves them: a body ends at the brace that stands where its head begins."""

import re

HEAD = re.compile(r"( *)(?:pub(?:\([a-z ]+\))? )?(?:const )?(?:unsafe )?fn (\w+)")
OWNER = re.compile(r"( *)(?:pub(?:\([a-z ]+\))? )?(?:unsafe )?(impl|trait)\b(.*)")
GENERICS = re.compile(r"<[^<>]*>")


def end_of(lines, start, indent):
    """The last line of the item that begins at `start`; none if it has no body."""
    for at in range(start, len(lines)):
        if lines[at].startswith(indent + "}"):
            return at
        if lines[at].endswith(";") and not any("{" in line for line in lines[start:at + 1]):
            return None
        if at == start and lines[at].endswith("}"):
            return at
    return None


def owner_name(kind, rest):
    """`Type`, or `Trait for Type`, without generics."""
    while GENERICS.search(rest):
        rest = GENERICS.sub("", rest)
    rest = rest.split(" where ")[0].rstrip("{ ").strip()
    return rest.split(":")[0].strip() if kind == "trait" else rest


def functions_of(text):
    """(first line, last line, name) of each function, counted from 1, inner ones after those around them."""
    lines, owners, result = text.split("\n"), [], []
    for start, line in enumerate(lines):
        owner = OWNER.match(line)
        if owner:
            end = end_of(lines, start, owner[1])
            head = " ".join(part.strip() for part in lines[start:start + 3]).split("{")[0]
            kind, rest = OWNER.match(owner[1] + head).group(2, 3)
            owners.append((start, end or start, owner_name(kind, rest)))
        head = HEAD.match(line)
        end = end_of(lines, start, head[1]) if head else None
        if end is not None:
            around = [name for first, last, name in owners if first <= start <= last]
            result.append((start + 1, end + 1, "::".join(around[-1:] + [head[2]])))
    return result


class Functions:
    """The functions of one file."""

    def __init__(self, text):
        self.lines = text.split("\n")
        self.spans = functions_of(text)

    def at(self, line):
        """The innermost function of a line; the empty name outside of all."""
        around = [(last - first, name) for first, last, name in self.spans if first <= line <= last]
        return min(around)[1] if around else ""

    def text(self, line):
        return self.lines[line - 1].strip()
