"""Mutations of companded positions, steps, lanes, predicted motion and extrapolation. A row is as in records.py.

They are what a decoder may plausibly do wrong.
"""

SEMANTICS, OUTPUT, PARSING, STEPS, MOVES = "semantics.py", "output.py", "parsing.py", "steps.py", "moves.py"
RESIDUALS, PREDICTION, TRANSFORMER, INCREMENT, FRAME = ("residuals.py", "prediction.py", "transformer.py", "increment.py",
                                                        "frame.py")
LISTS, TABLES, MODELS = "lists.py", "tables.py", "models.py"

MUTATIONS = [
    # 6.4: the grid
    ("SS-SP-008", SEMANTICS, "good = companded <= 0 or ceil_div(companded, 2 ** seq.segment_log2) <= c.MAX_SEGMENTS", "good = True"),
    ("SS-SP-008", "constants.py", "MAX_SEGMENTS = 24", "MAX_SEGMENTS = 28"),
    ("SS-SP-008", "constants.py", "MAX_SEGMENTS = 24", "MAX_SEGMENTS = 23"),
    ("SS-SP-008", SEMANTICS, 'require(good, "CONSTRAINT", "6.4", seq.at("segment_log2"))', 'require(good, "OUT_OF_RANGE", "6.4", 0)'),

    # 7.10.1
    ("SS-OUT-005", OUTPUT, "if distance > linear:", "if distance >= linear:\n        segment = 0\n    if distance > linear + 1:"),
    ("SS-OUT-005", OUTPUT, "segment += 1", "pass"),
    ("SS-OUT-005", OUTPUT, "(2 ** segment - 2) * 2 ** seq.segment_log2", "(2 ** segment - 1) * 2 ** seq.segment_log2"),
    ("SS-OUT-005", OUTPUT, "rest * 2 ** segment", "rest * 2"),
    ("SS-OUT-005", OUTPUT, "middle + length if code >= middle else middle - length", "middle + length"),
    ("SS-OUT-005", OUTPUT, "linear = abs(code - middle), 2 ** seq.linear_log2",
     "linear = abs(code - middle), 2 ** min(seq.linear_log2, seq.position_bits - 2 if seq.position_bits > 1 else 0)"),
    ("SS-OUT-001", OUTPUT, "expanded = [expand(code, seq) for code in planes[a]]",
     "middle = 2 ** (seq.position_bits - 1)\n        expanded = [middle + fl(expand(code, seq) - middle) for code in planes[a]]"),
    ("SS-OUT-001", OUTPUT, "expanded = [expand(code, seq) for code in planes[a]]", "expanded = planes[a]"),

    # 7.6.6
    ("SS-AT-003", TABLES, "1, 2, 3, 4, 6, 8, 12,", "1, 1, 2, 3, 4, 6, 8,"),
    ("SS-AT-003", TABLES, "1, 2, 3, 4, 6, 8, 12,", "1, 2, 3, 4, 5, 8, 12,"),
    ("SS-AT-003", TABLES, "1536, 2048, 3072, 4096, 6144,", "1536, 2048, 3072, 4096, 6145,"),
    ("SS-AT-003", TABLES, "1536, 2048, 3072, 4096, 6144,", "1536, 2048, 2896, 4096, 6144,"),
    ("SS-AT-004", STEPS, "size = 2 * q[0] if attribute == LOG_SCALE", "size = q[0] if attribute == LOG_SCALE"),
    ("SS-AT-004", STEPS, "sum(q) - min(q)", "sum(q)"),
    ("SS-AT-004", STEPS, "sum(q) - min(q)", "q[0] + q[1]"),
    ("SS-AT-004", STEPS, "max(0, seq.opacity_reference - o)", "(seq.opacity_reference - o)"),
    ("SS-AT-004", STEPS, "max(0, seq.anisotropy_reference - (max(q) - min(q)))", "(seq.anisotropy_reference - (max(q) - min(q)))"),
    ("SS-AT-004", STEPS, "max(0, seq.anisotropy_reference - (max(q) - min(q)))", "max(0, seq.anisotropy_reference - (q[0] - q[2]))"),
    ("SS-AT-004", STEPS, "if attribute >= ROTATION:", "if attribute > ROTATION:"),
    ("SS-AT-004", STEPS, "if attribute == ROTATION:", "if attribute >= ROTATION:"),
    ("SS-AT-004", STEPS, "Round(total, 14)", "(total >> 14)"),
    ("SS-AT-004", STEPS, "Round(total, 14)", "int(total / 2 ** 14)"),
    ("SS-AT-004", STEPS, "Round(total, 14), 0, MAX_ATTRIBUTE_STEP)", "Round(total, 14), 0, 23)"),
    ("SS-AT-004", STEPS, "clamp(self.attribute_step[attribute] + Round(total, 14), 0, MAX_ATTRIBUTE_STEP)",
     "self.attribute_step[attribute] + clamp(Round(total, 14), 0, MAX_ATTRIBUTE_STEP - self.attribute_step[attribute])"),
    ("SS-AT-004", RESIDUALS, "if number else self.rule.first()", "if number else self.rule.factor(0, p[0])"),
    ("SS-AT-004", RESIDUALS, "factor = self.rule.factor(LOG_SCALE, [q[0][i]])", "factor = self.rule.factor(LOG_SCALE, p[i])"),
    ("SS-AT-004", RESIDUALS, "factors = [self.rule.factor(number, shape.q, shape.o) if number",
     "q = [self.predict('log_scale', i, values) for i, values in enumerate(self.values)]\n"
     "            factors = [self.rule.factor(number, q.pop(0), shape.o) if number"),
    ("SS-AT-004", STEPS, "seq.size_weight[attribute]", "seq.size_weight[min(attribute, DC)]"),
    ("SS-AT-004", STEPS, "seq.opacity_weight[attribute - ROTATION]", "seq.opacity_weight[0]"),
    ("SS-RC-001", RESIDUALS, "steps += [d1, d2] self.check_planes(x, VALUE_MIN, VALUE_MAX)",
     "steps += [d1, d2]\n        self.check_planes(v, VALUE_MIN, VALUE_MAX)"),

    # updates: each log-scale by itself, the range and the order of what results, steps of the parent before the update
    ("SS-PA-004", RESIDUALS, "self.updated_log_scale(v, factors)", "self.new_log_scale(p, v, factors)"),
    ("SS-PA-004", RESIDUALS, "parent.q[k] + value for parent, value in zip(self.parents, x[k])]",
     "parent.q[k] + value + (k > 0) * first for parent, value, first in zip(self.parents, x[k], x[0])]"),
    ("SS-PA-004", RESIDUALS, "parent.q[k] + value for parent, value in zip(self.parents, x[k])]",
     "parent.q[k] + value + (k > 1) * second for parent, value, second in zip(self.parents, x[k], x[1])]"),
    ("SS-AT-004", RESIDUALS, "for shape in self.parents or self.values]", "for shape in self.values]"),
    ("SS-AT-004", RESIDUALS, "shape.o) if number else self.rule.first() for shape in self.parents or self.values]",
     "values.o) if number else self.rule.first()\n"
     "                       for shape, values in zip(self.parents or self.values, self.values)]"),
    ("SS-AT-004", RESIDUALS, "self.rule.factor(number, shape.q, shape.o) if number else self.rule.first() for shape in "
     "self.parents or self.values]",
     "self.rule.factor(number, values.q, shape.o) if number else self.rule.first()\n"
     "                       for shape, values in zip(self.parents or self.values, self.values)]"),
    ("SS-AT-004", RESIDUALS, "others = [self.rule.factor(LOG_SCALE, parent.q) for parent in self.parents]", "others = factors"),
    ("SS-AT-004", RESIDUALS, "others = [self.rule.factor(LOG_SCALE, parent.q) for parent in self.parents]",
     "others = [self.rule.factor(LOG_SCALE, [parent.q[0] + value * factor])\n"
     "                  for parent, value, factor in zip(self.parents, v[0], factors)]"),
    ("SS-AT-004", RESIDUALS, "zip(v, (factors, others, others))]", "zip(v, (others, others, others))]"),
    ("SS-AT-004", INCREMENT, "updated = [parents[i] for i in updaters]",
     "before = self.frame.origins(self.s, self.r) if self.header.extrapolates_opacity else parents\n"
     "        updated = [parents[i]._replace(o=before[i].o) for i in updaters]"),
    ("SS-RC-001", RESIDUALS, "for k in range(3)] self.check_planes(x, VALUE_MIN, VALUE_MAX)", "for k in range(3)]"),
    ("SS-RC-001", RESIDUALS, "for k in range(3)] self.check_planes(x, VALUE_MIN, VALUE_MAX)",
     "for k in range(3)]\n        self.check_planes(v, VALUE_MIN, VALUE_MAX)"),
    ("SS-RC-001", RESIDUALS, "for k in range(3)] self.check_planes(x, VALUE_MIN, VALUE_MAX)",
     "for k in range(3)]\n        self.check_planes(x[:2], VALUE_MIN, VALUE_MAX)"),
    ("SS-RC-001", RESIDUALS, "for k in range(3)] self.check_planes(x, VALUE_MIN, VALUE_MAX)",
     "for k in range(3)]\n        self.check_planes(x, VALUE_MIN - 1, VALUE_MAX)"),
    ("SS-RC-001", RESIDUALS, "for k in range(3)] self.check_planes(x, VALUE_MIN, VALUE_MAX)",
     "for k in range(3)]\n        self.check_planes(x, VALUE_MIN, VALUE_MAX + 1)"),
    ("SS-RC-001", RESIDUALS, "self.check_planes(q, VALUE_MIN, VALUE_MAX) for i, values", "for i, values"),
    ("SS-RC-001", RESIDUALS, "self.check_planes(q, VALUE_MIN, VALUE_MAX) for i, values",
     "self.check_planes(q[:2], VALUE_MIN, VALUE_MAX)\n        for i, values"),
    ("SS-RC-001", RESIDUALS, "self.check_planes(q, VALUE_MIN, VALUE_MAX) for i, values",
     "self.check_planes(q[1:], VALUE_MIN, VALUE_MAX)\n        for i, values"),
    ("SS-RC-001", RESIDUALS, "self.check_planes(q, VALUE_MIN, VALUE_MAX) for i, values",
     "self.check_planes(q, VALUE_MIN - 1, VALUE_MAX)\n        for i, values"),
    ("SS-RC-001", RESIDUALS, "self.check_planes(q, VALUE_MIN, VALUE_MAX) for i, values",
     "self.check_planes(q, VALUE_MIN, VALUE_MAX + 1)\n        for i, values"),
    ("SS-RC-001", RESIDUALS, "self.check_planes(q, VALUE_MIN, VALUE_MAX) for i, values",
     "self.check_planes(q, VALUE_MIN + 1, VALUE_MAX - 1)\n        for i, values"),
    ("SS-RC-002", RESIDUALS, 'self.check(q[0][i] >= q[1][i] >= q[2][i], "CONSTRAINT")', "pass"),
    ("SS-RC-002", RESIDUALS, "self.check(q[0][i] >= q[1][i] >= q[2][i],", "self.check(q[0][i] >= q[1][i],"),
    ("SS-RC-002", RESIDUALS, "self.check(q[0][i] >= q[1][i] >= q[2][i],", "self.check(q[1][i] >= q[2][i],"),
    ("SS-RC-002", RESIDUALS, "self.check(q[0][i] >= q[1][i] >= q[2][i],", "self.check(q[0][i] > q[1][i] > q[2][i],"),
    ("SS-RC-002", RESIDUALS, "self.check(q[0][i] >= q[1][i] >= q[2][i],",
     "self.check(q[0][i] >= self.parents[i].q[1] and q[0][i] >= q[1][i] >= self.parents[i].q[2] and q[1][i] >= q[2][i],"),
    ("SS-RC-002", RESIDUALS, "if self.context.seq.canonical_axes == 1: self.check(q[0][i]", "if True:\n"
     "                self.check(q[0][i]"),
    ("SS-RC-003", RESIDUALS, "v[k][i] * factors[i] << FINE_BITS", "v[k][i] << FINE_BITS"),
    ("SS-SH-001", RESIDUALS, "self.components(v if mode == 1 else self.looked_up(v), factors)",
     "[[clamp(x, -COMPONENT_MAX, COMPONENT_MAX) for x in plane] for plane in\n"
     "                         [[value * factor for value, factor in zip(row, factors)] for row in self.looked_up(v)]]\\\n"
     "                if mode == 2 else self.components(v, factors)"),

    # 7.7.4 and 7.7.6: feature_shift
    ("SS-PR-007", PREDICTION, "Round(x - y, shift) ** 2", "((x - y) >> shift) ** 2"),
    ("SS-PR-007", PREDICTION, "Round(x - y, shift) ** 2", "(Round(x, shift) - Round(y, shift)) ** 2"),
    ("SS-PR-007", PREDICTION, "Round(x - y, shift) ** 2", "Round((x - y) ** 2, shift)"),
    ("SS-PR-007", PREDICTION, "squares(values.dc, neighbour.dc, 6 + shift)", "squares(values.dc, neighbour.dc, 6)"),
    ("SS-PR-007", PREDICTION, "squares([values.o], [neighbour.o], shift)", "squares([values.o], [neighbour.o], 0)"),
    ("SS-TR-001", TRANSFORMER, "saturated(4 * apart(a, b))", "saturated(apart(4 * a, 4 * b))"),
    ("SS-TR-001", TRANSFORMER, "saturated(2 * apart(neighbour.o, o))", "saturated(2 * (neighbour.o - o))"),
    ("SS-TR-001", TRANSFORMER, "saturated(apart(a, b))", "saturated(a - b)"),
    ("SS-TR-001", TRANSFORMER, "12 + self.network.token_shift + self.feature_shift)", "12 + self.network.token_shift)"),

    # 8.4 and 8.5
    ("SS-LN-001", PARSING, "return ceil_div(self.n, self.lanes)", "return max(1, self.n // self.lanes)"),
    ("SS-LN-001", PARSING, "for place in range(self.strip) for lane in range(self.lanes))",
     "for lane in range(self.lanes) for place in range(self.strip))"),
    ("SS-LN-001", PARSING, "places = ((lane, lane * self.strip + place) for place in range(self.strip) for lane in range(self.lanes))",
     "places = ((i % self.lanes, i) for i in range(self.n))"),
    ("SS-LN-001", PARSING, "places = ((lane, lane * self.strip + place)", "places = ((lane, place * self.lanes + lane)"),
    ("SS-LN-002", PARSING, "own[max(i - count, i // self.strip * self.strip):i]", "[x or 0 for x in own[max(i - count, 0):i]]"),
    ("SS-LN-002", PARSING, "lengths[i] + lengths[i + 1]", "lengths[i] + (lengths[i + 1] if (i + 1) % self.strip else 0)"),
    ("SS-CX-001", PARSING, "rows = [[value * first for value in self.v(1)]]", "rows = [self.v(1)]"),
    ("SS-CX-001", PARSING, "rows.append([q - value * factor for", "rows.append([q - value for"),
    ("SS-CX-001", PARSING, "factors = [self.rule.factor(LOG_SCALE, [q]) for q in rows[0]]", "factors = [first] * self.n"),
    ("SS-CX-001", PARSING, "return [value * self.rule.factor(OPACITY, q) for value, q", "return [value for value, q"),
    ("SS-CX-001", PARSING, "self.exponents(ATTRIBUTES.index(plane.attribute))", "self.exponents(OPACITY)"),
    ("SS-CX-001", PARSING, "return [self.rule.exponent(attribute, q, o)", "return [self.rule.factor(attribute, q, o)"),
    ("SS-EC-005", MODELS, "if source == 11:\n        return after_log_scale", 'if source == 11:\n        return plane.section == "new"'),
    ("SS-PM-003", MODELS, 'require(source <= 11, "RESERVED"', 'require(source <= 10, "RESERVED"'),

    # 6.14
    ("SS-IN-013", SEMANTICS, "good = flags & MOVES or not flags & MOVE_PREDICTORS", "good = True"),
    ("SS-IN-013", SEMANTICS, "good = flags & PARENTS or not flags & EXTRAPOLATES_OPACITY", "good = True"),
    ("SS-IN-014", SEMANTICS, "check_prediction_flags(flags, dynamic, frame, flags_at)\n    u.predictors",
     "if dynamic:\n        check_prediction_flags(flags, dynamic, frame, flags_at)\n    u.predictors"),
    ("SS-IN-015", SEMANTICS, "require(not either or not frame.intra,", "require(not flags & MOVE_PREDICTORS or not frame.intra,"),
    ("SS-IN-015", SEMANTICS, "require(not either or not frame.intra,", "require(not flags & EXTRAPOLATES_OPACITY or not frame.intra,"),
    ("SS-IN-011", SEMANTICS, '("modes", "move_predictors", "moves",', '("modes", "moves", "move_predictors",'),

    # 7.4.6
    ("SS-PA-007", MOVES, "motion=difference(gaussian.position_fine, origin.position_fine)",
     "motion=difference(gaussian.position_fine, origin.position_fine) if gaussian != origin else gaussian.motion"),
    ("SS-PA-007", INCREMENT, "changed = self.with_changes(changed, modes)",
     "kept = self.with_changes(changed, modes)\n"
     "            changed = [new if mode else old for new, old, mode in zip(kept, changed, modes or [0] * len(kept))]"),
    ("SS-PA-007", INCREMENT, "changed_by_frame(g, origin) for g, origin in zip(changed, self.frame.origins(self.s, self.r))",
     "changed_by_frame(g, self.frame.cells.displaced(origin)) for g, origin in zip(changed, self.frame.origins(self.s, self.r))"),
    ("SS-PA-007", MOVES, "fade=gaussian.o - origin.o)", "fade=gaussian.o - origin.o - origin.fade)"),
    ("SS-PA-007", INCREMENT, "if not frame.intra:\n            changed =", "if self.header.predicts_moves:\n            changed ="),
    ("SS-PA-007", INCREMENT, "tuple(v.dc), tuple(v.sh), anchor)", "tuple(v.dc), tuple(v.sh), anchor, (64, 64, 64))"),
    ("SS-PA-007", INCREMENT, "tuple(v.dc), tuple(v.sh), anchor)", "tuple(v.dc), tuple(v.sh), anchor, (0, 0, 0), 1 - anchor)"),
    ("SS-PA-008", FRAME, "tz(self.reference.span() // self.span())", "0"),
    ("SS-PA-008", FRAME, "return self.index_in_gop - self.reference.index_in_gop",
     "return sorted(self.gop.frames).index(self.index_in_gop) - sorted(self.gop.frames).index(self.reference.index_in_gop)"
     " if self.index_in_gop in self.gop.frames else 1"),
    ("SS-PA-008", MOVES, "tuple(Round(x, gap) for x in origin.motion)", "tuple(x >> gap for x in origin.motion)"),
    ("SS-PA-008", MOVES, "Round(gaussian.fade, gap)", "(gaussian.fade >> gap)"),

    # 7.4.7
    ("SS-PA-009", MOVES, "require(CELLS <= value <= BOTH,", "require(CELLS <= value,"),
    ("SS-PA-009", MOVES, "require(CELLS <= value <= BOTH,", "require(value <= BOTH,"),
    ("SS-PA-010", MOVES, "predictors[move >> u.move_block_log2]", "predictors[min(i >> u.move_block_log2, len(predictors) - 1)]"),
    ("SS-PA-010", MOVES, "return x.by_cell\n        if", "return (0, 0, 0)\n        if"),
    ("SS-PA-010", MOVES, "return x.by_motion", "return x.half"),
    ("SS-PA-010", MOVES, "(y.half[k] if predictor == BOTH else 0)", "(y.half[k] if predictor == BOTH and y is x else 0)"),
    ("SS-PA-010", MOVES, "(y.half[k] if predictor == BOTH else 0)", "(y.half[k] if predictor == BOTH and y is not x else 0)"),
    ("SS-PA-010", MOVES, "tuple(Round(x, 1) for x in difference", "tuple(x >> 1 for x in difference"),
    ("SS-PA-010", MOVES, "(2 * sum(values) + len(values)) // (2 * len(values))", "sum(values) // len(values)"),
    ("SS-PA-010", MOVES, "(2 * sum(values) + len(values)) // (2 * len(values))", "int(sum(values) / len(values))"),
    ("SS-PA-004", MOVES, "[clamp(x + d, 0, limit) for x, d in", "[x + d for x, d in"),
    ("SS-PA-004", MOVES, "zip(space.own[i].origin, way)]", "zip(parents[i].position_fine, way)]"),
    ("SS-PA-011", MOVES, "self.order[max(0, place - MOVE_WINDOW):place]", "self.order[max(0, place - MOVE_WINDOW - 1):place]"),
    ("SS-PA-011", MOVES, "self.order[place + 1:place + 1 + MOVE_WINDOW]", "self.order[place + 1:place + MOVE_WINDOW]"),
    ("SS-PA-011", MOVES, "known = [y for y in candidates if y.motion is not None]",
     "known = [y for y in self.order if y.motion is not None and y is not x]"),
    ("SS-PA-011", MOVES, "known = [y for y in candidates if y.motion is not None]",
     "known = [y for y in candidates if y.motion is not None and y.rank[0] == x.rank[0]]"),
    ("SS-PA-011", MOVES, "(squared_distance(x, y), y.rank)", "(squared_distance(x, y), y.code, y.rank)"),
    ("SS-PA-011", MOVES, "(squared_distance(x, y), y.rank)", "(squared_distance(x, y), -y.rank[0], -y.rank[1])"),
    ("SS-PA-011", MOVES, "[:MOVE_NEIGHBOURS]", "[:MOVE_NEIGHBOURS + 1]"),
    ("SS-PA-011", MOVES, "key=lambda x: (x.code, x.rank)", "key=lambda x: (x.code, x.rank[::-1])"),
    ("SS-PA-011", MOVES, "key=lambda x: (x.code, x.rank)", "key=lambda x: x.rank"),
    ("SS-PA-011", MOVES, "self.position = canonical(displaced.position_fine)", "self.position = canonical(origin.position_fine)"),
    ("SS-PA-011", MOVES, "sum(d * d for d in difference(x.position, y.position))", "sum(map(abs, difference(x.position, y.position)))"),
    ("SS-PA-011", MOVES, "if mode in (SKIP, UPDATE):", "if mode == SKIP:"),
    ("SS-PA-011", MOVES, "if mode in (SKIP, UPDATE):", "if mode != MOVE and mode != MOVE_AND_UPDATE:"),
    ("SS-PA-011", MOVES, "if mode in (SKIP, UPDATE):", "if True:"),
    ("SS-PA-011", INCREMENT, "None if modes and modes[i] == REMOVE else result[i].motion", "result[i].motion"),

    # 7.4.8
    ("SS-PA-012", INCREMENT, "if not self.header.extrapolates_opacity:", "if True:"),
    ("SS-PA-012", MOVES, "clamp(gaussian.o + Round(gaussian.fade, gap), VALUE_MIN, VALUE_MAX)", "gaussian.o + Round(gaussian.fade, gap)"),
    ("SS-PA-012", FRAME, "result += [self.cells.displaced(g) for g in self.reference.lists[(top, h)]]",
     "result += [self.cells.displaced(g._replace(o=g.o + g.fade)) for g in self.reference.lists[(top, h)]]"),
    ("SS-PA-012", INCREMENT, "changed = self.extrapolated(parents)",
     "changed = [new if mode in (UPDATE, MOVE_AND_UPDATE) else old for new, old, mode in\n"
     "                   zip(self.extrapolated(parents), parents, modes or [0] * len(parents))]"),

    # positions are codes in all of decoding: no neighbours are found among expanded ones
    ("SS-PR-005", INCREMENT, "predict = prediction.NewPredictions(positions, kinds, references,",
     "from .output import expand\n"
     "        far = lambda position: tuple(expand(x, self.context.seq) for x in position)\n"
     "        predict = prediction.NewPredictions([far(x) for x in positions], kinds,\n"
     "                                            [x._replace(position=far(x.position)) for x in references],"),
    ("SS-PA-011", INCREMENT, "parents_of(self.r, origins, parents, self.frame.gap())",
     "parents_of(self.r, origins, parents, self.frame.gap())\n"
     "        from .output import expand\n"
     "        for x in self.parents:\n"
     "            x.position = tuple(expand(code, self.context.seq) for code in x.position)"),
]
