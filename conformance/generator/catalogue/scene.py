"""Vectors of scene_description (6.9)."""

from oracle import constants as c
from ..faults import changed, copy_of, flipped, inserted, invalid, kind, repeated
from ..synth.given import GivenStream
from ..synth.scene import camera, scene
from ..vector import Vector
from .stream import short_stream

FULL = {"up_axis": 3, "colour_space": 1, "sorting": 1, "metres_per_unit": 0.5, "background": [0.25, 0.5, 1.0],
        "bounds": [-1.0, -2.0, -3.0, 1.0, 2.0, 3.0], "title": "Büste, 12 s".encode(),
        "cameras": [camera(), camera((1, 2, 3), (0.5, 0.5, 0.5, 0.5), 0.75)]}
FAR = 2.0 ** 40
VALID = [("scene-none-of-its-parts", "SS-SD-001", "A scene_description without optional parts", {}),
         ("scene-all-parts", "SS-SD-007 SS-SD-001 SS-SD-002 SS-SD-003 SS-SD-004 SS-SD-005 SS-SD-006",
          "A scene_description with every part", FULL)]
VALID += [("scene-only-" + name.replace("_", "-"), "SS-SD-001 SS-SD-003", "A scene_description with %s alone" % name,
           {name: FULL[name]}) for name in ("metres_per_unit", "background", "bounds", "title", "cameras")]
VALID += [("scene-axis-%d" % k, "SS-SD-002", "up_axis is %d" % k, {"up_axis": k}) for k in range(1, 7)]
VALID += [
    ("scene-most", "SS-SD-004 SS-SD-005 SS-SD-006", "64 cameras, a title of 1024 bytes, and values at the ends of their ranges",
     {"metres_per_unit": FAR, "background": [0.0, 1.0, -0.0], "bounds": [-FAR] * 3 + [FAR] * 3, "title": b"ab" * 512,
      "cameras": [camera((FAR, -FAR, 0), (FAR, 0, 0, 0), 3.1415925)] * 64}),
    ("scene-farthest", "SS-SD-004", "A box that is the farthest corner, and a camera with the least rotation",
     {"bounds": [FAR] * 6, "cameras": [camera(rotation=(-FAR, -0.0, FAR, 1.0))]}),
    ("scene-least", "SS-SD-004", "A box that is a point, the smallest positive numbers, a title of one byte",
     {"metres_per_unit": 2.0 ** -149, "bounds": [-FAR] * 6, "title": b"a",
      "cameras": [camera((0, 0, 0), (0, 0, 0, 0), 2.0 ** -149)]}),
]
PARENT = "scene-all-parts"
SCENE = kind(c.UT_SCENE)


def other(flags=None, **asked):
    """The scene of the parent with other elements."""
    return changed(SCENE, payload=scene(flags, **{**FULL, **asked}))


def altered(function):
    return changed(SCENE, payload=lambda u: function(u.payload))


