"""Patches: what was changed in a parent to get a faulty stream, as edits at offsets of the parent."""

from difflib import SequenceMatcher

from oracle.constants import FILE_HEADER_BYTES


def apply(parent, patch):
    """The bytes after the edits {"at", "remove", "insert"}, which are in increasing order."""
    out, pos = bytearray(), 0
    for edit in patch:
        out += parent[pos:edit["at"]] + bytes.fromhex(edit["insert"])
        pos = edit["at"] + edit["remove"]
    return bytes(out + parent[pos:])


def difference(parent, child):
    """Edits that make `child` of `parent`: unit against unit, then byte against byte."""
    before, after = pieces(parent), pieces(child)
    patch, pos = [], [0]
    for piece in before:
        pos.append(pos[-1] + len(piece))
    for tag, i, j, k, m in SequenceMatcher(None, before, after, autojunk=False).get_opcodes():
        if tag == "replace" and j - i == m - k:
            for a, b, at in zip(before[i:j], after[k:m], pos[i:j]):
                patch += runs(a, b, at)
        elif tag != "equal":
            patch.append(edit(pos[i], b"".join(before[i:j]), b"".join(after[k:m])))
    assert apply(parent, patch) == child
    return patch


def pieces(data):
    """The file_header and the units, by payload_length alone; what is left over is a piece of its own."""
    result, pos = [data[:FILE_HEADER_BYTES]], FILE_HEADER_BYTES
    while pos + 20 <= len(data):
        end = pos + 20 + int.from_bytes(data[pos + 12:pos + 16], "little")
        result.append(data[pos:end])
        pos = end
    return result + [data[pos:]] * (pos < len(data))


def edit(at, old, new):
    return {"at": at, "remove": len(old), "insert": new.hex()}


def runs(a, b, at):
    """Edits from one unit to another: header by itself, of the payload the bytes that differ."""
    result = equal_length(a[:20], b[:20], at)
    a, b, at = a[20:], b[20:], at + 20
    if len(a) == len(b):
        return result + equal_length(a, b, at)
    low = 0
    while low < min(len(a), len(b)) and a[low] == b[low]:
        low += 1
    tail = 0
    while tail < min(len(a), len(b)) - low and a[-1 - tail] == b[-1 - tail]:
        tail += 1
    return result + [edit(at + low, a[low:len(a) - tail], b[low:len(b) - tail])]


def equal_length(a, b, at):
    """Edits of bytes that differ; those less than four bytes apart are one edit."""
    differing = [i for i in range(min(len(a), len(b))) if a[i] != b[i]]
    result, start = [], 0
    for k, position in enumerate(differing):
        if k + 1 == len(differing) or differing[k + 1] - position >= 4:
            low, high = differing[start], position + 1
            result.append(edit(at + low, a[low:high], b[low:high]))
            start = k + 1
    if len(a) != len(b):                            # a header that the end of the data cuts
        shorter = min(len(a), len(b))
        result.append(edit(at + shorter, a[shorter:], b[shorter:]))
    return result
