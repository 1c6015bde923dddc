"""Valid vectors in which everything is drawn at random: tools meet that no directed vector puts together."""

from synth import Synth
from synth_dynamic import valid_stream
from vector import Vector

INTRA = (2, 7, 20, 44, 45, 53, 62, 77)
DYNAMIC = (("mixed", {}, (4, 6, 28, 31, 39, 60)), ("deep", {"most": 12, "deep": True}, (9, 22)),
           ("blocks", {"most": 220}, (32,)))
PURPOSES = {"mixed": "Every tool of profile 1 in random use, seed %d",
            "deep": "One GOP of temporal depth 2 or 3 with every tool in random use, seed %d",
            "blocks": "Sections of several blocks with every tool of profile 1 in random use, seed %d"}
REQUIRED_INTRA = "SS-BS-001 SS-RU-001 SS-RU-005 SS-EC-003 SS-DG-003"
REQUIRED_DYNAMIC = "SS-BS-009 SS-BS-012 SS-IN-007 SS-IN-008 SS-EC-008 SS-PM-010 SS-DG-005 SS-DG-006"


def rows():
    for seed in INTRA:
        yield Vector("valid", "stability", "stability-intra-random-%d" % seed,
                     "Every tool of profile 0 in random use, seed %d" % seed, REQUIRED_INTRA,
                     lambda seed=seed: Synth(seed).stream(), "mixed", seed)
    for group, options, seeds in DYNAMIC:
        for seed in seeds:
            yield Vector("valid", "stability", "stability-%s-random-%d" % (group, seed), PURPOSES[group] % seed,
                         REQUIRED_DYNAMIC, lambda seed=seed, options=options: valid_stream(seed, **options), "mixed",
                         seed)
