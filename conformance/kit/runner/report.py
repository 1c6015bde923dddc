"""The report of a run, as schema/report.schema.json has it."""

import datetime
import os
import platform

OUTCOMES = ("pass", "fail", "unsupported", "over-limit", "truncated", "crash", "timeout", "not-claimed", "expected-failure")
FAILURES = OUTCOMES[1:7]
NAME, VERSION = "splatstream-conformance-python", "1"


def tally(cases, claimed, results):
    """Counts of cases of the whole suite and of their results."""
    found = [results.get(case.name) for case in cases if case.name in claimed]
    ran = [outcome for outcome in found if outcome is not None]
    return {"cases": len(cases), "claimed": len(found), "run": len(ran), "pass": ran.count("pass")}


def features(cases):
    """Cases of valid vectors by feature of the stream, and by profile."""
    by = {}
    for case in cases:
        if case.record["kind"] == "valid":
            for name in case.record["features"] + ["profile %d" % case.record["profile"]]:
                by.setdefault(name, []).append(case)
    return by


def report(suite, settings, claim, claimed, rows):
    """`claimed` has the names of the cases of the suite that the decoder claims, `rows` the results of those selected."""
    results, cases = {"%(vector)s@%(op)s/%(mode)s" % row: row["outcome"] for row in rows}, suite.cases()
    record = {"version": suite.version, "specification": suite.specification, "changed": suite.changed,
              "vectors": len(suite.vectors), "sha256": suite.sha256}
    counted = lambda part: tally(part, claimed, results)
    return {
        "schema": "splatstream-report/3", "date": datetime.datetime.now(datetime.timezone.utc).date().isoformat(),
        "suite": {key: value for key, value in record.items() if value not in (None, "")},
        "runner": {"name": NAME, "version": VERSION},
        "system": {"os": platform.system().lower(), "arch": platform.machine(), "processors": os.cpu_count() or 1},
        "decoder": claim,
        "settings": {"strict": settings.strict, "selection": {"filter": settings.filter} if settings.filter else {},
                     "limits": {"time_ms": int(1000 * settings.time), "memory_bytes": settings.memory,
                                "output_bytes": settings.output}},
        "summary": {outcome: sum(row["outcome"] == outcome for row in rows) for outcome in OUTCOMES},
        "all": counted(cases), "broken": counted([case for case in cases if case.record["kind"] != "valid"]),
        "features": {name: counted(part) for name, part in sorted(features(cases).items())},
        "stale": [], "cases": rows,
    }