INFINITY, NAN = float("inf"), float("nan")
FAULTS = [
    ("scene-up-axis-7", "RESERVED", "SS-SD-002", "up_axis is 7", other(up_axis=7)),
    ("scene-kernel-1", "RESERVED", "SS-SD-002", "kernel is 1", other(kernel=1)),
    ("scene-colour-space-2", "RESERVED", "SS-SD-002", "colour_space is 2", other(colour_space=2)),
    ("scene-projection-1", "RESERVED", "SS-SD-002", "projection is 1", other(projection=1)),
    ("scene-sorting-2", "RESERVED", "SS-SD-002", "sorting is 2", other(sorting=2)),
    ("scene-flags-32", "RESERVED_BITS", "SS-SD-003 SS-ER-002", "bit 5 of description_flags is set", other(flags=63)),
    ("scene-flags-128", "RESERVED_BITS", "SS-SD-003", "bit 7 of description_flags is set", other(flags=159)),
    ("scene-metres-0", "CONSTRAINT", "SS-SD-004", "metres_per_unit is 0", other(metres_per_unit=0.0)),
    ("scene-metres-negative", "CONSTRAINT", "SS-SD-004", "metres_per_unit is -1", other(metres_per_unit=-1.0)),
    ("scene-metres-infinite", "CONSTRAINT", "SS-SD-004", "metres_per_unit is infinite", other(metres_per_unit=INFINITY)),
    ("scene-metres-large", "CONSTRAINT", "SS-SD-004", "metres_per_unit is above 2^40", other(metres_per_unit=2.0 ** 41)),
    ("scene-background-above", "CONSTRAINT", "SS-SD-004", "a component of background is above 1",
     other(background=[0.0, 1.5, 0.0])),
    ("scene-background-nan", "CONSTRAINT", "SS-SD-004", "a component of background is not a number",
     other(background=[0.0, 0.0, NAN])),
    ("scene-bounds-crossed", "CONSTRAINT", "SS-SD-004", "bounds_min is above bounds_max on one axis",
     other(bounds=[0.0, 3.0, 0.0, 1.0, 2.0, 1.0])),
    ("scene-bounds-nan", "CONSTRAINT", "SS-SD-004", "a component of bounds_max is not a number",
     other(bounds=[0.0, 0.0, 0.0, 1.0, 2.0, NAN])),
    ("scene-title-empty", "OUT_OF_RANGE", "SS-SD-005", "title_length is 0", other(title=b"")),
    ("scene-title-long", "OUT_OF_RANGE", "SS-SD-005", "title_length is 1025", other(title=b"x" * 1025)),
    ("scene-title-not-text", "CONSTRAINT", "SS-SD-005", "the title is not valid UTF-8", other(title=b"B\xfcste")),
    ("scene-title-overlong", "CONSTRAINT", "SS-SD-005", "the title has an overlong form", other(title=b"a\xc0\xaf")),
    ("scene-title-surrogate", "CONSTRAINT", "SS-SD-005", "the title has a surrogate", other(title=b"a\xed\xa0\x80")),
    ("scene-title-cut", "CONSTRAINT", "SS-SD-005", "the title ends inside a character", other(title="aü".encode()[:2])),
    ("scene-cameras-none", "OUT_OF_RANGE", "SS-SD-006", "camera_count is 0", other(cameras=[])),
    ("scene-cameras-65", "OUT_OF_RANGE", "SS-SD-006", "camera_count is 65", other(cameras=[camera()] * 65)),
    ("scene-camera-far", "CONSTRAINT", "SS-SD-004", "a position of a camera is beyond 2^40",
     other(cameras=[camera((0, 2.0 ** 41, 0))])),
    ("scene-camera-rotation", "CONSTRAINT", "SS-SD-004", "a rotation of a camera is infinite",
     other(cameras=[camera(rotation=(1, 0, -INFINITY, 0))])),
    ("scene-camera-view-0", "CONSTRAINT", "SS-SD-004", "vertical_field_of_view is 0",
     other(cameras=[camera(), camera(field_of_view=0.0)])),
    ("scene-camera-view-pi", "CONSTRAINT", "SS-SD-004", "vertical_field_of_view is the binary32 number above pi",
     other(cameras=[camera(field_of_view=3.1415927410125732)])),
    ("scene-short", "SHORT_SECTION", "SS-ER-003", "the last byte of the cameras is missing", altered(lambda data: data[:-1])),
    ("scene-fixed-part-cut", "SHORT_SECTION", "SS-ER-003", "the payload has five bytes", altered(lambda data: data[:5])),
    ("scene-title-beyond", "SHORT_SECTION", "SS-ER-003", "title_length goes beyond the payload",
     changed(SCENE, payload=scene(8) + b"\x05abc")),
    ("scene-long", "TRAILING_BYTES", "SS-ER-003", "a byte stands after the cameras", altered(lambda data: data + b"\x00")),
    ("scene-title-length-not-shortest", "NUMBER", "SS-ER-003", "title_length is not in its shortest form",
     changed(SCENE, payload=scene(8) + b"\x81\x00a")),
    ("scene-frame", "OUT_OF_RANGE", "SS-UH-007", "frame of a scene_description is 1", changed(SCENE, frame=1)),
    ("scene-spatial-layer", "OUT_OF_RANGE", "SS-UH-007", "spatial_layer of a scene_description is 1", changed(SCENE, s=1)),
    ("scene-twice", "UNEXPECTED_UNIT", "SS-SD-007", "there are two scene_descriptions", repeated(SCENE)),
    ("scene-in-gop", "UNEXPECTED_UNIT", "SS-SD-007 SS-BS-001", "a second scene_description stands in a GOP",
     inserted(copy_of(SCENE), kind(c.UT_FRAME))),
    ("scene-before-parameters", "UNEXPECTED_UNIT", "SS-SD-007 SS-BS-001", "a scene_description comes before sequence_parameters",
     inserted(copy_of(SCENE), kind(c.UT_SEQUENCE))),
    ("scene-at-end", "UNEXPECTED_UNIT", "SS-SD-007 SS-BS-001", "a scene_description stands before the end unit",
     inserted(copy_of(SCENE), kind(c.UT_END))),
    ("scene-damaged", "CHECKSUM", "SS-UH-009 SS-ER-008", "a bit of the scene_description is flipped: every frame is output",
     flipped(SCENE)),
]


def described(asked):
    s = GivenStream()
    s.put(c.UT_SCENE, scene(**asked))
    return short_stream(s).close()


def rows():
    for name, requirements, purpose, asked in VALID:
        yield Vector("valid", "stream", name, purpose, requirements, lambda asked=asked: described(asked), "given", 0)
    yield from invalid("stream", "scene", [(name, PARENT, *row) for name, *row in FAULTS])
