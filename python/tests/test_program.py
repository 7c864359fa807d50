"""The commands of the program through Python."""

import subprocess
import sys
import sysconfig
from pathlib import Path

import numpy as np
import pytest
from common import sampled

import faceoff_fem as fo


def test_the_program_is_on_the_path():
    program = Path(sysconfig.get_path("scripts"), "faceoff")
    for line in ([program], [sys.executable, "-m", "faceoff_fem"]):
        said = subprocess.run([*line, "--version"], capture_output=True, text=True, check=True)
        assert said.stdout.split() == ["faceoff", fo.__version__]
        said = subprocess.run([*line, "compare", "no-a.vtu", "no-b.vtu"], capture_output=True, text=True, check=False)
        assert said.returncode == 2 and "no-a.vtu" in said.stderr


def test_solve_judge_and_certify():
    solution = fo.solve("one-zone", n=8, method="p1")
    assert solution.agree and solution["converged"] and solution["dofs"] == 81
    u = next(field for field in solution.mesh.fields if field.name.startswith("u"))
    points, cells = solution.mesh.points, dict(solution.mesh.cells)
    given = {"points": points, "cells": {"triangle": cells["triangle"]}, "point_data": {"u": u.values}}
    judged = fo.judge(given, "one-zone", method="p1")
    assert judged.agree, judged
    wrong = u.values.copy()
    # At one vertex, which all its cells have.
    wrong[(points == points[40]).all(axis=1)] *= 1.001
    judged = fo.judge({**given, "point_data": {"u": wrong}}, "one-zone", method="p1")
    assert not judged.agree and judged.verdict == "disagree"
    assert fo.certify(given, "one-zone", element="p1").agree


def test_orders_of_results_of_any_code():
    def f(x, y):
        return np.sin(2 * x) * np.cos(y)

    found = fo.orders([sampled(f, n, skew=0) for n in (4, 8, 16)], exact="sin(2*x)*cos(y)")
    rate = str(found)
    assert found.agree and "2.0" in rate or "1.9" in rate, found


def test_errors_of_the_program_are_exceptions(tmp_path):
    with pytest.raises(fo.Error, match="no-such-scene"):
        fo.solve("no-such-scene")
    with pytest.raises(fo.Error):
        fo.judge(sampled(lambda x, y: x), "one-zone", method="p1", no_such=1)
    page = tmp_path / "page"
    fo.orders(scenes=["one-zone"], n=[4, 8], methods=["p1"], report=page)
    assert (page / "index.html").exists()


@fo.engine(version="7")
def broken(case):
    """Zero, which solves nothing."""
    return np.zeros((len(case.cells), len(case.nodes())))


@fo.engine
def fails(case):
    raise RuntimeError(f"cannot do {case.element}")


def test_a_function_that_answers_wrongly_disagrees_and_one_that_raises_is_told():
    found = fo.verify("one-zone", engines=["rust", broken], methods=["cr"], n=4)
    assert not found.agree
    with pytest.raises(fo.Error, match="cannot do CR"):
        fo.verify("one-zone", engines=["rust", fails], methods=["cr"], n=4)
