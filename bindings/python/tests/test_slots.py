"""Frames for renderers: every Gaussian keeps its row."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import splatstream_codec as gss

NAMES = ("position", "log_scale", "rotation", "opacity_logit", "dc", "sh")


def test_rows_that_are_not_dirty_have_not_changed(talk: Path) -> None:
    slots = gss.Slots(4000)
    arrays = {name: getattr(slots, name) for name in NAMES}
    mirror = {name: array.copy() for name, array in arrays.items()}
    for frame in gss.decode(talk):
        update = slots.update(frame)
        if update.has_new_sh:
            arrays["sh"], mirror["sh"] = slots.sh, slots.sh.copy()
        assert update.kept + update.appeared == len(frame)
        for rows in update.dirty:
            for name in NAMES:
                mirror[name][rows] = arrays[name][rows]
        for name in NAMES:
            # Written in place, and nowhere but in the rows that were told.
            assert getattr(slots, name) is arrays[name]
            assert np.array_equal(mirror[name], arrays[name]), name
        at = np.array([slots.slot(identity) for identity in frame.identities.tolist()])
        assert np.array_equal(slots.position[at], frame.position)
        assert np.array_equal(slots.rotation[at], frame.rotation)
        assert np.array_equal(slots.sh[at], frame.sh)
        empty = np.setdiff1d(np.arange(slots.capacity), at)
        assert np.isneginf(slots.opacity_logit[empty]).all() and (slots.dc[empty] == 0).all()


def test_a_frame_that_does_not_fit_leaves_the_slots(talk: Path) -> None:
    slots = gss.Slots(10)
    with pytest.raises(gss.Error) as error:
        slots.update(next(gss.decode(talk)))
    assert error.value.kind == "too-few-slots"
    assert np.isneginf(slots.opacity_logit).all() and slots.slot(0) is None
