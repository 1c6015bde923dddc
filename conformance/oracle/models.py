"""Plane models: syntax 5.12, semantics 6.12, coded planes 8.1, tokens 8.2, frequency tables 8.3."""

from .conventions import BitReader, bl
from .constants import FREQ_SUM, MAX_CONTEXTS
from .errors import require

# ---- 8.1 coded planes ----


class Plane:
    """A coded plane of a section: attribute, index in it, alphabet, number in plane order, alphabet before it."""

    def __init__(self, number, attribute, index, alphabet, section="new", alphabet_before=None):
        self.number = number
        self.attribute = attribute
        self.index = index
        self.alphabet = alphabet
        self.section = section
        self.alphabet_before = alphabet_before

    def identity(self):
        """What makes it `the same plane` in another unit (SS-PM-001)."""
        return (self.attribute, self.index, self.alphabet)

    def largest_token(self, direct_log2):
        """SS-EC-001"""
        n_max = {"position": 59, "signed": 16, "index": 15}[self.alphabet]
        return 2 ** direct_log2 + 4 * (n_max - direct_log2) + 3


def section_planes(name, dc_rank=0, sh_mode=0, sh_rank=0, vq_stage_count=0):
    """The planes of a section of a frame_header or an increment."""
    attributes = attribute_rows(dc_rank, sh_mode, sh_rank, vq_stage_count)
    rows = {
        "cells": [("cell", 1, "position"), ("stale", 1, "signed"),
                  ("translation", 3, "signed"), ("cell_rotation", 3, "signed")],
        "modes": [("mode", 1, "signed")],
        "move_predictors": [("move_predictor", 1, "signed")],
        "moves": [("move", 3, "signed")],
        "updates": attributes,
        "predictors": [("predictor", 1, "signed")],
        "new": [("position", 1, "position")] + attributes,
    }[name]
    planes = []
    for attribute, count, alphabet in rows:
        for index in range(count):
            before = planes[-1].alphabet if planes else None
            planes.append(Plane(len(planes), attribute, index, alphabet, name, before))
    return planes


def attribute_rows(dc_rank, sh_mode, sh_rank, vq_stage_count):
    sh_count = {0: 0, 1: sh_rank, 2: vq_stage_count}[sh_mode]
    sh_alphabet = "index" if sh_mode == 2 else "signed"
    return [("log_scale", 3, "signed"), ("opacity", 1, "signed"), ("rotation", 3, "signed"),
            ("dc", dc_rank, "signed"), ("sh", sh_count, sh_alphabet)]


# ---- 8.5, column "Available to" ----


def source_available(source, plane):
    """SS-EC-005: whether a context source may be used by a plane."""
    log_scale_index = plane.index if plane.attribute == "log_scale" else 3
    in_new = plane.section == "new" and plane.attribute != "position"
    after_log_scale = in_new and plane.attribute != "log_scale"
    if source == 0:
        return True
    if source == 1:
        return plane.alphabet != "index"
    if source == 2:
        return plane.alphabet == "signed"
    if source == 3:
        first_index = plane.alphabet == "index" and plane.index == 0
        return plane.number > 0 and plane.alphabet_before != "position" and not first_index
    if source == 4:
        return plane.index >= 1
    if source == 5:
        return in_new and log_scale_index >= 1
    if source == 6:
        return in_new and log_scale_index >= 2
    if source in (7, 8):
        return after_log_scale
    if source == 9:
        return after_log_scale and plane.attribute != "opacity"
    if source == 10:
        return in_new
    if source == 11:
        return after_log_scale
    raise AssertionError("sources of 12 and more do not get here")


# ---- 5.12 plane_model ----


class PlaneModel:
    """bias, direct_log2, (source, thresholds) a and b, and a table for each context."""


class Table:
    """A frequency table: the tokens with a frequency above 0, ascending, with freq and cum."""

    def __init__(self, freq_of_token):
        self.tokens = sorted(t for t, f in freq_of_token.items() if f > 0)
        self.freq = [freq_of_token[t] for t in self.tokens]
        self.cum = []
        total = 0
        for f in self.freq:
            self.cum.append(total)
            total += f
        assert total == FREQ_SUM


def parse_models(section, planes, in_force):
    """`in_force`: identity -> PlaneModel that `reuse` may name (SS-PM-001)."""
    bits = BitReader(section.data, section.pos, section.end, "6.12")
    models = []
    for plane in planes:
        reuse = bits.u(1)
        if reuse == 1:
            require(plane.identity() in in_force, "CONSTRAINT", "6.12", bits.byte())  # SS-PM-001
            models.append(in_force[plane.identity()])
        else:
            models.append(parse_plane_model(bits, plane))
    bits.check_end()                                                                  # SS-PM-010
    for plane, model in zip(planes, models):                       # SS-PM-003
        for source in (model.source_a, model.source_b):
            require(source_available(source, plane), "CONSTRAINT", "6.12", bits.byte())
    return models


