"""What the documentation shows runs, and no public name is without an example."""

import ast
import doctest
import importlib.util
import inspect
import re
from pathlib import Path

import pytest

import faceoff_fem as fo

DOCS = Path(__file__).parents[2] / "docs" / "python.md"
BLOCKS = re.findall(r"```python\n(.*?)```", DOCS.read_text(encoding="utf-8"), re.DOTALL)
MODULES = [importlib.import_module(f"faceoff_fem.{name}") for name in ("_compare", "_mesh", "_program", "_engine")]
#: What blocks need; each of them runs in one of the environments of tests/python.rs.
LIBRARIES = ("dolfinx", "skfem", "meshio", "pandas", "polars")


def test_every_example_of_the_page_runs(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    names, ran = {}, 0
    for block in BLOCKS:
        needs = [library for library in LIBRARIES if library in block]
        if all(importlib.util.find_spec(library) for library in needs):
            exec(compile(block, str(DOCS), "exec"), names)
            ran += 1
    assert ran >= 8


@pytest.mark.parametrize("module", [fo, *MODULES])
def test_every_example_of_the_docstrings_runs(tmp_path, monkeypatch, module):
    monkeypatch.chdir(tmp_path)
    failed, ran = doctest.testmod(module)
    assert ran and not failed


def public():
    """Names of the package, and those of its classes, as the stubs have them."""
    stubs = ast.parse(Path(fo.__file__).with_suffix(".pyi").read_text(encoding="utf-8"))
    for of in stubs.body:
        if isinstance(of, (ast.FunctionDef, ast.ClassDef)):
            yield of.name
        for member in getattr(of, "body", ()) if isinstance(of, ast.ClassDef) else ():
            name = member.target.id if isinstance(member, ast.AnnAssign) else getattr(member, "name", "_")
            if not name.startswith("_"):
                yield name


def test_every_public_name_is_in_an_example_that_runs():
    parser = doctest.DocTestParser()
    documents = [inspect.getdoc(thing) or "" for module in MODULES for thing in vars(module).values() if inspect.getmodule(thing) is module]
    examples = [example.source for text in documents for example in parser.get_examples(text)]
    code = ast.walk(ast.parse("\n".join([*BLOCKS, *examples])))
    used = {node.attr for node in code if isinstance(node, ast.Attribute)}
    assert set(fo.__all__) <= {*public(), "__version__"}
    assert {name for name in {*public(), "__version__"} if name not in used} == set()


def test_every_public_name_says_what_it_is():
    for name in set(fo.__all__) - {"__version__"}:
        of = getattr(fo, name)
        assert of.__doc__, name
        if inspect.isfunction(of):
            assert ">>>" in of.__doc__, name
