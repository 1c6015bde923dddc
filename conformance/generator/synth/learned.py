"""Streams with learned prediction: the rows of VALID, made by LearnedSynth."""

from oracle.constants import UT_WEIGHTS
from oracle.conventions import ceil_div
from oracle.network import REGISTRY
from oracle.prediction import TRANSFORMER
from .cells import morton
from .increment import IncrementWriter
from .mixed import MixedSynth
from .network import NetworkWriter

GOPS = [(0, 0, 1), (1, 1, 3)]                       # an I frame; I, B, P

# What a row may ask for beside elements of its network, and what holds otherwise
USUAL = {
    "gops": GOPS, "degree": 1, "bits": 10, "percent": [30, 100], "spatial": 1, "most": 16, "block_log2": 6,
    "neighbours": None,                             # neighbour_count; None: random
    "mix": (0, 0, 0, 1),                            # weights of v_predictor 0 to 3
    "same_position": False,                            # all new Gaussians at one position
    "bilateral": None,                              # both weights of the bilateral predictor
    "sh_transforms": True, "ranks": None,           # of dc and sh transforms
    "without": (),                                  # GOPs without a weights unit
    "source": 0,
    "complete": False,                              # whether every frame has all its units
    "feature_shift": 0,
    "least": 12, "above": 0,
    # Gaussians predicted by the network in spatial layers from `above` on
}