def parse_plane_model(bits, plane):
    model = PlaneModel()
    model.bias = 0
    if plane.alphabet == "signed":
        model.bias = bits.se()
        require(-32768 <= model.bias <= 32767, "CONSTRAINT", "6.12", bits.byte())     # SS-PM-002
    largest = 3 if plane.alphabet == "position" else 5
    direct_log2_minus2 = bits.u(3)
    require(direct_log2_minus2 <= largest, "CONSTRAINT", "6.12", bits.byte())
    model.direct_log2 = direct_log2_minus2 + 2

    model.source_a, model.thresholds_a = 0, []
    model.source_b, model.thresholds_b = 0, []
    model.source_a = parse_source(bits)
    if model.source_a != 0:
        count = bits.u(4) + 1
        model.thresholds_a = parse_thresholds(bits, count)
        model.source_b = parse_source(bits)
        if model.source_b != 0:
            count = bits.u(4) + 1
            model.thresholds_b = parse_thresholds(bits, count)
    context_count = (len(model.thresholds_a) + 1) * (len(model.thresholds_b) + 1)
    require(context_count <= MAX_CONTEXTS, "CONSTRAINT", "6.12", bits.byte())      # SS-PM-005
    model.tables = parse_tables(bits, context_count, plane, model.direct_log2)
    return model


def parse_source(bits):
    source = bits.u(4)
    require(source <= 11, "RESERVED", "6.12", bits.byte())                            # SS-PM-003
    return source


def parse_thresholds(bits, count):
    thresholds = [bits.se()]
    for k in range(count):
        if k > 0:
            thresholds.append(thresholds[-1] + bits.ue() + 1)
        good = -2 ** 31 <= thresholds[-1] <= 2 ** 31 - 1                              # SS-PM-004
        require(good, "CONSTRAINT", "6.12", bits.byte())
    return thresholds


def parse_tables(bits, context_count, plane, direct_log2):
    """One table for each context (8.3); `numbered` are those that table_index may name."""
    largest_token = plane.largest_token(direct_log2)
    tables = []
    numbered = []
    for context in range(context_count):
        table_kind = bits.u(2)
        is_reference = bits.u(1) if table_kind == 1 else 0
        if table_kind == 2:
            require(context > 0, "CONSTRAINT", "6.12", bits.byte())                   # SS-PM-005
            tables.append(tables[context - 1])
        elif is_reference == 1:
            table_index = bits.u(6)
            require(table_index < len(numbered), "CONSTRAINT", "6.12", bits.byte())   # SS-PM-009
            tables.append(numbered[table_index])
        else:
            if table_kind == 0:
                table = Table({0: FREQ_SUM})
            elif table_kind == 1:
                token = bits.u(bl(largest_token))
                require(token <= largest_token, "CONSTRAINT", "6.12", bits.byte())    # SS-PM-006
                table = Table({token: FREQ_SUM})
            else:
                table = coded_table(bits, plane, direct_log2)
            numbered.append(table)
            tables.append(table)
    return tables


def coded_table(bits, plane, direct_log2):
    """table_kind 3"""
    is_parametric = bits.u(1)
    largest_token = plane.largest_token(direct_log2)
    last = bits.u(bl(largest_token))
    require(last <= largest_token, "CONSTRAINT", "6.12", bits.byte())                 # SS-PM-006
    if not is_parametric:
        return explicit_table(bits, last)
    shape, zero_level, scale = bits.u(2), bits.u(4), bits.u(6)
    signed = plane.alphabet == "signed"
    centre = bits.se() if signed else 0
    require(-32768 <= centre <= 32767, "CONSTRAINT", "6.12", bits.byte())             # SS-PM-008
    return parametric_table(signed, direct_log2, last, shape, zero_level, scale, centre)


def first_code(token, direct_log2):
    """8.3: the smallest u of a token"""
    above = token - 2 ** direct_log2
    return token if above < 0 else (4 + above % 4) << (direct_log2 + above // 4 - 2)


def parametric_table(signed, direct_log2, last, shape, zero_level, scale, centre):
    """8.3"""
    width = (2 + scale % 2) << (scale // 2 + 2 * shape)

    def survival(distance):
        part = (width << 16) // (width + distance)
        for _ in range(2 * shape):
            part = (part * part) >> 16
        return part

    outside = survival(8) if zero_level == 0 else 2 ** 24 // (256 + 2 ** zero_level)

    def tail(steps):
        return (outside * survival(16 * min(steps - 1, 2 ** 36))) >> 16

    def mass_below(e):
        return 2 ** 17 - tail(e - centre) if e > centre else tail(centre - e + 1)

    def mass_of_codes(u):
        if signed:
            return mass_below((u + 1) // 2) - mass_below(-(u // 2))
        return 0 if u == 0 else 2 ** 16 - tail(u)

    whole = max(1, mass_of_codes(first_code(last + 1, direct_log2)))
    cum = [t + (FREQ_SUM - 1 - last) * mass_of_codes(first_code(t, direct_log2)) // whole for t in range(last + 1)]
    cum.append(FREQ_SUM)
    return Table({t: cum[t + 1] - cum[t] for t in range(last + 1)})


def explicit_table(bits, last):
    def constraint(condition):
        require(condition, "CONSTRAINT", "6.12", bits.byte())

    freq = {}
    mode = bits.u(bl(last))
    constraint(mode <= last)                                                          # SS-PM-006
    length = 0
    for t in range(last + 1):
        if t == mode:
            continue
        length += bits.se()
        constraint(0 <= length <= 12)                                                 # SS-PM-007
        if length == 0:
            freq[t] = 0
        else:
            mantissa = bits.u(min(length - 1, 3))
            freq[t] = 2 ** (length - 1) + (mantissa << max(length - 4, 0))
    freq[mode] = FREQ_SUM - sum(freq.values())                                        # SS-EC-002
    constraint(1 <= freq[mode] <= FREQ_SUM - 1)
    constraint(freq[last] != 0)
    return Table(freq)
