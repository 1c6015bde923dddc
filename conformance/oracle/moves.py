"""Clauses 7.4.3 and 7.4.6 to 7.4.8: moves, their prediction, what a frame changed of its Gaussians, extrapolation."""

from .constants import FINE_BITS, MOVE_NEIGHBOURS, MOVE_WINDOW, VALUE_MAX, VALUE_MIN
from .conventions import Round, clamp
from .errors import require
from .lists import MOVE, MOVE_AND_UPDATE, SKIP, UPDATE, canonical, position_limit
from .prediction import morton

CELLS, PREVIOUS, NEIGHBOURS, BOTH = range(4)


def difference(a, b):
    return tuple(x - y for x, y in zip(a, b))


def changed_by_frame(gaussian, origin):
    """SS-PA-007: a parent with its motion and fade; `origin` is the parent in the reference frame."""
    return gaussian._replace(motion=difference(gaussian.position_fine, origin.position_fine), fade=gaussian.o - origin.o)


def extrapolated(gaussian, gap):
    """SS-PA-012"""
    return gaussian._replace(o=clamp(gaussian.o + Round(gaussian.fade, gap), VALUE_MIN, VALUE_MAX))


class Parent:
    """A parent of increment h: where it comes from and where its cell takes it, and once it is known its motion."""

    def __init__(self, h, index, origin, displaced, gap):
        self.origin = origin.position_fine
        self.position = canonical(displaced.position_fine)
        self.by_cell = difference(displaced.position_fine, origin.position_fine)
        self.by_motion = tuple(Round(x, gap) for x in origin.motion)
        self.half = tuple(Round(x, 1) for x in difference(self.by_motion, self.by_cell))
        self.rank = (h, index)
        self.code = morton(self.position)
        self.motion = None                          # as long as it is not known; of removed ones for ever


def parents_of(h, origins, displaced, gap):
    return [Parent(h, index, *pair, gap) for index, pair in enumerate(zip(origins, displaced))]


class MovePrediction:
    """Predictions of the moves of the last of some increments, of which `increments` has the Parents; `modes` are its own."""

    def __init__(self, increments, modes):
        self.own = increments[-1]
        for x, mode in zip(self.own, modes):
            if mode in (SKIP, UPDATE):
                x.motion = x.by_cell
        self.order = sorted((x for parents in increments for x in parents), key=lambda x: (x.code, x.rank))
        self.place = {x.rank: place for place, x in enumerate(self.order)}

    def predicted(self, i, predictor):
        """SS-PA-010"""
        x = self.own[i]
        if predictor == CELLS:
            return x.by_cell
        if predictor == PREVIOUS:
            return x.by_motion
        near = self.neighbours(x)
        result = []
        for k in range(3):
            expected = [y.by_cell[k] + (y.half[k] if predictor == BOTH else 0) for y in [x] + near]
            missing = [y.motion[k] - e for y, e in zip(near, expected[1:])]
            result.append(expected[0] + average(missing))
        return tuple(result)

    def neighbours(self, x):
        """SS-PA-011"""
        place = self.place[x.rank]
        candidates = self.order[max(0, place - MOVE_WINDOW):place] + self.order[place + 1:place + 1 + MOVE_WINDOW]
        known = [y for y in candidates if y.motion is not None]
        return sorted(known, key=lambda y: (squared_distance(x, y), y.rank))[:MOVE_NEIGHBOURS]


def squared_distance(x, y):
    return sum(d * d for d in difference(x.position, y.position))


def average(values):
    if not values:
        return 0
    return (2 * sum(values) + len(values)) // (2 * len(values))


def moved(parents, modes, take, prediction, u, seq, at):
    """SS-PA-004: the displaced parents after their moves.

    take(move, start): v_move[0..2] of a move that starts there; prediction: None where every move starts from the displaced
    position, otherwise the MovePrediction and v_move_predictor. The motion of a parent is known after its move.
    """
    result, limit = list(parents), position_limit(seq)
    for move, i in enumerate(i for i, mode in enumerate(modes) if mode in (MOVE, MOVE_AND_UPDATE)):
        start = parents[i].position_fine
        if prediction:
            space, predictors = prediction
            way = space.predicted(i, predictors[move >> u.move_block_log2])
            start = [clamp(x + d, 0, limit) for x, d in zip(space.own[i].origin, way)]
        fine = tuple(x + (v << (u.position_shift + FINE_BITS)) for x, v in zip(start, take(move, start)))
        require(all(0 <= x <= limit for x in fine), "CONSTRAINT", "7.4.3", at)         # SS-PA-005
        result[i] = parents[i]._replace(position_fine=fine)
        if prediction:
            space.own[i].motion = difference(fine, space.own[i].origin)
    return result


def check_move_predictors(section):
    """SS-PA-009"""
    for i, value in enumerate(section.values("move_predictor")[0]):
        require(CELLS <= value <= BOTH, "OUT_OF_RANGE", "7.4.7", section.at(i))
