"""Faults: changes of whole streams, for the catalogues of invalid vectors.

A change is a function of the file_header and the units of the parent; it gives new ones. Selectors tell which units.
"""

import struct

from .synth.units import stream_of, units_of
from .vector import Vector


def kind(*kinds, nth=0):
    """Selector: the nth unit of some types, counted from the end if negative."""
    def select(units):
        return [i for i, u in enumerate(units) if u.kind in kinds][nth]
    return select


def where(test, nth=0):
    """Selector: the nth unit for which a test of the unit holds."""
    def select(units):
        return [i for i, u in enumerate(units) if test(u)][nth]
    return select


def changed(select, **values):
    """Attributes of a unit (units.Unit), of its header or its payload; a value may be a function of the unit."""
    def change(head, units):
        i = select(units)
        u = units[i].copy()
        for name, value in values.items():
            setattr(u, name, value(u) if callable(value) else value)
        return head, units[:i] + [u] + units[i + 1:]
    return change


def element(select, name, value, index=0):
    """One element of a payload; the value may be a function of the old one."""
    def change(head, units):
        i = select(units)
        u = units[i].copy()
        u.set(name, value(u.get(name, index)) if callable(value) else value, index)
        return head, units[:i] + [u] + units[i + 1:]
    return change


def payload(select, function):
    return changed(select, payload=lambda u: function(u.payload))


def entry(at, kind_of_value, value):
    """A function of a payload: an element of an entry of the variable part, by its offset."""
    def change(data):
        old = struct.unpack_from("<" + kind_of_value, data, at)[0]
        new = struct.pack("<" + kind_of_value, value(old) if callable(value) else value)
        return data[:at] + new + data[at + len(new):]
    return change


def cut(size):
    return lambda data: data[:size]


def longer(data):
    return data + b"\x00"


def flipped(select, at=-1, value=0x10):
    """A byte of the written unit changed without its checksum."""
    return changed(select, raw=((at, value),))


def lost(select):
    def change(head, units):
        i = select(units)
        return head, units[:i] + units[i + 1:]
    return change


def lost_all(test):
    return lambda head, units: (head, [u for u in units if not test(u)])


def repeated(select):
    def change(head, units):
        i = select(units)
        return head, units[:i + 1] + units[i:]
    return change


def moved(select, before):
    """A unit put before another one."""
    def change(head, units):
        i, j = select(units), before(units)
        rest = units[:j] + [units[i]] + units[j:]
        del rest[i + (i >= j)]
        return head, rest
    return change


def inserted(make, before):
    """A new unit, made from the list of units, before another one."""
    def change(head, units):
        j = before(units)
        return head, units[:j] + [make(units)] + units[j:]
    return change


def copy_of(select, **values):
    return lambda units: units[select(units)].copy(**values)


def together(*changes):
    """Changes that make one fault, or several in one unit, or one after the other."""
    def change(head, units):
        for one in changes:
            head, units = one(head, units)
        return head, units
    return change


def in_bytes(function):
    """A change of the bytes of the whole stream."""
    function.of_bytes = True
    return function


def kept_end(change):
    """A change after which index and end unit stay as they are."""
    change.keep_end = True
    return change


def apply(change, parent):
    if getattr(change, "of_bytes", False):
        return change(parent)
    return stream_of(*change(*units_of(parent)), getattr(change, "keep_end", False))


def invalid(area, recipe, rows):
    """Vectors of rows (name, parent, code, requirements, fault, change); a tuple of codes: each of them is right."""
    for name, parent, code, requirements, fault, change in rows:
        acceptable, code = (code, None) if isinstance(code, tuple) else ((), code)
        yield Vector("invalid", area, name, None, requirements, lambda data, change=change: apply(change, data), recipe, 0,
                     parent, fault, code, acceptable)

