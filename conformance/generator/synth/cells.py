"""Cells of a frame_header (5.6, 7.15.1), at random or as asked for."""

from oracle import models as pm
from oracle.cells import Cell, Cells, coordinates
from oracle.constants import CELL_ROTATION_MAX, TRANSLATION_MAX
from oracle.lists import canonical
from .encoding import SectionEncoder, section


def morton(coordinates, bits):
    return sum(((x >> b) & 1) << (3 * b + a) for a, x in enumerate(coordinates) for b in range(bits))


def clamped(x, most):
    return max(-most, min(most, x))


class CellsWriter:
    """The cells of a frame with a given reference frame.

    asked: a function of the writer and the occupied cells in order that gives {X: (translation, rotation, stale)}, or None.
    """

    def __init__(self, rng, seq, reference, tamper=None, asked=None, cell_log2=None, lanes_log2=0):
        self.rng, self.seq, self.reference, self.asked, self.lanes_log2 = rng, seq, reference, asked, lanes_log2
        self.tamper = tamper or (lambda stage, value, writer: value)
        self.cell_log2 = rng.randint(0, seq.position_bits) if cell_log2 is None else cell_log2
        self.bits = max(seq.position_bits - self.cell_log2, 1)
        self.wild = rng.random() < 0.2

    def displace(self, u):
        """Gives the elements of a frame_header their cells; returns the carried lists of the frame."""
        rows = self.asked(self, self.occupied()) if self.asked else self.drawn()
        if not rows:
            return self.reference.carried()
        u.set("cell_count", len(rows))
        u.cell_log2 = self.cell_log2
        cells, planes = self.planes(rows)
        planes = self.tamper("cells", planes, self)
        coded = pm.section_planes("cells", 0, 0, 0, 0)
        encoder = SectionEncoder(self.rng, coded, planes, 2 ** self.seq.block_log2, 2 ** self.lanes_log2,
                                 self.reference.cell_models.get("cells"), pm.source_available)
        u.rest = section(self.lanes_log2, *self.tamper("coded", encoder.run(), self))
        return [cells.carried(gaussians, True) for gaussians in self.reference.carried()]

    def planes(self, rows):
        """The Cells and the values of the planes of 8.1, which are differences inside each block."""
        cells, planes = Cells(self.cell_log2, self.seq), [[] for _ in range(8)]
        for i, code in enumerate(sorted(morton(X, self.bits) for X in rows)):
            X = coordinates(code, self.bits)
            if i % 2 ** self.seq.block_log2 == 0:
                before, translation, rotation = 0, [0] * 3, [0] * 3
            new_translation, new_rotation, stale = rows[X]
            # a value has 17 bits (8.1): what is farther takes several cells
            new_translation = [b + clamped(a - b, 32000) for a, b in zip(new_translation, translation)]
            row = [code - before, stale] + [a - b for a, b in zip(new_translation, translation)]
            row += [a - b for a, b in zip(new_rotation, rotation)]
            for plane, value in zip(planes, row):
                plane.append(value)
            before, translation, rotation = code, new_translation, new_rotation
            cells.by_coordinates[X] = Cell(translation, rotation, stale)
        return cells, planes

    def occupied(self):
        """Cells in which the carried lists of the reference frame have Gaussians, in the order of their codes."""
        found = {tuple(x >> self.cell_log2 for x in canonical(g.position_fine))
                 for gaussians in self.reference.carried() for g in gaussians}
        return sorted(found, key=lambda X: morton(X, self.bits))

    def drawn(self):
        """Some occupied cells, and sometimes two anywhere."""
        rng, occupied = self.rng, self.occupied()
        most = rng.choice([0, 1, 3, 8, 8, 20, 70])
        chosen = set(rng.sample(occupied, min(most, len(occupied))))
        for _ in range(rng.choice([0, 0, 2])):
            chosen.add(tuple(rng.randrange(2 ** self.bits) for _ in range(3)))
        return {X: self.values() for X in sorted(chosen)}

    def values(self):
        """(translation, rotation, stale) of a cell."""
        rng = self.rng
        reach, bend = rng.choice([0, 3, 40, 8 << self.cell_log2]), rng.choice([0, 0, 100, 2000])
        translation = [clamped(rng.randint(-reach, reach), TRANSLATION_MAX) for _ in range(3)]
        rotation = [rng.randint(-bend, bend) for _ in range(3)]
        if self.wild and rng.random() < 0.3:
            most = TRANSLATION_MAX
            translation = [rng.choice([-most, 0, most, rng.randint(-most, most)]) for _ in range(3)]
            rotation = [rng.choice([-CELL_ROTATION_MAX, CELL_ROTATION_MAX, 0, 5792]) for _ in range(3)]
        return translation, rotation, int(rng.random() < 0.3)