class LearnedWriter(IncrementWriter):
    """An IncrementWriter with predictor 3; `asked` is set by its stream."""

    def choose_predictors(self):
        super().choose_predictors()
        u, asked = self.u, self.asked
        if u.new_count == 0:
            return
        u.predictor_block_log2 = self.rng.choice([0, 0, 1, 2] + [16] * (asked["mix"] == USUAL["mix"]))
        u.neighbour_count = asked["neighbours"] or u.neighbour_count
        if asked["bilateral"] is not None:
            u.bilateral_spatial, u.bilateral_feature = asked["bilateral"]
        elif self.rng.random() < 0.7:               # so that several neighbours have a weight
            u.bilateral_spatial, u.bilateral_feature = self.rng.choice([(8, 0), (20, 1), (40, 0)])

    def predictors(self):
        u, mix = self.u, self.asked["mix"]
        if u.new_count == 0:
            return super().predictors()
        count = ceil_div(u.new_count, 2 ** u.predictor_block_log2)
        if self.context.network is None:
            mix = mix[:3] if any(mix[:3]) else (1, 1, 1)
        values = self.rng.choices(range(len(mix)), mix, k=count)
        self.v["predictors"] = [values]
        return values

    def positions(self, parents):
        self.predicts = bool(self.frame.reference_set(self.s, self.r, parents))
        if not self.asked["same_position"]:
            return super().positions(parents)
        bits = self.seq.position_bits - self.u.position_shift
        return self.in_blocks([morton([2 ** bits // 3] * 3, bits)] * self.u.new_count)


class LearnedSynth(MixedSynth):
    """A stream with weights units, as asked by a row of VALID."""

    def __init__(self, seed, asked, tamper=None):
        self.asked, self.writers = {**USUAL, **asked}, []
        super().__init__(seed, tamper, self.asked["most"], level=1)
        self.writer_class = type("AskedWriter", (LearnedWriter,), {"asked": self.asked})

    def plan_gops(self):
        self.gops = self.asked["gops"]
        self.temporal_layers = 1 + max(depth for _, depth, _ in self.gops)

    def chosen_sequence(self):
        asked = self.asked
        return {**super().chosen_sequence(), "sh_degree": asked["degree"], "spatial_layer_count": asked["spatial"],
                "percent": asked["percent"], **self.chosen_grid(asked["bits"]), "block_log2": asked["block_log2"],
                "feature_shift": asked["feature_shift"]}

    def transform_count(self, kind, dimension):
        if kind == 1 and not self.asked["sh_transforms"]:
            return 0
        return super().transform_count(kind, dimension)

    def rank(self, kind, dimension):
        if self.asked["ranks"] is None:
            return super().rank(kind, dimension)
        return min(dimension, self.asked["ranks"][kind])

    def definitions(self):
        first = self.rng.random() < 0.3
        if first:
            self.weights()
        super().definitions()
        if not first:
            self.weights()

    def layer_plan(self, number):
        whole = [self.seq.refinement_count] * self.seq.spatial_layer_count
        return whole if self.asked["complete"] else super().layer_plan(number)

    def unit_count(self, number):
        return self.seq.refinement_count if self.asked["complete"] else super().unit_count(number)

    def weights(self):
        if self.state.next_gop - 1 in self.asked["without"]:
            return
        if self.asked["source"] == 1:
            payload = b"\x01" + sorted(REGISTRY)[0]
        else:
            payload = b"\x00" + NetworkWriter(self.rng, self.asked).bytes()
        self.put(UT_WEIGHTS, payload, frame=self.first)

    def written(self, writer):
        self.writers.append(writer)


def predicted_by_network(synth):
    """New Gaussians with predictor 3 and a reference set, in the spatial layers that are asked for."""
    count = 0
    for writer in synth.writers:
        if writer.u.new_count and writer.predicts and writer.s >= synth.asked["above"]:
            log2 = writer.u.predictor_block_log2
            count += sum(writer.v["predictors"][0][i >> log2] == TRANSFORMER for i in range(writer.u.new_count))
    return count


def flags(value, width_log2, **more):
    return {"network_flags": value, "width_log2": width_log2, **more}


SMALL = {"network_flags": 0, "width_log2": 3, "feed_forward_width": 0, "geometry_width": 0, "fourier_count": 0,
         "rank_count": 1, "dc_count": 1, "sh_count": 0}
WIDE = {"width_log2": 6, "geometry_width": 0, "rank_count": 1, "most": 10, "gops": [(1, 0, 2)]}
LARGE = {"geometry_width": 32, "fourier_count": 4, "rank_count": 16, "dc_count": 3, "sh_count": 16, "degree": 3,
         "ranks": (3, 16), "most": 10}
DENSE = {"percent": [50, 100], "neighbours": 16, "most": 24}

# Name, what is asked for, purpose and requirements
VALID = [
    ("flags-0", flags(0, 3),
     "No flag of the network is set: one row, no gate, no normalisation",
     "SS-TR-004"),
    ("flags-1", flags(1, 4),
     "full_attention alone",
     "SS-TR-004"),
    ("flags-2", flags(2, 5),
     "gated alone",
     "SS-TR-001"),
    ("flags-3", flags(3, 3, token_shift=3, output_shift=3),
     "full_attention and gated",
     "SS-TR-001 SS-TR-004"),
    ("flags-4", flags(4, 4),
     "normalised alone",
     "SS-TR-006"),
    ("flags-5", flags(5, 5, token_shift=5),
     "full_attention and normalised",
     "SS-TR-004 SS-TR-006"),
    ("flags-6", flags(6, 3, token_shift=6),
     "gated and normalised",
     "SS-TR-001 SS-TR-006"),
    ("flags-7", flags(7, 4, token_shift=7),
     "All flags of the network but knn_base are set",
     "SS-TR-001 SS-TR-004 SS-TR-006"),
    ("flags-8", flags(8, 4),
     "knn_base alone: log-scale, opacity, rotation and the base are those of the knn predictor",
     "SS-TR-001"),
    ("flags-10", flags(10, 3),
     "knn_base and gated: affinities do not come from the weights of the base",
     "SS-TR-001"),
    ("flags-15", flags(15, 5, token_shift=2),
     "All flags of the network are set",
     "SS-TR-001 SS-TR-004 SS-TR-006"),
    ("base-alone", {"fill": "zero", "network_flags": 8, **DENSE},
     "A network of zeros on a knn base: what it predicts is the knn prediction",
     "SS-TR-001 SS-TR-008"),
    ("width-64", {**WIDE, "network_flags": 5, "feed_forward_width": 16, "fourier_count": 2},
     "The largest width of an embedding",
     "SS-WT-003"),
    ("width-64-128", {**WIDE, "network_flags": 2, "feed_forward_width": 128},
     "The largest width and the largest feed-forward block",
     "SS-TR-007"),
    ("least-counts", SMALL,
     "The smallest network: every part that may be absent is absent",
     "SS-WT-004"),
    ("most-counts", {**LARGE, "network_flags": 7, "width_log2": 4, "feed_forward_width": 128},
     "Every part of the network is as large as it may be, but for its width",
     "SS-TR-007 SS-WT-004"),
    ("most-neighbours", {**LARGE, **DENSE, "network_flags": 1, "width_log2": 3},
     "Sixteen neighbours and sixteen rows of rank_embedding",
     "SS-TR-003 SS-PR-005"),
    ("sh-alone", {"dc_count": 0, "sh_count": 5, "degree": 2, "ranks": (3, 5)},
     "Only sh components are predicted: dc_count is 0",
     "SS-TR-008"),
    ("dc-alone", {"dc_count": 3, "sh_count": 0},
     "Only dc components are predicted: sh_count is 0",
     "SS-TR-008"),
    ("rank-below-counts", {"dc_count": 3, "sh_count": 12, "ranks": (1, 2), "degree": 2},
     "The ranks of the transforms are below dc_count and sh_count: outputs without a component are not used",
     "SS-TR-008"),
    ("no-sh-transform", {"dc_count": 2, "sh_count": 4, "sh_transforms": False},
     "sh_transform_id is 255 while the network has sh outputs: its rank counts as 0",
     "SS-TR-001 SS-TR-008"),
    ("degree-0", {"dc_count": 3, "sh_count": 3, "degree": 0},
     "sh_degree is 0 while the network has sh outputs",
     "SS-TR-008"),
    ("weights-most", {"fill": "most", "network_flags": 0},
     "All weights and biases are as large as they can be: every layer saturates upwards",
     "SS-TR-009"),
    ("weights-least", {"fill": "least", "network_flags": 5},
     "All weights and biases are as small as they can be: every layer saturates downwards",
     "SS-TR-009"),
    ("weights-corners", {"fill": "checked", "network_flags": 7, "feed_forward_width": 128, "output_shift": 4},
     "Weights are the largest or smallest in random order: sums reach the widths of 7.12",
     "SS-TR-009"),
    ("biases-corners", {"fill": "corner_biases", "network_flags": 6, "feed_forward_width": 9, "geometry_width": 5},
     "Biases are the largest or smallest, weights usual",
     "SS-TR-003"),
    ("weights-zero", {"fill": "zero", "network_flags": 7, "feed_forward_width": 3},
     "All weights are 0: the base alone is the prediction",
     "SS-TR-005 SS-TR-006"),
    ("softmax-flat", {**DENSE, "fill": "flat", "network_flags": 4},
     "All attention logits are equal: every neighbour has the same share",
     "SS-TR-005"),
    ("softmax-peaked", {**DENSE, "fill": "peaked", "network_flags": 1, "fourier_count": 4},
     "One attention logit is far above the others: one neighbour has the whole share",
     "SS-TR-005"),
    ("head-zero", {"fill": "bare", "network_flags": 3},
     "The head has no weights: outputs are its biases",
     "SS-TR-008"),
    ("shifts-most", {"token_shift": 8, "output_shift": 4, "layer_shift": [15] * 8},
     "token_shift, output_shift and layer_shift are as large as they may be",
     "SS-WT-003"),
    ("one-neighbour", {"neighbours": 1, "network_flags": 7, "fourier_count": 3},
     "A single neighbour: near is at its ends and attention has nothing to choose",
     "SS-TR-002 SS-TR-005"),
    ("same-position", {"same_position": True, "network_flags": 3, "fourier_count": 4, "geometry_width": 6},
     "All new Gaussians at one position: distances and reach are 0",
     "SS-TR-002"),
    ("grid-of-8", {"bits": 1, "network_flags": 1, "fourier_count": 4, "geometry_width": 6, **DENSE},
     "A grid of eight points: ties of distances everywhere",
     "SS-TR-002 SS-PR-005"),
    ("few-references", {"percent": [5, 100], "neighbours": 16, "rank_count": 16, "network_flags": 2},
     "Fewer references than neighbour_count and than rows of rank_embedding",
     "SS-TR-003"),
    ("grid-large", {"bits": 20, "network_flags": 2, "fourier_count": 4, "geometry_width": 32},
     "A grid of 20 bits: distances at the width of 7.12",
     "SS-TR-002"),
    ("gate-shut", {"bilateral": (255, 255), "network_flags": 3},
     "Weights of the bilateral predictor near 0 gate the tokens",
     "SS-TR-001"),
    ("gate-open", {"bilateral": (0, 0), "network_flags": 2},
     "Weights of the bilateral predictor are all largest: the gate does nothing",
     "SS-TR-001"),
    ("feature-shift-1", {"feature_shift": 1, "network_flags": 2, "dc_count": 3, "sh_count": 3},
     "feature_shift 1 halves the differences of tokens",
     "SS-TR-001 SS-PR-007"),
    ("feature-shift-3", {"feature_shift": 3, "network_flags": 10, "token_shift": 1, "dc_count": 2, "sh_count": 4},
     "feature_shift 3 beside token_shift 1",
     "SS-TR-001 SS-PR-007"),
    ("feature-shift-7", {"feature_shift": 7, "token_shift": 8, "network_flags": 1},
     "feature_shift and token_shift are as large as they may be",
     "SS-TR-001 SS-PR-007"),
    ("layers", {"spatial": 3, "gops": [(0, 0, 2), (1, 0, 2)], "percent": [40, 100], "network_flags": 0, "most": 40,
                "above": 1, "least": 40},
     "The network predicts in units of higher spatial layers",
     "SS-PR-001"),
    ("frames", {"gops": [(1, 2, 8)], "percent": [25, 50, 100], "most": 20, "network_flags": 5},
     "P and B frames of three temporal layers above the base use one network",
     "SS-PR-001"),
    ("predictors-mixed", {"mix": (1, 1, 1, 2), "most": 40, "percent": [20, 50, 100], "least": 40, "gops": [(1, 2, 7)]},
     "All four predictors in one unit",
     "SS-PR-002"),
    ("blocks", {"most": 150, "percent": [50, 100], "width_log2": 3, "network_flags": 0, "gops": [(1, 0, 2)],
                "mix": (1, 1, 1, 3), "least": 60},
     "Sections of several blocks and predictor blocks that cross them",
     "SS-PR-002"),
    ("unused", {"mix": (1, 1, 1, 0), "network_flags": 2, "least": 0},
     "A weights unit that no frame uses",
     "SS-WT-002"),
    ("second-gop-without", {"gops": [(1, 1, 3), (1, 0, 2), (0, 0, 1)], "without": (1,), "network_flags": 6},
     "The second of three GOPs has no network; its frames use other predictors",
     "SS-WT-002"),
]
REGISTERED = [
    ("registered", {"source": 1},
     "The registered network by its digest",
     "SS-WT-001"),
    ("registered-layers", {"source": 1, "spatial": 2, "degree": 3},
     "The registered network in two spatial layers with sh of degree 3",
     "SS-WT-001"),
]


def learned_stream(seed, asked):
    """(a stream that the decoder accepts, the synth)"""
    synth = LearnedSynth(seed, asked)
    return synth.stream(), synth
