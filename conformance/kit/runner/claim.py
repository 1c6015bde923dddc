"""What a decoder claims to support (schema/capabilities.schema.json). Cases that need more are not run."""

import json

SCHEMA = "splatstream-capabilities/1"
KEYS = {"schema", "name", "profiles", "level", "features", "modes", "points", "entropy", "output"}
FEATURES = {"predicted", "b-frames", "spatial-layers", "prefixes", "sh", "vq", "cells", "carried", "learned",
            "full-attention", "several-gops", "subset"}


class ClaimError(Exception):
    """A claim that is not one, in words."""


def everything(name):
    return complete({"schema": SCHEMA, "name": name})


def complete(claim):
    """The claim with all keys but `features`, which stays out if all are claimed."""
    return {"profiles": [0, 1], "level": 4, "modes": ["full", "subset", "inside"], "points": "all", "entropy": False,
            "output": False, **claim}


def read(path):
    with open(path, encoding="utf-8") as f:
        claim = json.load(f)
    if claim.get("schema") != SCHEMA or not claim.get("name"):
        raise ClaimError("%s: a claim has a name and the schema %s" % (path, SCHEMA))
    unknown = sorted(set(claim) - KEYS) + sorted(set(claim.get("features", [])) - FEATURES)
    if unknown:
        raise ClaimError("%s: unknown words: %s" % (path, ", ".join(unknown)))
    return complete(claim)


def missing(claim, case):
    """What a case needs that is not claimed; None if everything is. A stream of a claimed profile that every decoder shall
    call unsupported, and of which nothing is shown, needs nothing else."""
    record = case.record
    if record["profile"] not in claim["profiles"]:
        return "profile %d" % record["profile"]
    if record["expect"].get("class") == "unsupported" and not record.get("states"):
        return None
    if record["level"] > claim["level"]:
        return "level %d" % record["level"]
    for feature in record["features"]:
        if feature not in claim.get("features", FEATURES):
            return "feature %s" % feature
    if case.mode not in claim["modes"]:
        return "mode %s" % case.mode
    has_point = {"all": True, "full": case.is_extreme(True), "base": case.is_extreme(False)}[claim["points"]]
    return None if has_point else "operating point %s" % case.op
