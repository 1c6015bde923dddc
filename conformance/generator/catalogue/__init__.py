"""All vectors by name, those of each area from a module of its own."""

from . import (blocks, entropy, grid, headers, increments, lanes, learned, limits, losses, mixed, motion, narrow, nested,
               noticed, order, parameters, records, scene, steps, stream, structure, tools, updates, values, weights)

MODULES = (stream, values, grid, steps, entropy, lanes, structure, nested, tools, motion, updates, learned, weights, mixed,
           headers, parameters, records, order, losses, increments, blocks, limits, scene, narrow, noticed)


def collected():
    result = {}
    for module in MODULES:
        for row in module.rows():
            assert row.name not in result, row.name
            result[row.name] = row
    return result


VECTORS = collected()
