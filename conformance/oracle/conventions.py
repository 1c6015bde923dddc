"""Clause 4: operators, byte and bit descriptors, CRC-32, XXH64."""

import struct

from .errors import StreamError

# ---- 4.2 operators (Python's //, % and >> already round towards negative infinity) ----


def Round(x, s):
    return x if s == 0 else (x + (1 << (s - 1))) >> s


def ceil_div(a, b):
    return (a + b - 1) // b


def bl(a):
    return a.bit_length()


def clamp(a, lo, hi):
    return max(lo, min(hi, a))


def tz(a):
    """Number of trailing zero bits of a >= 1."""
    return (a & -a).bit_length() - 1


def dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


# ---- 4.3 byte descriptors ----

STRUCT_CODE = {"u8": "B", "u16": "H", "u32": "I", "u64": "Q", "i8": "b", "i16": "h", "i32": "i", "f32": "f"}
TYPE_BYTES = {"u8": 1, "u16": 2, "u32": 4, "u64": 8, "i8": 1, "i16": 2, "i32": 4, "f32": 4}


class ByteReader:
    """Reads the bytes start..end-1 of the stream. Positions are offsets in the stream."""

    def __init__(self, data, start, end):
        self.data = data
        self.start = start
        self.pos = start
        self.end = end

    def left(self):
        return self.end - self.pos

    def values(self, kind, count, clause):
        """`count` values of a descriptor, as a list; SHORT_SECTION if they do not fit."""
        size = TYPE_BYTES[kind] * count
        if size > self.left():
            raise StreamError("SHORT_SECTION", clause, self.pos)                      # SS-ER-003
        result = list(struct.unpack_from("<%d%s" % (count, STRUCT_CODE[kind]), self.data, self.pos))
        self.pos += size
        return result

    def value(self, kind, clause):
        return self.values(kind, 1, clause)[0]

    def leb128(self, clause):
        start = self.pos
        value = 0
        for k in range(5):
            if self.left() == 0:
                raise StreamError("SHORT_SECTION", clause, start)
            byte = self.data[self.pos]
            self.pos += 1
            if k == 4 and byte > 15:
                raise StreamError("NUMBER", "4.3", start)
            value += (byte & 127) << (7 * k)
            if byte < 128:
                if k > 0 and byte == 0:
                    raise StreamError("NUMBER", "4.3", start)
                return value
        raise AssertionError("the fifth byte always ends the number or is an error")

    def section(self, length, clause):
        """A reader for the next `length` bytes."""
        if length > self.left():
            raise StreamError("SHORT_SECTION", clause, self.pos)
        part = ByteReader(self.data, self.pos, self.pos + length)
        self.pos += length
        return part

    def check_end(self, clause):
        if self.left() > 0:
            raise StreamError("TRAILING_BYTES", clause, self.pos)                     # SS-ER-003


# ---- 4.4 bit descriptors ----


class BitReader:
    """A bit section; it reports SHORT_SECTION at the element that takes a bit beyond the end."""

    def __init__(self, data, start, end, clause):
        self.data = data
        self.bit = 8 * start
        self.end_bit = 8 * end
        self.clause = clause

    def byte(self):
        """The byte at which reading has arrived."""
        return self.bit // 8

    def u(self, n):
        if n == 0:
            return 0
        if self.bit + n > self.end_bit:
            raise StreamError("SHORT_SECTION", self.clause, self.end_bit // 8)
        first = self.bit // 8
        chunk = int.from_bytes(self.data[first:first + 9], "little")
        value = (chunk >> (self.bit % 8)) & ((1 << n) - 1)
        self.bit += n
        return value

    def ue(self):
        z = 0
        while self.u(1) == 0:
            z += 1
            if z > 31:
                raise StreamError("NUMBER", "4.4", self.byte())
        return 2 ** z - 1 + self.u(z)

    def se(self):
        k = self.ue()
        if k % 2 == 1:
            return (k + 1) // 2
        return -(k // 2)

    def check_end(self):
        left = self.end_bit - self.bit
        if left >= 8:
            raise StreamError("TRAILING_BYTES", "4.4", self.byte())
        if self.u(left) != 0:
            raise StreamError("PADDING", "4.4", self.end_bit // 8 - 1)


# ---- 4.5 signed values ----


def unzigzag(u):
    if u % 2 == 0:
        return u // 2
    return -((u + 1) // 2)


# ---- 4.6 CRC-32 ----


def _crc_of_byte(c):
    for _ in range(8):
        c = (c >> 1) ^ 0xEDB88320 if c % 2 == 1 else c >> 1
    return c


# The eight rounds of the loop for each low byte of c, tabulated.
_CRC_TABLE = [_crc_of_byte(c) for c in range(256)]


def crc32(data):
    c = 0xFFFFFFFF
    for byte in data:
        c = (c >> 8) ^ _CRC_TABLE[(c ^ byte) & 255]
    return c ^ 0xFFFFFFFF


# ---- 4.7 XXH64 ----

M64 = 2 ** 64 - 1
P1 = 0x9E3779B185EBCA87
P2 = 0xC2B2AE3D27D4EB4F
P3 = 0x165667B19E3779F9
P4 = 0x85EBCA77C2B2AE63
P5 = 0x27D4EB2F165667C5


def rotl64(a, n):
    return ((a << n) | (a >> (64 - n))) & M64


def _round(a, lane):
    return (rotl64((a + lane * P2) & M64, 31) * P1) & M64


def _merge(h, a):
    return ((h ^ _round(0, a)) * P1 + P4) & M64


def xxh64(seed, data):
    length = len(data)
    k = 0
    if length >= 32:
        a0 = (seed + P1 + P2) & M64
        a1 = (seed + P2) & M64
        a2 = seed & M64
        a3 = (seed - P1) & M64
        whole = length - length % 32
        for l0, l1, l2, l3 in struct.iter_unpack("<4Q", memoryview(data)[:whole]):
            a0 = _round(a0, l0)
            a1 = _round(a1, l1)
            a2 = _round(a2, l2)
            a3 = _round(a3, l3)
        k = whole
        h = (rotl64(a0, 1) + rotl64(a1, 7) + rotl64(a2, 12) + rotl64(a3, 18)) & M64
        for a in (a0, a1, a2, a3):
            h = _merge(h, a)
    else:
        h = (seed + P5) & M64
    h = (h + length) & M64
    while k + 8 <= length:
        h = (rotl64(h ^ _round(0, struct.unpack_from("<Q", data, k)[0]), 27) * P1 + P4) & M64
        k += 8
    if k + 4 <= length:
        h = (rotl64(h ^ ((struct.unpack_from("<I", data, k)[0] * P1) & M64), 23) * P2 + P3) & M64
        k += 4
    while k < length:
        h = (rotl64(h ^ ((data[k] * P5) & M64), 11) * P1) & M64
        k += 1
    h = ((h ^ (h >> 33)) * P2) & M64
    h = ((h ^ (h >> 29)) * P3) & M64
    return h ^ (h >> 32)
