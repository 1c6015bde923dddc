"""Checks JSON values against the schemas in conformance/schema: the part of JSON Schema 2020-12 that they use."""

import json
import os
import re

from oracle_path import CONFORMANCE

TYPES = {"object": dict, "array": list, "string": str, "integer": int, "boolean": bool}
KNOWN = {"$schema", "$id", "$defs", "$ref", "title", "description", "type", "properties", "required",
         "additionalProperties",
         "items", "minItems", "uniqueItems", "enum", "const", "pattern", "minimum", "maximum", "minLength", "allOf",
         "if",
         "then", "else", "not"}
SCHEMAS = {}


def schema(name):
    if name not in SCHEMAS:
        with open(os.path.join(CONFORMANCE, "schema", name + ".schema.json"), encoding="utf-8") as f:
            SCHEMAS[name] = json.load(f)
    return SCHEMAS[name]


def problems(name, value):
    """What is wrong with a value, as lines; none if it is right."""
    root = schema(name)
    return list(check(root, root, value, "$"))


def check(root, rules, value, at):
    unknown = set(rules) - KNOWN
    if unknown:
        raise ValueError("not in the subset: %s" % sorted(unknown))
    if "$ref" in rules:
        yield from check(root, root["$defs"][rules["$ref"].rpartition("/")[2]], value, at)
    yield from check_value(rules, value, at)
    if isinstance(value, dict):
        yield from check_object(root, rules, value, at)
    if isinstance(value, list):
        yield from check_array(root, rules, value, at)
    for part in rules.get("allOf", []):
        yield from check(root, part, value, at)
    if "not" in rules and not any(True for _ in check(root, rules["not"], value, at)):
        yield at + " is what it must not be"
    if "if" in rules:
        holds = not any(True for _ in check(root, rules["if"], value, at))
        yield from check(root, rules.get("then" if holds else "else", {}), value, at)


def check_value(rules, value, at):
    kind = rules.get("type")
    if kind and (not isinstance(value, TYPES[kind]) or (kind == "integer" and isinstance(value, bool))):
        yield "%s is not of type %s" % (at, kind)
        return
    if "enum" in rules and value not in rules["enum"]:
        yield "%s is %r, which is not in the list" % (at, value)
    if "const" in rules and value != rules["const"]:
        yield "%s is %r, not %r" % (at, value, rules["const"])
    if isinstance(value, str):
        if "pattern" in rules and not re.search(rules["pattern"], value):
            yield "%s is %r, which does not match" % (at, value)
        if len(value) < rules.get("minLength", 0):
            yield at + " is too short"
    if isinstance(value, int) and not rules.get("minimum", value) <= value <= rules.get("maximum", value):
        yield "%s is %d, out of range" % (at, value)


def check_object(root, rules, value, at):
    for key in rules.get("required", []):
        if key not in value:
            yield "%s has no %s" % (at, key)
    properties = rules.get("properties", {})
    for key, part in value.items():
        if key in properties:
            yield from check(root, properties[key], part, "%s.%s" % (at, key))
        elif rules.get("additionalProperties") is False:
            yield "%s has an unknown %s" % (at, key)


def check_array(root, rules, value, at):
    if len(value) < rules.get("minItems", 0):
        yield at + " has too few entries"
    if rules.get("uniqueItems") and len({json.dumps(part, sort_keys=True) for part in value}) < len(value):
        yield at + " has an entry twice"
    for place, part in enumerate(value):
        yield from check(root, rules.get("items", {}), part, "%s[%d]" % (at, place))
