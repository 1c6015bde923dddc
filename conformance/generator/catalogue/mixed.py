"""Valid vectors in which everything is drawn at random: tools meet that no directed vector puts together."""

from ..synth.mixed import mixed_stream
from ..vector import Vector

GROUPS = (("intra", {"profile": 0, "most": 150}, (2, 7, 20, 44, 45, 53, 62, 77)), ("mixed", {}, (4, 6, 28, 31, 39, 60)),
          ("deep", {"most": 12, "deep": True}, (9, 22)), ("blocks", {"most": 220}, (32,)))
PURPOSES = {"intra": "Every tool of profile 0 in random use, seed %d",
            "mixed": "Every tool of profile 1 in random use, seed %d",
            "deep": "One GOP of temporal depth 2 or 3 with every tool in random use, seed %d",
            "blocks": "Sections of several blocks with every tool of profile 1 in random use, seed %d"}
REQUIRED = "SS-BS-001 SS-EC-003 SS-IN-011 SS-IN-012 SS-PM-001 SS-DG-004"
OF_DYNAMIC = " SS-BS-009 SS-BS-004 SS-DG-005"


def rows():
    for group, options, seeds in GROUPS:
        for seed in seeds:
            required = REQUIRED + OF_DYNAMIC * (group != "intra")
            yield Vector("valid", "stability", "stability-%s-random-%d" % (group, seed), PURPOSES[group] % seed, required,
                         lambda seed=seed, options=options: mixed_stream(seed, **options), "mixed", seed)
