"""Holds files against their schemas: each line of the input is `xsd`, `json` or `toml`, the schema and the file, with tabs between,
and is answered by one line: nothing, or what is wrong. One process for many files, since it starts slower than it judges."""

import functools
import json
import sys
import tomllib

import jsonschema
from lxml import etree


@functools.cache
def validator(schema):
    with open(schema) as text:
        made = jsonschema.Draft202012Validator(json.load(text))
    made.check_schema(made.schema)
    return made


def judge(kind, schema, file):
    if kind == "xsd":
        tree = etree.parse(file)
        etree.XMLSchema(etree.parse(schema)).assertValid(tree)
        for node in [tree.getroot(), *tree.getroot().iter("testsuite")]:
            cases = list(node.iter("testcase"))
            counts = {
                "tests": len(cases),
                "failures": sum(case.find("failure") is not None for case in cases),
                "errors": sum(case.find("error") is not None for case in cases),
            }
            told = {name: int(node.get(name)) for name in counts}
            assert told == counts, (node.get("name"), told, counts)
    else:
        with open(file, "rb") as text:
            validator(schema).validate(json.load(text) if kind == "json" else tomllib.load(text))


for line in sys.stdin:
    try:
        judge(*line.rstrip("\n").split("\t"))
        print(flush=True)
    except (jsonschema.ValidationError, etree.LxmlError, AssertionError) as error:
        print(type(error).__name__, *str(error).split(), flush=True)
