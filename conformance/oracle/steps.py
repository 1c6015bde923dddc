"""Clause 7.6.6: steps of attributes, which follow from sizes, opacities and anisotropies."""

from .constants import MAX_ATTRIBUTE_STEP
from .conventions import Round, clamp
from .tables import STEP

ATTRIBUTES = ("log_scale", "opacity", "rotation", "dc", "sh")
LOG_SCALE, OPACITY, ROTATION, DC, SH = range(5)


class StepRule:
    """The rule of a sequence with the `attribute_step` of a unit."""

    def __init__(self, seq, attribute_step):
        self.seq, self.attribute_step = seq, attribute_step

    def first(self):
        """The factor of v_log_scale[0]."""
        return STEP[self.attribute_step[LOG_SCALE]]

    def exponent(self, attribute, q, o=None):
        """SS-AT-004; of log_scale only q[0] is used, and o only of rotation and what follows."""
        seq = self.seq
        size = 2 * q[0] if attribute == LOG_SCALE else sum(q) - min(q)
        total = seq.size_weight[attribute] * (seq.size_reference - size)
        if attribute >= ROTATION:
            total += seq.opacity_weight[attribute - ROTATION] * max(0, seq.opacity_reference - o)
        if attribute == ROTATION:
            total += seq.anisotropy_weight * max(0, seq.anisotropy_reference - (max(q) - min(q)))
        return clamp(self.attribute_step[attribute] + Round(total, 14), 0, MAX_ATTRIBUTE_STEP)

    def factor(self, attribute, q, o=None):
        return STEP[self.exponent(attribute, q, o)]
