"""The plugin for pytest, run by pytest."""

import json

import pytest

pytest_plugins = ["pytester"]

TEST = """
import numpy as np, pytest
square = {{"points": [[0, 0], [1, 0], [0, 1], [1, 1]], "cells": {{"triangle": [[0, 1, 2], [1, 3, 2]]}}}}

@pytest.mark.parametrize("k", range(4))
def test_u(faceoff_regression, k):
    faceoff_regression({{**square, "u": np.arange(4.0) + k + {change}}}, rtol={rtol})

def test_two(faceoff_regression):
    faceoff_regression({{**square, "u": np.ones(4)}}, "first")
    faceoff_regression({{**square, "u": np.ones(4)}}, "second")
"""


@pytest.fixture
def suite(pytester, monkeypatch):
    for name in ("CI", "BUILD_NUMBER", "TF_BUILD"):
        monkeypatch.delenv(name, raising=False)

    def run(*options, change=0.0, rtol=None):
        pytester.makepyfile(test_it=TEST.format(change=change, rtol=rtol))
        return pytester.runpytest_subprocess(*options)

    return run


@pytest.mark.parametrize("workers", [[], ["-n", "2"]])
def test_what_is_recorded_is_held_against(suite, pytester, workers):
    missing = suite(*workers)
    missing.assert_outcomes(failed=5)
    missing.stdout.fnmatch_lines(["*--faceoff-record*"])
    suite("--faceoff-record", *workers, rtol=1e-6).assert_outcomes(skipped=5)
    recipe = json.loads((pytester.path / "test_it" / "test_u_0_.json").read_text())
    assert recipe["tolerances"]["rtol"] == 1e-6 and recipe["made by"]["numpy"]
    suite(*workers).assert_outcomes(passed=5)
    if not workers:
        suite(change=1e-7).assert_outcomes(passed=5)
        suite(change=1e-5, rtol=1e-3).assert_outcomes(passed=5)
    pages = pytester.path / "pages"
    wrong = suite(*workers, "--faceoff-pages", str(pages), "--junitxml=junit.xml", change=1e-5)
    wrong.assert_outcomes(passed=1, failed=4)
    wrong.stdout.fnmatch_lines(["*disagree*", "*page: *index.html*"])
    assert len(list(pages.glob("*/index.html"))) == 4
    assert "faceoff page" in (pytester.path / "junit.xml").read_text()


def test_what_is_recorded_in_ci_is_not_taken_for_right(suite, pytester, monkeypatch):
    monkeypatch.setenv("CI", "true")
    found = suite("--faceoff-record")
    found.assert_outcomes(failed=5)
    found.stdout.fnmatch_lines(["*on your own machine*"])
    assert not list(pytester.path.rglob("*.vtu"))


def test_a_result_has_one_name(pytester, monkeypatch):
    for name in ("CI", "BUILD_NUMBER", "TF_BUILD"):
        monkeypatch.delenv(name, raising=False)
    pytester.makepyfile(
        """
        def test_it(faceoff_regression):
            square = {"points": [[0, 0], [1, 0], [0, 1]], "cells": {"triangle": [[0, 1, 2]]}, "u": [1.0, 2, 3]}
            faceoff_regression(square)
            faceoff_regression(square)
        """
    )
    found = pytester.runpytest_subprocess("--faceoff-record")
    found.assert_outcomes(failed=1)
    found.stdout.fnmatch_lines(["*recorded twice*"])


def test_assert_agree(pytester):
    pytester.makepyfile(
        """
        import faceoff_fem as fo, pytest
        def test_same(assert_agree):
            assert_agree({"u": [1.0, 2.0]}, {"u": [1.0, 2.0]})
        def test_other(assert_agree):
            assert_agree({"u": [1.0, 2.0]}, {"u": [1.0, 2.1]})
        def test_function():
            with pytest.raises(AssertionError, match="disagree"):
                fo.assert_agree({"u": [1.0, 2.0]}, {"u": [1.0, 2.1]})
        """
    )
    found = pytester.runpytest_subprocess()
    found.assert_outcomes(passed=2, failed=1)
    found.stdout.fnmatch_lines(["*page: *index.html*"])
