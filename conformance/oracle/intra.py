"""Frames of profile 0: clauses 7.1.3 step 5 and 7.2 to 7.9 for a refinement unit."""

import models as plane_models
import reconstruction
import semantics
from errors import require
from parsing import BlockDecoder


class Frame:
    """A frame in progress or output: canonical planes and unit digests of its refinements."""

    def __init__(self, number, header, plane_count):
        self.number = number
        self.header = header
        self.planes = [[] for _ in range(plane_count)]
        self.digests = []                           # D[r]
        self.units_seen = 0                         # refinement units that stood, of whatever fate
        self.dropping = False
        self.models = None

    @property
    def refinements(self):
        return len(self.digests)

    @property
    def gaussians(self):
        return len(self.planes[0])

    def digest(self):
        return reconstruction.frame_digest(self.digests)

    def without_reference(self):
        return False

    def passes_over(self, r):
        """Step 2"""
        return self.dropping

    def append(self, planes, digests, models):
        """Step 6"""
        for whole, part in zip(self.planes, planes):
            whole.extend(part)
        self.digests.append(digests)
        if models is not None:
            self.models = models


def decode_refinement(reader, unit, frame, seq, dc_transform, sh_transform, codebooks):
    """Canonical planes, digests, models (None without Gaussians) and the coded section of a refinement unit."""
    header, r = frame.header, unit.refinement
    n_total = header.gaussian_count
    expected = (reconstruction.prefix_count(seq, n_total, r)
                - reconstruction.prefix_count(seq, n_total, r - 1))
    body = semantics.parse_refinement(reader, seq, header, expected, sh_transform, codebooks)
    planes = [[] for _ in frame.planes]
    by_identity, coded_sections = None, []
    if body.gaussian_count > 0:
        coded = plane_models.coded_planes(dc_transform.rank, body.sh_mode,
                                          sh_transform.rank if sh_transform else 0,
                                          body.vq_stage_count)
        models = plane_models.parse_models(body.models_section, coded, frame.models)
        by_identity = {p.identity(): m for p, m in zip(coded, models)}
        left, blocks = body.gaussian_count, []
        for section in body.block_sections:
            n = min(left, 2 ** seq.block_log2)
            left -= n
            block_at = section.pos
            blocks.append(BlockDecoder(section, coded, models, 2 ** body.lanes_log2, n))
            block = reconstruction.BlockValues(blocks[-1].decode(), coded, models, body, seq, dc_transform,
                                               sh_transform, codebooks, block_at)
            for whole, part in zip(planes, block.canonical()):
                whole.extend(part)
        coded_sections = [(coded, models, blocks)]
    digests = reconstruction.unit_digests(planes)
    digest = reconstruction.frame_digest(frame.digests + [digests])
    require(digest == body.refinement_digest, "DIGEST", "7.9", body.at("refinement_digest"))
    return planes, digests, by_identity, coded_sections
