"""Figures of a measurement of speed, and their tables in Markdown."""

import statistics

COLUMNS = ["", "codec", "bytes", "bits per Gaussian", "M Gaussians per core-second", "best", "M Gaussians per second",
           "best", "ratio, processor", "of the best", "ratio, clock"]


def ratio(row, baseline, key):
    """How many times as fast as the baseline: the median over rounds, in each of which both were measured."""
    pairs = list(zip(row[key], baseline[key]))
    if not pairs or any(seconds <= 0 for pair in pairs for seconds in pair):
        return None
    return statistics.median(theirs / own for own, theirs in pairs)


def baseline_of(rows, names):
    """The rows that ratios refer to, by kind of work, of the first codec of `names` that was measured."""
    for name in names:
        found = {row["work"]: row for row in rows if row["codec"] == name}
        if found:
            return name, found
    return None, {}


def markdown(scene, rows, names):
    """The table of a scene."""
    baseline, found = baseline_of(rows, names)
    frames = "" if scene["frames"] == 1 else ", %d frames" % scene["frames"]
    lines = ["**%s**: %s Gaussians%s, SH degree %d. Ratios are times as fast as %s." % (
        scene["scene"], format(scene["gaussians"], ","), frames, scene["sh_degree"], baseline or "nothing measured")]
    lines += ["", "| %s |" % " | ".join(COLUMNS), "|---|---|" + "--:|" * (len(COLUMNS) - 2)]
    for row in sorted(rows, key=lambda row: row["work"]):
        lines.append("| %s |" % " | ".join(_cells(row, scene["gaussians"], found.get(row["work"]))))
    return "\n".join(lines)


def _cells(row, gaussians, baseline):
    name = row["codec"] + (", " + row["options"] if row["options"] else "")
    size, bits = "", ""
    if row["bytes"] is not None:
        size, bits = format(row["bytes"], ","), "%.1f" % (8 * row["bytes"] / gaussians)
    cells = [row["work"], name, size, bits]
    for key in ("cpu_s", "wall_s"):
        cells += [_speed(gaussians, statistics.median(row[key])), _speed(gaussians, min(row[key]))]
    ratios = [baseline and of_row(row, baseline) for of_row in (_of_processor, _of_best, _of_clock)]
    return cells + ["" if times is None else "%.2g" % times for times in ratios]


def _of_processor(row, baseline):
    return ratio(row, baseline, "cpu_s")


def _of_best(row, baseline):
    best = {"cpu_s": [min(row["cpu_s"])]}
    return ratio(best, {"cpu_s": [min(baseline["cpu_s"])]}, "cpu_s")


def _of_clock(row, baseline):
    return ratio(row, baseline, "wall_s")


def _speed(gaussians, seconds):
    return "%.3g" % (gaussians / seconds / 1e6) if seconds > 0 else ""
