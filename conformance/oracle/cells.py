"""Clause 7.5: cells and displacement."""

from fractions import Fraction
from math import floor, isqrt

from .constants import CELL_ROTATION_MAX, TRANSLATION_MAX
from .conventions import Round, clamp, cross, dot
from .errors import require
from .lists import canonical, position_limit


class Cell:
    """translation, rotation (three integers each) and stale of one cell."""

    def __init__(self, translation, rotation, stale):
        self.translation = translation
        self.rotation = rotation
        self.stale = stale


class Cells:
    """The cells of a P or B frame by their coordinates X; without cells every Gaussian stays as it is."""

    def __init__(self, cell_log2, seq):
        self.cell_log2 = cell_log2
        self.seq = seq
        self.by_coordinates = {}
        self.unity = unity(seq.rotation_step)

    def cell_of(self, gaussian):
        """7.5.2: the coordinates of the cell in which a Gaussian lies; the cell, None if it is not among the cells."""
        X = tuple(x >> self.cell_log2 for x in canonical(gaussian.position_fine))
        return X, self.by_coordinates.get(X)

    def displaced(self, gaussian):
        """SS-MO-004: everything is computed from the values before the displacement."""
        X, cell = self.cell_of(gaussian)
        if cell is None:
            return gaussian
        v = cell.rotation
        w = isqrt(2 ** 28 - dot(v, v))
        return gaussian._replace(position_fine=self.position(gaussian.position_fine, X, cell, w),
                                 rotation_fine=self.rotation(gaussian.rotation_fine, v, w))

    def position(self, fine, X, cell, w):
        log2 = self.cell_log2
        centre = [(x << (log2 + 6)) + (1 << (log2 + 5)) for x in X]
        d = [fine[k] - centre[k] for k in range(3)]
        m = cross(cell.rotation, d)
        u = cross(cell.rotation, m)
        result = []
        for k in range(3):
            moved = centre[k] + d[k] + Round(w * m[k] + u[k], 27) + cell.translation[k] * 8
            result.append(clamp(moved, 0, position_limit(self.seq)))
        return tuple(result)

    def rotation(self, r, v, w):
        W = isqrt(max(0, (64 * self.unity) * (64 * self.unity) - dot(r, r)))
        product = cross(v, r)
        negative = w * W - dot(v, r) < 0
        result = []
        for k in range(3):
            n = Round(w * r[k] + v[k] * W + product[k], 14)
            if negative:
                n = -n
            result.append(clamp(n, -32767 * 64, 32767 * 64))
        return tuple(result)

    def carried(self, gaussians, without_stale):
        """SS-CA-001: a carried list in the next frame, stale cells left out if asked for."""
        result = []
        for gaussian in gaussians:
            cell = self.cell_of(gaussian)[1]
            if cell is None or not (cell.stale and without_stale):
                result.append(self.displaced(gaussian))
        return result


def unity(rotation_step):
    """SS-MO-003: U; Fraction(f) is the exact value of a float."""
    return min(32767, floor(1 / Fraction(rotation_step) + Fraction(1, 2)))


def decode_cells(cell_log2, section, seq):
    """7.5.1 from the values of section cells, which is None in a frame without cells."""
    cells = Cells(cell_log2, seq)
    if section is None:
        return cells
    bits = max(seq.position_bits - cell_log2, 1)
    delta = section.values("cell")[0]
    stale = section.values("stale")[0]
    v_translation = section.values("translation")
    v_rotation = section.values("cell_rotation")
    before = -1                                     # code of the cell before, over all blocks
    for i in range(section.count):
        at = section.at(i)
        if section.starts_block(i):
            code, translation, rotation = 0, [0, 0, 0], [0, 0, 0]
        code += delta[i]
        require(code < 2 ** (3 * bits), "CONSTRAINT", "7.5.1", at)                     # SS-MO-001
        require(code > before, "CONSTRAINT", "7.5.1", at)
        before = code
        translation = [translation[k] + v_translation[k][i] for k in range(3)]
        rotation = [rotation[k] + v_rotation[k][i] for k in range(3)]
        require(0 <= stale[i] <= 1, "OUT_OF_RANGE", "7.5.1", at)                       # SS-MO-002
        for k in range(3):
            require(abs(translation[k]) <= TRANSLATION_MAX, "OUT_OF_RANGE", "7.5.1", at)
            require(abs(rotation[k]) <= CELL_ROTATION_MAX, "OUT_OF_RANGE", "7.5.1", at)
        cells.by_coordinates[coordinates(code, bits)] = Cell(translation, rotation, stale[i])
    return cells


def coordinates(code, bits):
    """The three coordinates of a Morton code (7.5.1, 7.6.4)."""
    return tuple(sum(((code >> (3 * b + k)) & 1) << b for b in range(bits)) for k in range(3))
