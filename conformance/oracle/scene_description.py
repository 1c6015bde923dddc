"""Clause 6.9: scene_description, which says how a scene is meant and changes nothing of decoding (SS-SD-001)."""

from . import syntax
from .errors import StreamError, require
from .semantics import in_range, one_of, reserved_zero
from .syntax import Record

METRES, BACKGROUND, BOUNDS, TITLE, CAMERAS = (1 << bit for bit in range(5))
FINITE = 2.0 ** 40
BELOW_PI = 13176794 * 2.0 ** -22                    # the largest f32 below pi


def parse_scene_description(reader):
    """A Record; `cameras` are Records, `title` is a str; absent parts are None."""
    scene = Record(syntax.SCENE_FIXED, reader)
    for element, largest in (("up_axis", 6), ("kernel", 0), ("colour_space", 1), ("projection", 0), ("sorting", 1)):
        one_of(scene, element, range(largest + 1), "6.9", "RESERVED")                 # SS-SD-002
    reserved_zero(scene, "description_flags", "6.9", 0xE0)                            # SS-SD-003
    flags = scene.description_flags
    scene.metres_per_unit = scene.background = scene.bounds_min = scene.bounds_max = scene.title = None
    scene.cameras = []
    if flags & METRES:
        scene.read(syntax.SCENE_METRES, reader)
        floats(scene, "metres_per_unit", 2.0 ** -149, FINITE)
    if flags & BACKGROUND:
        scene.read(syntax.SCENE_BACKGROUND, reader)
        floats(scene, "background", 0.0, 1.0)
    if flags & BOUNDS:
        read_bounds(scene, reader)
    if flags & TITLE:
        read_title(scene, reader)
    if flags & CAMERAS:
        scene.read(syntax.SCENE_CAMERAS, reader)
        in_range(scene, "camera_count", 1, 64, "6.9")                                 # SS-SD-006
        scene.cameras = [read_camera(reader) for _ in range(scene.camera_count)]
    reader.check_end("5.9")
    return scene


def floats(record, element, low, high):
    """SS-SD-004"""
    in_range(record, element, low, high, "6.9", "CONSTRAINT")


def read_bounds(scene, reader):
    scene.read(syntax.SCENE_BOUNDS, reader)
    floats(scene, "bounds_min", -FINITE, FINITE)
    floats(scene, "bounds_max", -FINITE, FINITE)
    for low, high in zip(scene.bounds_min, scene.bounds_max):
        require(low <= high, "CONSTRAINT", "6.9", scene.at("bounds_max"))


def read_title(scene, reader):
    """SS-SD-005"""
    scene.read(syntax.SCENE_TITLE, reader)
    in_range(scene, "title_length", 1, 1024, "6.9")
    at = reader.pos
    content = bytes(reader.values("u8", scene.title_length, "6.9"))
    try:
        scene.title = content.decode("utf-8")
    except UnicodeDecodeError:
        raise StreamError("CONSTRAINT", "6.9", at) from None


def read_camera(reader):
    camera = Record(syntax.CAMERA, reader)
    floats(camera, "position", -FINITE, FINITE)
    floats(camera, "rotation", -FINITE, FINITE)
    floats(camera, "vertical_field_of_view", 2.0 ** -149, BELOW_PI)
    return camera
