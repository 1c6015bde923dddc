"""Clause 7.15: cells and displacement."""

from fractions import Fraction
from math import floor, isqrt

from constants import TRANSLATION_MAX, TURN_MAX
from conventions import Round, clamp, cross, dot
from errors import require
from homes import canonical, position_limit


class Cell:
    """translation, turn (three integers each) and stale of one cell."""

    def __init__(self, translation, turn, stale):
        self.translation = translation
        self.turn = turn
        self.stale = stale


class Cells:
    """The cells of a P or B frame by their coordinates X; without cells every Gaussian stays as it is."""

    def __init__(self, cell_log2, seq):
        self.cell_log2 = cell_log2
        self.seq = seq
        self.by_place = {}
        self.unity = unity(seq.rotation_step)

    def cell_of(self, gaussian):
        """7.15.2: the cell in which a Gaussian lies, None if it is not among the cells."""
        place = tuple(x >> self.cell_log2 for x in canonical(gaussian.position_fine))
        return place, self.by_place.get(place)

    def displaced(self, gaussian):
        place, cell = self.cell_of(gaussian)
        if cell is None:
            return gaussian
        v = cell.turn
        w = isqrt(2 ** 28 - dot(v, v))
        return gaussian._replace(position_fine=self.position(gaussian.position_fine, place, cell, w),
                                 rotation_fine=self.rotation(gaussian.rotation_fine, v, w))

    def position(self, fine, place, cell, w):
        log2 = self.cell_log2
        centre = [(X << (log2 + 6)) + (1 << (log2 + 5)) for X in place]
        d = [fine[a] - centre[a] for a in range(3)]
        m = cross(cell.turn, d)
        u = cross(cell.turn, m)
        result = []
        for a in range(3):
            p = centre[a] + d[a] + Round(w * m[a] + u[a], 27) + cell.translation[a] * 8
            result.append(clamp(p, 0, position_limit(self.seq)))
        return tuple(result)

    def rotation(self, r, v, w):
        W = isqrt(max(0, (64 * self.unity) * (64 * self.unity) - dot(r, r)))
        turned = cross(v, r)
        negative = w * W - dot(v, r) < 0
        result = []
        for k in range(3):
            n = Round(w * r[k] + v[k] * W + turned[k], 14)
            if negative:
                n = -n
            result.append(clamp(n, -32767 * 64, 32767 * 64))
        return tuple(result)

    def carried(self, gaussians):
        """7.18.1: a carried list in the next frame."""
        result = []
        for gaussian in gaussians:
            cell = self.cell_of(gaussian)[1]
            if cell is None or not cell.stale:
                result.append(self.displaced(gaussian))
        return result


def unity(rotation_step):
    """SS-MO-003: U; Fraction(f) is the exact value of a float."""
    return min(32767, floor(1 / Fraction(rotation_step) + Fraction(1, 2)))


def decode_cells(increment, section, seq):
    """7.15.1 from the values of section cells, which may be None; checks in the order of 8.7."""
    cells = Cells(increment.cell_log2, seq)
    if section is None:
        return cells
    bits = max(seq.position_bits - increment.cell_log2, 1)
    delta = section.values("cell")[0]
    stale = section.values("stale")[0]
    v_translation = section.values("translation")
    v_turn = section.values("turn")
    before = -1                                     # code of the cell before, over all blocks
    for i in range(section.count):
        at = section.at(i)
        if section.starts_block(i):
            code, translation, turn = 0, [0, 0, 0], [0, 0, 0]
        code += delta[i]
        require(code < 2 ** (3 * bits), "CONSTRAINT", "7.15", at)                 # SS-MO-001
        require(code > before, "CONSTRAINT", "7.15", at)
        before = code
        translation = [translation[a] + v_translation[a][i] for a in range(3)]
        turn = [turn[a] + v_turn[a][i] for a in range(3)]
        require(0 <= stale[i] <= 1, "OUT_OF_RANGE", "7.15", at)                   # SS-MO-002
        for a in range(3):
            require(abs(translation[a]) <= TRANSLATION_MAX, "OUT_OF_RANGE", "7.15", at)
        for a in range(3):
            require(abs(turn[a]) <= TURN_MAX, "OUT_OF_RANGE", "7.15", at)
        cells.by_place[coordinates(code, bits)] = Cell(translation, turn, stale[i])
    return cells


def coordinates(code, bits):
    """The three coordinates of a Morton code (7.3, 7.15.1)."""
    return tuple(sum(((code >> (3 * b + a)) & 1) << b for b in range(bits)) for a in range(3))
