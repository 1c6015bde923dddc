"""Valid vectors of streams, units and refinements of profile 0."""

import oracle_path  # noqa: F401
import constants as c
from intra_writer import IntraStream
from vector import Vector


def one_frame(total=9, values=None, plans=None, seed=1, codes=None, tamper=None, level=1, sh=None, lanes_log2=0,
              **asked):
    """A stream of one frame with one refinement; sh: None or the arguments of its sh transform."""
    s = IntraStream(seed, level, tamper=tamper, **asked)
    s.gop()
    s.transform()
    if sh is not None:
        s.transform(kind=1, **sh)
    s.frame(total, sh=c.NONE_ID if sh is None else 0)
    s.refinement(values, plans, codes, lanes_log2, sh_mode=0 if sh is None else 1)
    return s.close()


def frames(sizes, gops=None, refinements=None, index=True, listed=True, seed=1, **asked):
    """Frames of the given sizes; gops: frames of each GOP; refinements: units of each frame."""
    s = IntraStream(seed, **asked)
    rest = list(zip(sizes, refinements or [s.seq.refinement_count] * len(sizes)))
    for count in gops or [len(sizes)]:
        s.gop(count)
        s.transform()
        for size, units in rest[:count]:
            s.frame(size)
            for _ in range(units):
                s.refinement()
        rest = rest[count:]
    if listed:
        s.operating_points()
    if index:
        s.index()
    return s.close()


def without_frames():
    return IntraStream().close()


def only_lists():
    """operating_points and index without entries that have frames."""
    s = IntraStream()
    s.operating_points()
    s.index()
    return s.close()


def points_none():
    s = IntraStream()
    s.put(c.UT_POINTS, bytes(4))
    return s.close()


def skipped_everywhere():
    s = IntraStream()
    s.out = s.out[:16]                              # before sequence_parameters as well
    s.units = 0
    kinds = [9, 10, 12, 127, 128, 255]

    def skip(**header):
        s.skipped(kinds[s.units % 6], b"private"[:s.units % 8], **header)

    skip()
    s.put(c.UT_SEQUENCE, s.parameters)
    skip(frame=77, spatial=200, temporal=9, refinement=255)
    s.gop()
    skip(frame=2 ** 32 - 1)
    s.transform()
    skip()
    s.frame(4)
    skip(refinement=1)
    s.refinement()
    skip()
    s.operating_points()
    skip()
    s.index()
    skip()
    return s.close()


def skipped_with_wrong_check_sum():
    s = IntraStream()
    s.skipped(200, b"a payload that nobody reads")
    s.out[-1] ^= 1
    s.gop()
    s.transform()
    s.frame(3)
    s.refinement()
    return s.close()


def critical_bits_off():
    s = IntraStream()
    s.out[16:] = b""
    s.put(c.UT_SEQUENCE, s.parameters, flags=0)
    s.units = 1
    s.gop()
    s.transform()
    s.frame(3)
    s.refinement()
    s.index_offset = 0
    entries_at = len(s.out)
    s.index()
    s.out[entries_at:] = b""
    s.units -= 1
    s.put(c.UT_INDEX, b"\x01\x00\x00\x00" + s.gops[0][0].to_bytes(8, "little") + s.gops[0][1].to_bytes(8, "little"),
          flags=1)
    return s.close()


def parameters_repeated():
    s = IntraStream(percent=[40, 100])
    again = lambda: s.put(c.UT_SEQUENCE, s.parameters)
    again()
    s.gop(2)
    again()
    s.transform()
    for _ in range(2):
        s.frame(5)
        again()
        s.refinement()
        again()
        s.refinement()
        again()
    s.operating_points()
    again()
    s.index()
    again()
    return s.close()


def transforms_of_all_identifiers():
    s = IntraStream(sh_degree=1)
    s.gop(2)
    for identifier in range(16):
        s.transform(0, identifier, mean=[identifier, 0, -identifier])
        s.transform(1, 15 - identifier, mean=[identifier])
    for identifier in (0, 15):
        s.frame(5, identifier, identifier)
        s.refinement(sh_mode=1)
    return s.close()


def definitions_anew():
    """Each GOP defines the same identifiers with other values."""
    s = IntraStream()
    for mean in (100, -5000):
        s.gop(1)
        s.transform(mean=[mean])
        s.frame(4)
        s.refinement()
    return s.close()


MOST = {"position_offset": [2.0 ** 40] * 3, "position_step": 2.0 ** 20, "log_scale_offset": 2.0 ** 40,
        "log_scale_step": 2.0 ** 20,
        "rotation_step": 1.0, "opacity_offset": 2.0 ** 40, "opacity_step": 2.0 ** 20, "dc_step": 2.0 ** 20,
        "sh_step": 2.0 ** 20,
        "ticks_per_second": 2 ** 32 - 1, "ticks_per_frame": 2 ** 32 - 1}
LEAST = {"position_offset": [-2.0 ** 40] * 3, "position_step": 2.0 ** -40, "log_scale_offset": -2.0 ** 40,
         "log_scale_step": 2.0 ** -40, "rotation_step": 2.0 ** -40, "opacity_offset": -2.0 ** 40,
         "opacity_step": 2.0 ** -40,
         "dc_step": 2.0 ** -40, "sh_step": 2.0 ** -40, "ticks_per_second": 1, "ticks_per_frame": 0}
TENTHS = list(range(10, 101, 10))

