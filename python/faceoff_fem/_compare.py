"""Comparisons of two results."""

import json
import tempfile
from fnmatch import fnmatchcase
from pathlib import Path

import numpy as np

from . import _core
from ._adapters import NAME, is_function, memory, names, side
from ._arrays import Arrays
from ._program import framed, words
from .errors import Error, usage


class Comparison:
    """What two results have in common: prints as a table, is true where they agree, and shows as a page in notebooks."""

    def __init__(self, found, notes):
        self._found = found
        #: What was left out of the comparison.
        self.notes = notes
        self._json = None

    @property
    def agree(self):
        """Do all fields agree?"""
        return self._found.agree

    def __bool__(self):
        return self.agree

    @property
    def verdict(self):
        """``agree``, ``disagree``, or ``undetermined`` where something could not be judged."""
        return self._found.verdict

    def to_dict(self):
        """What the program writes with ``--json``."""
        if self._json is None:
            self._json = json.loads(self._found.json())
        return dict(self._json)

    @property
    def fields(self):
        """One dictionary a field, of all times and files: ``field``, ``on``, ``verdict``, ``max_abs``, ``max_rel``, ``rtol``,
        ``atol``, ``worst`` and norms; of several times also ``time`` and ``part``."""
        found = self.to_dict()
        if "parts" not in found:
            return found["fields"]
        return [
            {"part": part.get("name"), "time": part.get("time"), **field}
            for part in found["parts"]
            for field in (part.get("comparison") or {}).get("fields", [])
        ]

    @property
    def worst(self):
        """The field that is farthest beyond its tolerance; its ``worst`` says where, and what a and b have there."""

        def factor(field):
            difference = field["max_rel"] if field.get("max_rel") is not None else float("inf")
            return difference / field["tolerance"] if field["tolerance"] else difference

        wrong = [field for field in self.fields if field["verdict"] not in ("agree", "conditioned")]
        return max(wrong or self.fields, key=factor, default=None)

    def differences(self):
        """Places and values of a - b: ``{"points": (places, {name: values})}``, with arrays of shape (n, 3) and (n, components)."""
        return {on: (places, dict(fields)) for on, places, fields in self._found.differences()}

    def to_pandas(self):
        """A frame with a row a field."""
        import pandas

        return pandas.json_normalize(self.fields)

    def to_polars(self):
        """A frame with a row a field."""
        import polars

        rows = [{key: json.dumps(v) if isinstance(v, (dict, list)) else v for key, v in field.items()} for field in self.fields]
        return polars.DataFrame(rows, infer_schema_length=None)

    def report(self, folder):
        """Writes the page, ``index.html``, with figures and data into a folder: new, empty, or of an earlier report."""
        self._found.write(Path(folder))

    def __str__(self):
        notes = "".join(f"\n  note: {note}" for note in self.notes)
        return self._found.text() + notes

    __repr__ = __str__

    def _repr_html_(self):
        with tempfile.TemporaryDirectory(prefix="faceoff-") as folder:
            page = Path(folder, "page")
            self.report(page)
            return framed(page.joinpath("index.html").read_text(encoding="utf-8"))


