"""Plane models: syntax 5.12, semantics 6.12, coded planes 8.1, tokens 8.2, frequency tables 8.3."""

from conventions import BitReader
from constants import FREQ_SUM, MAX_CONTEXTS
from errors import require

# ---- 8.1 coded planes ----


class Plane:
    """A coded plane: attribute, place in it, alphabet, number in plane order."""

    def __init__(self, number, attribute, place, alphabet):
        self.number = number
        self.attribute = attribute
        self.place = place
        self.alphabet = alphabet

    def identity(self):
        """What makes it `the same plane` in another refinement (SS-PM-001)."""
        return (self.attribute, self.place, self.alphabet)

    def largest_token(self, direct_log2):
        """SS-EC-001"""
        n_max = {"position": 59, "signed": 16, "index": 15}[self.alphabet]
        return 2 ** direct_log2 + 4 * (n_max - direct_log2) + 3


def coded_planes(dc_rank, sh_mode, sh_rank, vq_stage_count):
    """The planes of a refinement unit; those of section new are the same."""
    return planes_of_rows([("position", 1, "position")]
                          + attribute_rows(dc_rank, sh_mode, sh_rank, vq_stage_count))


def section_planes(name, dc_rank, sh_mode, sh_rank, vq_stage_count):
    """The planes of a section of an increment."""
    if name == "new":
        return coded_planes(dc_rank, sh_mode, sh_rank, vq_stage_count)
    if name == "updates":
        return planes_of_rows(attribute_rows(dc_rank, sh_mode, sh_rank, vq_stage_count))
    return planes_of_rows({
        "cells": [("cell", 1, "position"), ("stale", 1, "signed"),
                  ("translation", 3, "signed"), ("turn", 3, "signed")],
        "modes": [("mode", 1, "signed")],
        "moves": [("move", 3, "signed")],
        "predictors": [("predictor", 1, "signed")],
    }[name])


def attribute_rows(dc_rank, sh_mode, sh_rank, vq_stage_count):
    sh_count = {0: 0, 1: sh_rank, 2: vq_stage_count}[sh_mode]
    sh_alphabet = "index" if sh_mode == 2 else "signed"
    return [("log_scale", 3, "signed"), ("opacity", 1, "signed"), ("rotation", 3, "signed"),
            ("dc", dc_rank, "signed"), ("sh", sh_count, sh_alphabet)]


def planes_of_rows(rows):
    planes = []
    for attribute, count, alphabet in rows:
        for place in range(count):
            planes.append(Plane(len(planes), attribute, place, alphabet))
    return planes


# ---- 8.5, column "Available to" ----


def source_available(source, plane):
    """Whether a context source may be used by a plane."""
    log_scale_place = plane.place if plane.attribute == "log_scale" else 3
    after_position = plane.attribute != "position"
    after_log_scale = after_position and plane.attribute != "log_scale"
    if source == 0:
        return True
    if source == 1:
        return plane.alphabet in ("position", "signed")
    if source == 2:
        return plane.alphabet == "signed"
    if source == 3:
        first_index = plane.alphabet == "index" and plane.place == 0
        return after_position and log_scale_place >= 1 and not first_index
    if source == 4:
        return plane.place >= 1
    if source == 5:
        return after_position and log_scale_place >= 1
    if source == 6:
        return after_position and log_scale_place >= 2
    if source in (7, 8):
        return after_log_scale
    if source == 9:
        return after_log_scale and plane.attribute != "opacity"
    if source == 10:
        return after_position
    raise AssertionError("sources of 11 and more do not get here")


def source_available_in_section(source, plane):
    """SS-EC-007: the sections cells, modes, moves, updates and predictors."""
    first_index = plane.alphabet == "index" and plane.place == 0
    if source == 0:
        return True
    if source == 1:
        return plane.alphabet != "index"
    if source == 2:
        return plane.alphabet == "signed"
    if source == 3:
        return plane.number > 0 and plane.attribute != "stale" and not first_index
    if source == 4:
        return plane.place >= 1
    return False


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


def parse_models(section, planes, previous, available=source_available):
    """`previous`: identity -> PlaneModel that `reuse` may name (SS-PM-001, SS-PM-010), or None."""
    bits = BitReader(section.data, section.pos, section.end, "6.12")
    models = []
    for plane in planes:
        reuse = bits.u(1)
        if reuse == 1:
            known = previous is not None and plane.identity() in previous
            require(known, "CONSTRAINT", "6.12", bits.byte())
            models.append(previous[plane.identity()])
        else:
            models.append(parse_plane_model(bits, plane))
    bits.check_end()
    for plane, model in zip(planes, models):                       # SS-PM-003
        for source in (model.source_a, model.source_b):
            require(available(source, plane), "CONSTRAINT", "6.12", bits.byte())
    return models


def parse_plane_model(bits, plane):
    model = PlaneModel()
    model.bias = 0
    if plane.alphabet == "signed":
        model.bias = bits.se()
        require(-32768 <= model.bias <= 32767, "CONSTRAINT", "6.12", bits.byte())
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
    model.tables = parse_tables(bits, context_count, plane.largest_token(model.direct_log2))
    return model


def parse_source(bits):
    source = bits.u(4)
    require(source <= 10, "RESERVED", "6.12", bits.byte())
    return source


def parse_thresholds(bits, count):
    thresholds = [bits.se()]
    for k in range(count):
        if k > 0:
            thresholds.append(thresholds[-1] + bits.ue() + 1)
        require(-2 ** 31 <= thresholds[-1] <= 2 ** 31 - 1, "CONSTRAINT", "6.12", bits.byte())
    return thresholds


def parse_tables(bits, context_count, largest_token):
    """One table for each context (8.3); `numbered` are those table_place may name."""
    tables = []
    numbered = []
    for context in range(context_count):
        table_kind = bits.u(2)
        is_reference = bits.u(1) if table_kind == 1 else 0
        if table_kind == 2:
            require(context > 0, "CONSTRAINT", "6.12", bits.byte())
            tables.append(tables[context - 1])
        elif is_reference == 1:
            table_place = bits.u(6)
            require(table_place < len(numbered), "CONSTRAINT", "6.12", bits.byte())   # SS-PM-009
            tables.append(numbered[table_place])
        else:
            if table_kind == 0:
                table = Table({0: FREQ_SUM})
            elif table_kind == 1:
                token = bits.u(8)
                require(token <= largest_token, "CONSTRAINT", "6.12", bits.byte())
                table = Table({token: FREQ_SUM})
            else:
                table = explicit_table(bits, largest_token)
            numbered.append(table)
            tables.append(table)
    return tables


def explicit_table(bits, largest_token):
    def constraint(condition):
        require(condition, "CONSTRAINT", "6.12", bits.byte())

    freq = {}
    last = bits.u(8)
    constraint(last <= largest_token)
    mode = bits.u(8)
    constraint(mode <= last)
    length = 0
    for t in range(last + 1):
        if t == mode:
            continue
        length += bits.se()
        constraint(0 <= length <= 12)
        if length == 0:
            freq[t] = 0
        else:
            mantissa = bits.u(min(length - 1, 3))
            freq[t] = 2 ** (length - 1) + (mantissa << max(length - 4, 0))
    freq[mode] = FREQ_SUM - sum(freq.values())
    constraint(1 <= freq[mode] <= FREQ_SUM - 1)
    constraint(freq[last] != 0)
    return Table(freq)
