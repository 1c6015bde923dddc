"""Sections with their models and values; increments: the list after the unit (7.4.4)."""

from . import models as plane_models, prediction
from .cells import coordinates
from .constants import MAX_LEARNED
from .errors import require
from .lists import MOVE_AND_UPDATE, REMOVE, UPDATE, Gaussian, check_modes, survivors
from .moves import MovePrediction, changed_by_frame, check_move_predictors, extrapolated, moved, parents_of
from .parsing import BlockDecoder
from .reconstruction import prefix_count
from .residuals import Residuals
from .semantics import divide_increment, parse_increment
from .steps import StepRule


class Context:
    """What the values of a frame depend on beside the frame."""

    def __init__(self, file_header, seq, dc_transform, sh_transform, codebooks, network):
        self.profile, self.level = file_header.profile, file_header.level
        self.seq = seq
        self.dc_transform, self.sh_transform = dc_transform, sh_transform
        self.codebooks = codebooks
        self.network = network                      # None in a GOP without weights


class Section:
    """A section of a frame_header or an increment: its planes, models and the values of all its blocks.

    rule: the StepRule of the increment.
    """

    def __init__(self, division, planes, seq, rule=None):
        self.name, self.count = division.name, division.count
        self.division, self.planes, self.rule = division, planes, rule
        self.block_size = 2 ** seq.block_log2

    def parse_models(self, in_force):
        """The models of this section by the identity of their planes."""
        self.models = plane_models.parse_models(self.division.models_section, self.planes, in_force)
        return {plane.identity(): model for plane, model in zip(self.planes, self.models)}

    def parse_blocks(self):
        """SS-EC-006: parsing does not depend on checks of values."""
        self.e = [[] for _ in self.planes]
        self.blocks = []
        left = self.count
        for block in self.division.block_sections:
            n = min(left, self.block_size)
            left -= n
            self.blocks.append(BlockDecoder(block, self.planes, self.models, self.division.lanes, n, self.rule))
            for whole, part in zip(self.e, self.blocks[-1].decode()):
                whole.extend(part)

    def values(self, attribute):
        """v of the planes of an attribute over all blocks."""
        return [[value + self.models[plane.number].bias for value in self.e[plane.number]]
                for plane in self.planes if plane.attribute == attribute]

    def starts_block(self, i):
        return i % self.block_size == 0

    def at(self, i=0):
        """Offset of the block of entry i."""
        return self.division.block_sections[i // self.block_size].start

    def coded(self):
        """What entropy_state.py needs."""
        return self.planes, self.models, self.blocks


def parse_sections(sections, in_force):
    """Models and blocks of sections; gives the models after them by section (SS-PM-001, SS-SE-001)."""
    after = dict(in_force)
    for section in sections:
        after[section.name] = section.parse_models(in_force.get(section.name, {}))
    for section in sections:
        section.parse_blocks()
    return after


class Increment:
    """Decodes unit (s, r) of a frame.

    Afterwards: `list`, `new` (its new Gaussians), `parents` (moves.Parents, in a P or B frame), `models` after the unit,
    `header` (its elements), `coded` (planes, models and blocks of each section).
    """

    def __init__(self, unit, frame, context):
        self.unit, self.frame, self.context = unit, frame, context
        self.s, self.r = unit.spatial_layer, unit.refinement

    def decode(self, reader):
        parents = self.frame.parents(self.s, self.r)
        self.header = parse_increment(reader, self.unit, self.frame, self.context, len(parents))
        self.check_sizes()
        divide_increment(self.header, reader, self.context.seq.block_log2)
        rule = StepRule(self.context.seq, self.header.attribute_step)
        sections = [Section(division, self.planes(division.name), self.context.seq, rule)
                    for division in self.header.sections]
        self.models = parse_sections(sections, self.frame.models_in_force(self.s, self.r))
        self.coded = [section.coded() for section in sections]
        self.reconstruct({section.name: section for section in sections}, parents)
        return self

    def planes(self, name):
        sh_rank = self.context.sh_transform.rank if self.context.sh_transform else 0
        return plane_models.section_planes(name, self.context.dc_transform.rank, self.header.sh_mode, sh_rank,
                                           self.header.vq_stage_count)

    def check_sizes(self):
        """SS-PA-006"""
        u, seq, frame = self.header, self.context.seq, self.frame
        n_total = frame.header.gaussian_count
        size = u.parent_count - u.remove_count + u.new_count
        total = sum(len(frame.lists[(self.s, h)]) for h in range(self.r)) + size
        good = total <= n_total
        if frame.intra and self.s == seq.top:
            good = good and size == prefix_count(seq, n_total, self.r) - prefix_count(seq, n_total, self.r - 1)
        if not frame.intra and self.r == seq.refinement_count - 1:
            good = good and total == n_total
        require(good, "MISMATCH", "7.4.5", u.at("new_count" if u.has("new_count") else "increment_flags"))

    def reconstruct(self, sections, parents):
        """Values and reconstruction, 7.4 to 7.7"""
        u, seq, frame = self.header, self.context.seq, self.frame
        modes = []
        if "modes" in sections:
            modes = sections["modes"].values("mode")[0]
            check_modes(modes, u, frame.intra, sections["modes"].at())
        self.find_parents(parents)
        changed = self.extrapolated(parents)
        if "moves" in sections:
            planes = sections["moves"].values("move")
            changed = moved(changed, modes, lambda move, _: [plane[move] for plane in planes],
                            self.move_prediction(sections, modes), u, seq, sections["moves"].at())
        if "updates" in sections:
            section = sections["updates"]
            changed = self.updated(changed, modes, lambda attribute, *_: section.values(attribute), section.at())
        if not frame.intra:
            changed = self.with_changes(changed, modes)
        predictors = []
        if "predictors" in sections:
            prediction.check_predictors(sections["predictors"], self.context.network)
            predictors = sections["predictors"].values("predictor")[0]
            self.check_learned(predictors, changed, sections["predictors"].at())
        self.new = []
        if "new" in sections:
            section = sections["new"]
            self.new = self.new_gaussians(self.positions(section), predictors, changed,
                                          lambda attribute, *_: section.values(attribute), section.at())
        self.list = (survivors(changed, modes) if modes else changed) + self.new

    def move_prediction(self, sections, modes):
        """The MovePrediction of the unit and its move predictors; None if it has none."""
        if "move_predictors" not in sections:
            return None
        check_move_predictors(sections["move_predictors"])
        return self.move_space(modes), sections["move_predictors"].values("move_predictor")[0]

    def find_parents(self, parents):
        """The moves.Parents of the unit; `parents` are displaced."""
        origins = self.frame.origins(self.s, self.r)
        self.parents = [] if self.frame.intra else parents_of(self.r, origins, parents, self.frame.gap())

    def extrapolated(self, parents):
        """SS-PA-012; those that are removed do not matter."""
        if not self.header.extrapolates_opacity:
            return parents
        return [extrapolated(g, self.frame.gap()) for g in parents]

    def move_space(self, modes):
        return MovePrediction([self.frame.moved[h] for h in range(self.r)] + [self.parents], modes)

    def with_changes(self, changed, modes):
        """SS-PA-007, for the parents of a P or B frame"""
        result = [changed_by_frame(g, origin) for g, origin in zip(changed, self.frame.origins(self.s, self.r))]
        for i, parent in enumerate(self.parents):
            parent.motion = None if modes and modes[i] == REMOVE else result[i].motion
        return result

    def updated(self, parents, modes, take, at):
        """SS-PA-004: the parents after their updates."""
        updaters = [i for i, mode in enumerate(modes) if mode in (UPDATE, MOVE_AND_UPDATE)]

        def predict(attribute, j, _):
            parent = parents[updaters[j]]
            return {"log_scale": parent.q, "opacity": parent.o, "rotation": parent.rotation_fine,
                    "dc": parent.dc, "sh": parent.sh}[attribute]

        result = list(parents)
        updated = [parents[i] for i in updaters]
        values = Residuals(len(updaters), predict, take, self.header, self.context, at, updated).run()
        for i, v in zip(updaters, values):
            result[i] = parents[i]._replace(q=v.q, o=v.o, rotation_fine=v.rotation_fine, dc=v.dc, sh=v.sh)
        return result

    def positions(self, section):
        """7.6.4: canonical positions of new Gaussians."""
        shift = self.header.position_shift
        bits = self.context.seq.position_bits - shift
        middle = (1 << shift) >> 1                                                    # SS-PO-003
        result = []
        for i, delta in enumerate(section.values("position")[0]):
            code = delta if section.starts_block(i) else code + delta                 # SS-PO-002
            require(code < 2 ** (3 * bits), "CONSTRAINT", "7.6.4", section.at(i))       # SS-PO-001
            result.append(tuple((x << shift) + middle for x in coordinates(code, bits)))
        return result

    def references(self, parents):
        """7.7.1; `parents` are those after moves and updates."""
        return [prediction.reference(g) for g in self.frame.reference_set(self.s, self.r, parents)]

    def check_learned(self, predictors, parents, at):
        """SS-PR-004"""
        if prediction.TRANSFORMER in predictors:
            kinds = prediction.predictor_of_entries(self.header.new_count, self.header, predictors,
                                                    self.references(parents))
            most = MAX_LEARNED[self.context.level]
            require(kinds.count(prediction.TRANSFORMER) <= most, "OVER_LIMIT", "7.7.2", at)

    def new_gaussians(self, positions, predictors, parents, take, at):
        """7.6 and 7.7"""
        references = self.references(parents) if self.header.predictors else []
        kinds = prediction.predictor_of_entries(len(positions), self.header, predictors, references)
        predict = prediction.NewPredictions(positions, kinds, references, self.header, self.context)
        values = Residuals(len(positions), predict, take, self.header, self.context, at).run()
        anchor = 1 if self.frame.intra else 0
        return [Gaussian(tuple(x << 6 for x in position), v.q, v.o, v.rotation_fine, tuple(v.dc), tuple(v.sh), anchor)
                for position, v in zip(positions, values)]
