"""Valid vectors of the learned predictor: the rows of synth_learned.py."""

from ..synth.learned import REGISTERED, VALID, learned_stream, predicted_by_network
from ..vector import Vector, seed_of

LARGEST = 30000
REQUIRED = "SS-UH-006 SS-TR-001 SS-TR-002 SS-TR-003 SS-TR-004 SS-TR-005 SS-TR-008 SS-TR-009 SS-TR-010 SS-WT-003 SS-WT-004"


def usual(seed, asked):
    """The first stream from a seed on in which the network predicts enough Gaussians, and not too many."""
    for attempt in range(seed, seed + 100):
        data, synth = learned_stream(attempt, asked)
        if len(data) < LARGEST and synth.asked["least"] <= predicted_by_network(synth) <= 200:
            return data
    raise ValueError("no seed from %d on is good" % seed)


def rows():
    for name, asked, purpose, requirements in VALID + REGISTERED:
        seed = seed_of(name)
        yield Vector("valid", "learned", "learned-" + name, purpose, REQUIRED + " " + requirements,
                     lambda seed=seed, asked=asked: usual(seed, asked), "learned", seed)
