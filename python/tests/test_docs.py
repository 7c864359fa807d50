"""What the documentation shows runs, and no public name is without an example."""

import doctest
import importlib.util
import re
from pathlib import Path

import pytest

import faceoff_fem as fo

DOCS = Path(__file__).parents[2] / "docs" / "python.md"


def test_every_example_of_the_page_runs(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    names, ran = {}, 0
    for block in re.findall(r"```python\n(.*?)```", DOCS.read_text(encoding="utf-8"), re.DOTALL):
        needs = [library for library in ("dolfinx", "skfem") if library in block]
        if all(importlib.util.find_spec(library) for library in needs):
            exec(compile(block, str(DOCS), "exec"), names)
            ran += 1
    assert ran >= 7


@pytest.mark.parametrize("module", ["", "_compare", "_mesh", "_program", "_engine"])
def test_every_example_of_the_docstrings_runs(tmp_path, monkeypatch, module):
    monkeypatch.chdir(tmp_path)
    found = importlib.import_module(f"faceoff_fem.{module}".rstrip("."))
    failed, ran = doctest.testmod(found)
    assert ran and not failed


def test_every_public_name_is_documented_with_an_example():
    page = DOCS.read_text(encoding="utf-8")
    for name in fo.__all__:
        assert re.search(rf"fo\.{name}\b", page), name
        assert name == "__version__" or getattr(fo, name).__doc__, name
        if callable(getattr(fo, name)) and name[0].islower():
            assert ">>>" in getattr(fo, name).__doc__, name
