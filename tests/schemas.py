"""Holds files against their schemas: `schemas.py xsd SCHEMA FILE`, or `json`, or `toml`."""

import json
import sys
import tomllib

kind, schema, file = sys.argv[1:]
if kind == "xsd":
    from lxml import etree

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
    import jsonschema

    with open(schema) as text:
        validator = jsonschema.Draft202012Validator(json.load(text))
    validator.check_schema(validator.schema)
    with open(file, "rb") as text:
        validator.validate(json.load(text) if kind == "json" else tomllib.load(text))
