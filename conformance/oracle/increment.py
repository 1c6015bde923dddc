"""Increments: models and blocks of sections, values in the order of 8.7, the home after the unit (7.14.4)."""

import models as plane_models
import prediction
from cells import coordinates, decode_cells
from constants import MAX_LEARNED
from errors import require
from homes import Gaussian, MOVE_AND_UPDATE, UPDATE, check_modes, moved, survivors
from parsing import BlockDecoder
from reconstruction import prefix_count
from residuals import Residuals
from semantics_dynamic import parse_increment


class Context:
    """What the values of an increment depend on beside its frame."""

    def __init__(self, seq, dc_transform, sh_transform, codebooks, network):
        self.seq = seq
        self.dc_transform, self.sh_transform = dc_transform, sh_transform
        self.codebooks = codebooks
        self.network = network                      # None in a GOP without weights


class Section:
    """A section of an increment: its planes, models and the values of all its blocks."""

    def __init__(self, division, increment, context):
        self.name, self.count = division.name, division.count
        self.division = division
        self.block_size = 2 ** context.seq.block_log2
        self.planes = plane_models.section_planes(
            division.name, context.dc_transform.rank, increment.sh_mode,
            context.sh_transform.rank if context.sh_transform else 0, increment.vq_stage_count)

    def parse_models(self, in_force):
        """8.7 step 1; the models of this section by the identity of their planes."""
        available = (plane_models.source_available if self.name == "new"
                     else plane_models.source_available_in_section)
        self.models = plane_models.parse_models(self.division.models_section, self.planes, in_force, available)
        return {plane.identity(): model for plane, model in zip(self.planes, self.models)}

    def parse_blocks(self):
        """8.7 step 2"""
        self.e = [[] for _ in self.planes]
        self.blocks = []
        left = self.count
        for block in self.division.block_sections:
            n = min(left, self.block_size)
            left -= n
            self.blocks.append(BlockDecoder(block, self.planes, self.models, self.division.lanes, n))
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


class Increment:
    """Decodes one unit (s, r) of a frame of profile 1: step 5 of 7.13.3.

    Afterwards: `home`, `new` (its new Gaussians), `cells` (of unit 0 of a P or B frame), `models` after the
    unit, `header` (the fixed part), `coded` (planes, models and blocks of each section).
    """

    def __init__(self, unit, frame, context):
        self.frame, self.context = frame, context
        self.s, self.r = unit.spatial_layer, unit.refinement
        self.unit = unit
        self.cells = frame.cells

    def decode(self, reader, level, models_in_force):
        parents = self.frame.parents_before_displacement(self.s, self.r)
        self.header = parse_increment(reader, self.unit, self.frame, self.context, level, len(parents))
        sections = [Section(division, self.header, self.context) for division in self.header.sections]
        self.models = dict(models_in_force)
        for section in sections:
            self.models[section.name] = section.parse_models(models_in_force.get(section.name))
        for section in sections:
            section.parse_blocks()
        self.coded = [(section.planes, section.models, section.blocks) for section in sections]
        self.check_values({section.name: section for section in sections}, parents, MAX_LEARNED[level])
        return self

    def check_values(self, sections, parents, most_learned):
        """8.7 step 3 and 4, with the reconstruction of 7.14 to 7.17."""
        u, seq, frame = self.header, self.context.seq, self.frame
        if not frame.intra and self.r == 0:
            self.cells = decode_cells(u, sections.get("cells"), seq)
        if not frame.intra:
            parents = [self.cells.displaced(g) for g in parents]
        modes = []
        if "modes" in sections:
            modes = sections["modes"].values("mode")[0]
            check_modes(modes, u, frame.intra, sections["modes"].at())
        if "moves" in sections:
            parents = moved(parents, modes, sections["moves"].values("move"), u.position_shift, seq,
                            sections["moves"].at())
        if "updates" in sections:
            section = sections["updates"]
            parents = self.updated(parents, modes, lambda attribute, p: section.values(attribute), section.at())
        predictors = []
        if "predictors" in sections:
            prediction.check_predictors(sections["predictors"], self.context.network)
            predictors = sections["predictors"].values("predictor")[0]
            self.check_learned(predictors, parents, most_learned, sections["predictors"].at())
        self.new = []
        if "new" in sections:
            section = sections["new"]
            positions = self.positions(section)
            self.new = self.new_gaussians(positions, predictors, parents,
                                          lambda attribute, p: section.values(attribute), section.at())
        self.home = survivors(parents, modes) + self.new
        self.check_sizes()

    def updated(self, parents, modes, take, at):
        """SS-PA-004: the parents after their updates."""
        places = [i for i, mode in enumerate(modes) if mode in (UPDATE, MOVE_AND_UPDATE)]

        def predict(attribute, j, _):
            parent = parents[places[j]]
            return {"log_scale": parent.q, "opacity": parent.o, "rotation": parent.rotation_fine,
                    "dc": parent.dc, "sh": parent.sh}[attribute]

        result = list(parents)
        values = Residuals(len(places), predict, take, self.header, self.context, at).run()
        for i, v in zip(places, values):
            result[i] = parents[i]._replace(q=v.q, o=v.o, rotation_fine=v.rotation_fine, dc=v.dc, sh=v.sh)
        return result

    def positions(self, section):
        """7.16.4: canonical positions of new Gaussians."""
        shift = self.header.position_shift
        bits = self.context.seq.position_bits - shift
        middle = (1 << shift) >> 1
        result = []
        for i, delta in enumerate(section.values("position")[0]):
            code = delta if section.starts_block(i) else code + delta
            require(code < 2 ** (3 * bits), "CONSTRAINT", "7.3", section.at(i))
            result.append(tuple((x << shift) + middle for x in coordinates(code, bits)))
        return result

    def references(self, parents):
        """7.17.1; `parents` are those after moves and updates."""
        return [prediction.reference(g) for g in self.frame.reference_set(self.s, self.r, self.cells, parents)]

    def check_learned(self, predictors, parents, most, at):
        """SS-PR-008"""
        if prediction.TRANSFORMER in predictors:
            kinds = prediction.predictor_of_entries(self.header.new_count, self.header, predictors,
                                                    self.references(parents))
            require(kinds.count(prediction.TRANSFORMER) <= most, "OVER_LIMIT", "7.17", at)

    def new_gaussians(self, positions, predictors, parents, take, at):
        """7.16 and 7.17"""
        references = self.references(parents)
        kinds = prediction.predictor_of_entries(len(positions), self.header, predictors, references)
        predict = prediction.NewPredictions(positions, kinds, references, self.header, self.context)
        values = Residuals(len(positions), predict, take, self.header, self.context, at).run()
        anchor = 1 if self.frame.intra else 0
        return [Gaussian(tuple(x << 6 for x in position), v.q, v.o, v.rotation_fine, tuple(v.dc), tuple(v.sh), anchor)
                for position, v in zip(positions, values)]

    def check_sizes(self):
        """SS-PA-006"""
        seq, frame = self.context.seq, self.frame
        n_total = frame.header.gaussian_count
        total = sum(len(frame.homes[(self.s, h)]) for h in range(self.r)) + len(self.home)
        good = total <= n_total
        if frame.intra and self.s == seq.top:
            share = prefix_count(seq, n_total, self.r) - prefix_count(seq, n_total, self.r - 1)
            good = good and len(self.home) == share
        if not frame.intra and self.r == seq.refinement_count - 1:
            good = good and total == n_total
        require(good, "MISMATCH", "7.14", self.header.at("new_count"))
