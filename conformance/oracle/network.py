"""Clauses 5.17 and 6.17: weights units, networks and the registry of networks."""

import hashlib
import os

from . import syntax
from .conventions import TYPE_BYTES, ByteReader
from .errors import require
from .semantics import in_range, one_of
from .syntax import Record

# SS-WT-001: SHA-256 in hexadecimal and file in spec/data of each registered network
REGISTERED = (
    ("eb23e765a05bf3f974b059aee3d3c371871c855c69c55dd2b934fc706e5c0b79", "default-network.bin"),
)


def data_folder():
    """spec/data. The text lies beside this folder in the conformance kit, and beside the one above in the repository."""
    above = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
    kit, repository = (os.path.join(folder, "spec", "data") for folder in (above, os.path.dirname(above)))
    return kit if os.path.isdir(kit) else repository


DATA = data_folder()


def registered_networks():
    """Digest -> bytes of each registered network."""
    registry = {}
    for digest, name in REGISTERED:
        with open(os.path.join(DATA, name), "rb") as f:
            model = f.read()
        assert hashlib.sha256(model).hexdigest() == digest, name
        registry[bytes.fromhex(digest)] = model
    return registry


REGISTRY = registered_networks()


# ---- 6.17 weights ----


def parse_weights(reader, defined):
    """The network of a weights unit; `defined` tells whether the GOP has one already (SS-WT-002)."""
    unit = Record(syntax.WEIGHTS_FIXED, reader)
    one_of(unit, "model_source", (0, 1), "6.17", "RESERVED")
    require(not defined, "CONSTRAINT", "6.17", unit.at("model_source"))               # SS-WT-002
    if unit.model_source == 0:
        return parse_network(reader)
    at = reader.pos
    digest = bytes(reader.values("u8", 32, "6.17"))
    reader.check_end("5.17")
    require(digest in REGISTRY, "RESERVED", "6.17", at)                               # SS-WT-001
    return parse_network(ByteReader(REGISTRY[digest], 0, len(REGISTRY[digest])))


# ---- 6.17.1 network ----


def parse_network(reader):
    """A Record with the elements of 5.17.1, the flags and widths by name, and the arrays of 6.17.2."""
    u = Record(syntax.NETWORK_FIXED, reader)
    q = "6.17"
    require(u.network_flags & 0xF0 == 0, "RESERVED_BITS", q, u.at("network_flags"))   # SS-WT-003
    in_range(u, "width_log2", 3, 6, q)
    in_range(u, "feed_forward_width", 0, 128, q)
    in_range(u, "geometry_width", 0, 32, q)
    in_range(u, "fourier_count", 0, 4, q)
    in_range(u, "rank_count", 1, 16, q)
    in_range(u, "dc_count", 0, 3, q)
    in_range(u, "sh_count", 0, 16, q)
    in_range(u, "token_shift", 0, 8, q)
    in_range(u, "output_shift", 0, 4, q)
    in_range(u, "layer_shift", 1, 15, q)
    u.full_attention = u.network_flags & 1
    u.gated = u.network_flags >> 1 & 1
    u.normalised = u.network_flags >> 2 & 1
    u.knn_base = u.network_flags >> 3 & 1
    u.d, u.e, u.g = 2 ** u.width_log2, u.feed_forward_width, u.geometry_width
    u.n = u.dc_count + u.sh_count
    u.f = u.n + 8
    require(u.n > 0, "OUT_OF_RANGE", q, u.at("sh_count"))                             # SS-WT-003
    table = arrays(u)
    size = sum(TYPE_BYTES[kind] * rows * columns for _, kind, rows, columns in table)
    require(size <= reader.left(), "SHORT_SECTION", q, reader.pos)                # SS-WT-004
    for name, kind, rows, columns in table:
        setattr(u, name, [reader.values(kind, columns, q) for _ in range(rows)])
    reader.check_end("5.17")
    return u


def arrays(u):
    """The table of 6.17.2: (array, type, rows, values of a row); one without indices in the table is a single row."""
    d, e, g, n, f = u.d, u.e, u.g, u.n, u.f
    return [
        ("geometry", "i8", g, 3),
        ("geometry_bias", "i16", 1, g),
        ("geometry_embedding", "i8", d, g),
        ("embedding", "i8", d, f),
        ("rank", "i16", u.rank_count, d),
        ("query", "i8", 1, 0 if u.full_attention else d),
        ("attention", "i8", d, d),
        ("fourier", "i8", 1, 6 * u.fourier_count),
        ("value", "i8", d, d),
        ("value_bias", "i16", 1, d),
        ("gain", "i8", 1, d if u.normalised else 0),
        ("gain_bias", "i16", 1, d if u.normalised else 0),
        ("widening", "i8", e, d),
        ("widening_bias", "i16", 1, e),
        ("narrowing", "i8", d, e),
        ("narrowing_bias", "i16", 1, d if e else 0),
        ("head", "i8", n, d),
        ("head_bias", "i16", 1, n),
    ]