STREAM = [
    ("stream-without-frames", "SS-BS-001 SS-BS-007 SS-EN-001 SS-EN-002 SS-FH-001 SS-FH-002 SS-UH-001",
     "file_header, sequence_parameters and end: the shortest stream", without_frames),
    ("stream-lists-without-frames", "SS-IX-001 SS-PL-002", "operating_points and index in a stream without GOPs",
     only_lists),
    ("stream-points-none", "SS-PL-001", "An operating_points unit without entries", points_none),
    ("stream-one-frame",
     "SS-BS-001 SS-BS-002 SS-BS-003 SS-GH-001 SS-GH-002 SS-GH-003 SS-FR-001 SS-FR-002 SS-TF-001 SS-TF-002 "
     "SS-UH-002 SS-UH-003 SS-UH-006 SS-FH-003",
     "One frame in one GOP", one_frame),
    ("stream-one-gaussian", "SS-RU-001", "A frame with a single Gaussian", lambda: one_frame(1)),
    ("stream-empty-frame", "SS-RU-001 SS-RU-002 SS-DG-003",
     "A frame without Gaussians: its units have neither models nor blocks",
     lambda: frames([0], percent=[50, 100])),
    ("stream-minor-version", "SS-FH-004", "version_minor is 255", lambda: IntraStream(minor=255).close()),
    ("stream-skipped-units", "SS-UH-004 SS-UH-005 SS-BS-001",
     "Units of unknown types, 9 and 10 of profile 0 among them, between all others with any values in their headers",
     skipped_everywhere),
    ("stream-skipped-check-sum", "SS-UH-004", "payload_crc of a skipped unit is wrong and not looked at",
     skipped_with_wrong_check_sum),
    ("stream-critical-bits", "SS-UH-005",
     "The critical bit of known units is not that of the table, which a decoder does not examine",
     critical_bits_off),
    ("stream-parameters-repeated", "SS-SP-004", "Copies of sequence_parameters in every phase", parameters_repeated),
    ("stream-several-gops", "SS-GH-001 SS-IX-001 SS-IX-002 SS-BS-008",
     "Three GOPs of one to three frames with an index",
     lambda: frames([5, 0, 9, 1, 4, 4], [1, 3, 2])),
    ("stream-without-index", "SS-EN-001", "No index and no operating_points: index_offset is 0",
     lambda: frames([5, 4], index=False, listed=False)),
    ("stream-index-alone", "SS-IX-001", "An index without an operating_points unit",
     lambda: frames([5, 4], listed=False)),
    ("stream-frame-count-known", "SS-SP-005", "frame_count of sequence_parameters is stated",
     lambda: frames([3, 3, 3], [2, 1], frame_count=3)),
    ("stream-definitions-anew", "SS-GH-004 SS-TF-003",
     "The second GOP defines the transform of the first one again, otherwise", definitions_anew),
    ("stream-all-transforms", "SS-TF-002 SS-TF-003 SS-FR-002", "All sixteen identifiers of both kinds of transforms",
     transforms_of_all_identifiers),
    ("stream-steps-most", "SS-SP-003 SS-SP-006 SS-OUT-001", "All f32 elements and ticks are as large as they may be",
     lambda: one_frame(sh={}, sh_degree=1, **MOST)),
    ("stream-steps-least", "SS-SP-003 SS-SP-006 SS-OUT-001", "All f32 elements and ticks are as small as they may be",
     lambda: one_frame(sh={}, sh_degree=1, **LEAST)),
    ("stream-negative-zero", "SS-SP-003 SS-OUT-001", "Offsets are negative zeros",
     lambda: one_frame(position_offset=[-0.0] * 3, log_scale_offset=-0.0, opacity_offset=-0.0)),
    ("stream-level-2", "SS-LM-001 SS-LM-002 SS-LM-003", "A stream of level 2", lambda: one_frame(level=2)),
    ("stream-level-3", "SS-LM-001 SS-LM-002 SS-LM-003", "A stream of level 3", lambda: one_frame(level=3)),
    ("stream-level-4", "SS-LM-001 SS-LM-002 SS-LM-003", "A stream of level 4", lambda: one_frame(level=4)),
    ("stream-antialiased", "SS-SP-001", "The flag antialiased changes nothing", lambda: one_frame(sequence_flags=2)),
]
REFINEMENT = [
    ("refinement-six", "SS-SP-001 SS-RU-006", "Six refinements",
     lambda: frames([17], percent=[5, 10, 30, 60, 99, 100])),
    ("refinement-ten", "SS-SP-001 SS-RU-006 SS-OP-001 SS-OP-003 SS-OP-005", "Ten refinements in equal steps",
     lambda: frames([40], percent=TENTHS)),
    ("refinement-percent-least", "SS-SP-001 SS-RU-006", "Percentages 1 to 9 and 100: small units and a large last one",
     lambda: frames([60], percent=[1, 2, 3, 4, 5, 6, 7, 8, 9, 100])),
    ("refinement-ceiling", "SS-RU-001 SS-RU-006", "101 Gaussians and 10, 20, 30, 50, 100 percent: the example of 7.2",
     lambda: frames([101], percent=[10, 20, 30, 50, 100])),
    ("refinement-units-without-gaussians", "SS-RU-002 SS-RU-006",
     "One Gaussian in ten refinements: nine units are empty",
     lambda: frames([1, 2], percent=TENTHS)),
    ("refinement-frames-stop-early", "SS-BS-004 SS-OP-001 SS-OP-002",
     "Frames end at different refinements, which is no error",
     lambda: frames([10, 10, 10, 10], refinements=[1, 4, 2, 3], percent=[20, 40, 60, 100])),
    ("refinement-gaussian-count-changes", "SS-RU-001",
     "The number of Gaussians changes a hundredfold from frame to frame",
     lambda: frames([3, 300, 3, 0, 200], percent=[50, 100])),
]


def rows():
    for area, table in (("stream", STREAM), ("refinement", REFINEMENT)):
        for name, requirements, purpose, build in table:
            yield Vector("valid", area, name, purpose, requirements, build, "intra", 1)
