"""scene_description units (5.9): elements by name, and at random."""

import struct

from .encoding import leb

FIXED = ("up_axis", "kernel", "colour_space", "projection", "sorting")
PARTS = ("metres_per_unit", "background", "bounds", "title", "cameras")


def f32(*values):
    return struct.pack("<%df" % len(values), *values)


def camera(position=(0, 0, 0), rotation=(1, 0, 0, 0), field_of_view=1.0):
    return f32(*position, *rotation, field_of_view)


def scene(flags=None, **asked):
    """The payload; of PARTS those that are asked for are present. title: bytes; cameras: a list of bytes; bounds: six numbers."""
    present = sum(1 << bit for bit, name in enumerate(PARTS) if name in asked)
    out = bytes(asked.get(name, 0) for name in FIXED) + bytes([present if flags is None else flags])
    if "metres_per_unit" in asked:
        out += f32(asked["metres_per_unit"])
    out += f32(*asked.get("background", ())) + f32(*asked.get("bounds", ()))
    if "title" in asked:
        out += leb(len(asked["title"])) + asked["title"]
    if "cameras" in asked:
        out += leb(len(asked["cameras"])) + b"".join(asked["cameras"])
    return out


def random_scene(rng):
    every = {"metres_per_unit": rng.choice([1.0, 0.01, 2.0 ** 40]), "background": [rng.random() for _ in range(3)],
             "bounds": [-rng.random() for _ in range(3)] + [rng.random() for _ in range(3)], "title": "Scène".encode(),
             "cameras": [camera([rng.random() for _ in range(3)]) for _ in range(rng.randint(1, 3))]}
    asked = {name: value for name, value in every.items() if rng.random() < 0.5}
    return scene(up_axis=rng.randint(0, 6), colour_space=rng.randint(0, 1), sorting=rng.randint(0, 1), **asked)
