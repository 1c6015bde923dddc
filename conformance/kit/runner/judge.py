"""Whether an answer is right. The files are hashed here; digests of the decoder are not trusted."""

import os
import re

from suite import sha256

CLASSES = {10: "malformed", 11: "invalid", 12: "unsupported", 13: "over-limit", 14: "truncated"}
PLANES = re.compile(r"f(\d{4,})\.(position|log_scale|opacity|rotation|dc|sh)\.i32$")
FLOATS, ENTROPY = re.compile(r"f(\d{4,})\.f32$"), re.compile(r"u(\d{4,})\.entropy$")


def not_claimed(case, what):
    return result(case, "not-claimed", detail="%s is not claimed" % what)


def result(case, outcome, reason=None, detail=None, answer=None, warnings=()):
    """A case of the report (schema/report.schema.json)."""
    record = case.record
    found = {"vector": record["name"], "area": record["area"], "kind": record["kind"], "op": case.op, "mode": case.mode,
             "outcome": outcome, "reason": reason, "expected": " or ".join(words(verdict) for verdict in case.verdicts()),
             "answer": answer, "detail": detail, "warnings": list(warnings)}
    return {key: value for key, value in found.items() if value not in (None, [])}


def words(verdict):
    return " ".join([verdict["class"], verdict.get("code", "")]).strip() if "class" in verdict else "accept"


def judge(case, answer, out, settings, claim):
    if answer.code != 0 and answer.code not in CLASSES:
        ending = answer.ending or "exit code %d" % answer.code
        outcome = "timeout" if ending == "timeout" else "crash"
        return result(case, outcome, detail=answer.message or None, answer=ending)
    said = "accept" if answer.code == 0 else CLASSES[answer.code]
    right = [verdict for verdict in case.verdicts() if verdict.get("class", "accept") == said]
    if not right:
        return contradiction(case, said, answer)
    code = answer.said.get("code")
    verdict = next((verdict for verdict in right if code and verdict.get("code") == code), right[0])
    faults, warnings = [], []
    faults += wrong_lost(case, answer)
    for complaint in wrong_code(right, verdict, answer):
        if settings.strict:
            faults.append(("wrong-code", complaint))
        else:
            warnings += [complaint] if code else []
    # The record says what is output if the stream is accepted, or if every right answer is a rejection.
    if "class" not in verdict or "class" in case.record["expect"]:
        faults += wrong_files(case, out, claim)
    reason, detail = faults[0] if faults else (None, None)
    return result(case, "fail" if faults else "pass", reason, detail, said, warnings)


def contradiction(case, said, answer):
    accepts = "class" not in case.verdicts()[0]
    if accepts and said in ("unsupported", "over-limit", "truncated"):
        return result(case, said, detail=answer.message or None, answer=said)
    reason = "wrong-outcome" if accepts or said == "accept" else "wrong-class"
    return result(case, "fail", reason, answer.message or None, said)


def wrong_lost(case, answer):
    """Ranges of lost frames, where both the decoder and the record have them."""
    lost = answer.said.get("lost")
    if case.row is None or lost is None or lost == case.row.get("lost", []):
        return []
    return [("wrong-lost", "the lost frames are %s and should be %s" % (lost, case.row.get("lost", [])))]


def wrong_code(right, verdict, answer):
    if "class" not in verdict:
        return
    code, kind = answer.said.get("code"), answer.said.get("class")
    if kind not in (None, verdict["class"]):
        yield "the JSON object says %s, the exit code %s" % (kind, verdict["class"])
    if code is None:
        yield "no code: the last line on standard error is not a JSON object with one"
    elif "code" in verdict and code != verdict["code"]:
        yield "the code is %s and should be %s" % (code, " or ".join(v["code"] for v in right if "code" in v))


def files(out):
    """What was written: digests by name, states of entropy by unit, and what should not be there."""
    digests, entropy, extra = {}, {}, []
    for name in sorted(os.listdir(out)):
        path = os.path.join(out, name)
        is_file = os.path.isfile(path) and not os.path.islink(path)
        if is_file and (PLANES.match(name) or FLOATS.match(name)):
            with open(path, "rb") as f:
                digests[name] = sha256(f.read())
        elif is_file and ENTROPY.match(name):
            with open(path, encoding="ascii", errors="replace") as f:
                entropy[int(ENTROPY.match(name)[1])] = f.read().strip()
        elif name != "meta.json" or not is_file:
            extra.append(name)
    return digests, entropy, extra


def wrong_files(case, out, claim):
    """Faults of the files of a case, the gravest first."""
    digests, entropy, extra = files(out)
    states = case.states()
    if states is None:
        return [("extra-files", naming("not expected", extra))] if extra else []
    wanted = {"f%04d.%s.i32" % (state["frame"], name): digest for state in states for name, digest in state["planes"].items()}
    floats = {"f%04d.f32" % state["frame"]: state["f32"] for state in states if "f32" in state}
    missing = [name for name in wanted if name not in digests]
    wrong = [name for name in wanted if name in digests and digests[name] != wanted[name]]
    shown = {state["frame"] for state in states}
    stray = [name for name in digests if name not in wanted and not (FLOATS.match(name) and int(FLOATS.match(name)[1]) in shown)]
    other = [name for name in floats if digests.get(name, floats[name] if not claim["output"] else None) != floats[name]]
    faults = [("missing-files", naming("missing", missing)), ("wrong-planes", naming("different", wrong)),
              ("extra-files", naming("not expected", extra + stray)),
              ("wrong-output", naming("the planes are right, but not", other)),
              ("wrong-entropy", wrong_entropy(case, entropy, claim))]
    return [(reason, detail) for reason, detail in faults if detail]


def wrong_entropy(case, entropy, claim):
    """States of entropy: those that exist, and all of the highest point if they are claimed."""
    units = case.record.get("units", [])
    if not units or "inside" in case.record:
        return None
    is_obliged = claim["entropy"] and case.is_extreme(True) and "class" not in case.record["expect"]
    wanted = {number: unit["entropy"] for number, unit in enumerate(units) if "entropy" in unit}
    for number in sorted(set(wanted) | set(entropy)):
        if number in entropy and entropy[number] != wanted.get(number):
            return "u%04d.entropy is %s and should be %s" % (number, entropy[number], wanted.get(number, "absent"))
        if is_obliged and number not in entropy:
            return "u%04d.entropy is claimed and missing" % number
    return None


def naming(what, names):
    """`missing: a, b and 3 more`; None for no names."""
    if not names:
        return None
    more = " and %d more" % (len(names) - 2) if len(names) > 2 else ""
    return "%s: %s%s" % (what, ", ".join(names[:2]), more)
