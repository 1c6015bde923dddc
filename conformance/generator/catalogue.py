"""All vectors by name, those of each area from a module of its own."""

import oracle_path  # noqa: F401
import catalogue_blocks
import catalogue_bytes
import catalogue_dynamic
import catalogue_entropy
import catalogue_increments
import catalogue_learned
import catalogue_limits
import catalogue_mixed
import catalogue_order
import catalogue_records
import catalogue_stream
import catalogue_tools
import catalogue_truncation
import catalogue_values
import catalogue_weights

MODULES = (catalogue_stream, catalogue_values, catalogue_entropy, catalogue_dynamic, catalogue_tools,
           catalogue_learned, catalogue_weights, catalogue_mixed, catalogue_bytes,
           catalogue_records, catalogue_order, catalogue_increments, catalogue_blocks,
           catalogue_limits, catalogue_truncation)


def collected():
    result = {}
    for module in MODULES:
        for row in module.rows():
            assert row.name not in result, row.name
            result[row.name] = row
    return result


VECTORS = collected()