def compare(a, b, *, rtol=None, atol=None, fields=None, name=None, **options):
    """Judges two results against each other, field by field; on meshes with other cells as functions.

    Args:
        a, b: each a path (file, folder, or pattern such as ``"u_*.vtu"``); a dolfinx ``Function``; ``(basis, x)`` of scikit-fem;
            an NGSolve ``GridFunction``; ``(mf, U)`` of GetFEM; a ``meshio.Mesh``; a PyVista or VTK grid; a :class:`Mesh`; or a
            dictionary of arrays. Its ``points`` are of shape (n, 2) or (n, 3), its ``cells`` ``{"triangle": (m, 3)}`` count points
            from 0 in Gmsh's order of nodes, and every other key is a field with one row for each point or cell; where the numbers
            of both are the same, put fields into ``point_data`` or ``cell_data``, and values at each corner of each cell in turn
            into ``corner_data``. Without ``points`` rows are compared one by one.
        rtol: a field agrees where |a-b| <= max(rtol * its largest value, atol); 1e-9 if not given.
        atol: in the unit of the field; 0 if not given.
        fields: tolerances of single fields, as ``{"u": {"rtol": 1e-6, "atol": 1e-12}}``, and what their problem leaves open, as
            ``{"p": {"up_to": "constant"}}``, or a list of ``constant``, ``sign``, ``scale``, ``phase``, ``rigid``, ``gradient``:
            that is taken away before they are compared. Names may be patterns.
        name: what a function is called; without it, as the only field of the other side.
        options: those of ``faceoff compare``, as ``only=["u"]``, ``except_=["p"]``, ``pair=["speed=|u|"]``, ``map="functions"``,
            ``nan_equal=["u"]``, ``place_tolerance=1e-9``, ``uncovered=0.01``, ``dim=2``, ``times="last"``, ``out="d.vtu"``.

    Returns:
        Comparison: true where all fields agree.

    Raises:
        Error: what cannot be compared; :class:`FileError` and :class:`UsageError` are kinds of it.

    Arrays are compared where they are, without the GIL: let no other thread write to them meanwhile. Afterwards they may change:
    the result speaks of what was compared.

    >>> import faceoff_fem as fo
    >>> square = {"points": [[0, 0], [1, 0], [0, 1], [1, 1]], "cells": {"triangle": [[0, 1, 2], [1, 3, 2]]}}
    >>> r = fo.compare({**square, "u": [0.0, 1, 2, 3]}, {**square, "u": [0.0, 1, 2, 3.5]}, rtol=1e-8)
    >>> r.agree, r.worst["field"], r.worst["worst"]["midpoint"]
    (False, 'u', [1.0, 1.0])
    """
    for field, bounds in (fields or {}).items():
        if not set(bounds) <= {"rtol", "atol", "up_to"} or not bounds:
            raise usage(f"the tolerances of {field!r} are {bounds}", "give rtol, atol or up_to")
        text = {key: value if isinstance(value, str) else "+".join(value) if key == "up_to" else repr(value) for key, value in bounds.items()}
        given = ",".join(f"{key}={value}" for key, value in text.items())
        options.setdefault("field", []).append(f"{field}:{given}")
    sides = [side(a, name), side(b, name)]
    _refuse_one_memory((a, b), sides, options)
    unnamed = [is_function(thing) and name is None for thing in (a, b)]
    for k in (0, 1):
        if unnamed[k]:
            called = NAME if unnamed[1 - k] else _only_name(sides[1 - k])
            sides[k].rename(called)
    notes = []
    if any(map(is_function, (a, b))) and not options.get("only"):
        options["only"] = names(sides[0] if is_function(a) else sides[1])
    # Takes the sides out of the list: what an adapter made is not kept beside what the comparison makes of it.
    found, told = _core.compare(sides, [*words({"rtol": rtol, "atol": atol, **options})])
    return Comparison(found, notes + told)


def _refuse_one_memory(things, sides, options):
    """Refuses two results that are one buffer, as of a solver that writes into what it returned before: they agree whatever it holds."""
    remedy = "keep a copy of the first before the second is computed, as with numpy.copy"
    if things[0] is things[1] and not isinstance(sides[0], Path):
        raise usage("both are the same object", remedy)
    one, other = (_memories(thing, of) for thing, of in zip(things, sides))
    only, left_out = (options.get(key) for key in ("only", "except_"))
    only, left_out = ([of] if isinstance(of, str) else of for of in (only, left_out))
    for name, part, a in one:
        is_asked = name is None or only is None or any(fnmatchcase(name, of) for of in only)
        if not is_asked or name is not None and any(fnmatchcase(name, of) for of in left_out or ()):
            continue
        for known, of, b in other:
            is_pair = None in (name, known) or name == known or options.get("pair")
            if is_pair and part == of and _share(a, b):
                what = "the dofs of both are" if name is None else f"the field {name!r} is"
                or_else = "" if name is None else f"; or leave it out, as except_=[{name!r}]"
                raise usage(f"{what} the same memory in both", remedy + or_else)


def _memories(thing, of):
    """What a result is in memory: the name of a field (None of a function), the part of it that counts, and the array."""
    whole = memory(thing)
    if whole is not None:
        return [(None, *whole)]
    return [(name, (), array) for name, array in of.given.items()] if isinstance(of, Arrays) else []


def _share(a, b):
    """Do two arrays have an element in common? Where that would take long to find out, they may."""
    if not np.may_share_memory(a, b):
        return False
    try:
        return np.shares_memory(a, b, max_work=10**6)
    except Exception as error:
        # Its class has another place in older versions.
        if type(error).__name__ != "TooHardError":
            raise
        return True


def _only_name(other):
    """The name of the field that a function is compared with."""
    of = other
    if isinstance(other, Path):
        if other.is_dir() or any(c in other.name for c in "*?[") or other.suffix == ".pvd":
            return NAME
        try:
            of = _core.read(other)
        except Error:
            if other.suffix.lower() == ".csv":
                return NAME
            raise
    known = names(of)
    # A complex field has two parts.
    if [name.partition(" (")[2] for name in known] == ["real)", "imaginary)"]:
        known = sorted({name.partition(" (")[0] for name in known})
    if len(known) == 1:
        return known[0]
    if NAME in known:
        return NAME
    source = str(other) if isinstance(other, Path) else of.source
    if not known:
        raise usage("it has no field", "give a result with a field", source)
    raise usage(f"it has the fields {', '.join(known)}", "say which one the function is, as name='u'", source)


def assert_agree(a, b, **options):
    """Raises an AssertionError with the table where two results do not agree; takes what :func:`compare` takes.

    >>> import faceoff_fem as fo
    >>> fo.assert_agree({"u": [1.0, 2.0]}, {"u": [1.0, 2.0 + 1e-12]})
    """
    __tracebackhide__ = True
    found = compare(a, b, **options)
    if not found.agree:
        raise AssertionError(str(found))
