"""A plugin for pytest: the fixtures ``assert_agree`` and ``faceoff_regression``.

The page of a failure lies in a folder of its own, which the failure names: below ``--faceoff-pages``, or pytest's own temporary
folder. It is a property of the test in JUnit's XML, and is shown in the page of pytest-html.
"""

import json
import os
import platform
import re
import sys
from pathlib import Path

import pytest


def pytest_addoption(parser):
    group = parser.getgroup("faceoff")
    group.addoption("--faceoff-record", action="store_true", help="keep what faceoff_regression gets as what is right")
    group.addoption("--faceoff-pages", metavar="DIR", help="put the pages of failures into this folder")


class Checker:
    """Compares, and attaches the page of a failure to its test."""

    def __init__(self, request):
        self.request = request

    def _folder(self):
        item, config = self.request.node, self.request.config
        name = re.sub(r"[^\w.-]+", "_", item.nodeid)[-100:]
        chosen = config.getoption("--faceoff-pages")
        if not chosen:
            return self.request.getfixturevalue("tmp_path_factory").mktemp("faceoff") / name
        folder, k = Path(chosen, name), 1
        while folder.exists() and self.request.node.stash.get(_PAGES, 0) >= k:
            k += 1
            folder = Path(chosen, f"{name}-{k}")
        item.stash[_PAGES] = k
        folder.parent.mkdir(parents=True, exist_ok=True)
        return folder

    def __call__(self, a, b, **options):
        __tracebackhide__ = True
        from . import compare

        self.judged(compare(a, b, **options))

    def judged(self, found, remedy=""):
        """Fails where two results do not agree."""
        __tracebackhide__ = True
        if found.agree:
            return
        folder = self._folder()
        found.report(folder)
        page = folder / "index.html"
        item = self.request.node
        item.user_properties.append(("faceoff page", str(page)))
        if self.request.config.pluginmanager.hasplugin("html"):
            from pytest_html import extras

            item.stash.setdefault(_EXTRAS, []).append(extras.url(page.as_uri(), name="faceoff"))
        pytest.fail(f"{found}\n{remedy}page: {page}", pytrace=False)


_RECORDED = pytest.StashKey[list]()
_PAGES = pytest.StashKey[int]()
_EXTRAS = pytest.StashKey[list]()


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_makereport(item):
    outcome = yield
    extras, recorded = item.stash.get(_EXTRAS, None), item.stash.get(_RECORDED, None)
    report = outcome.get_result()
    if extras:
        report.extras = [*getattr(report, "extras", []), *extras]
    # What was kept as right was compared with nothing.
    if recorded and report.when == "call" and report.passed:
        path, line, _ = item.location
        report.outcome, report.longrepr = "skipped", (path, line or 0, f"recorded, not compared: {', '.join(recorded)}")


@pytest.fixture
def assert_agree(request):
    """``assert_agree(a, b, rtol=1e-8)``: fails with the table where two results do not agree; takes what ``compare`` takes."""
    return Checker(request)


class Regression(Checker):
    """Holds results against what was recorded beside the test."""

    def __init__(self, request):
        super().__init__(request)
        self.names = set()

    def __call__(self, result, name=None, *, rtol=None, atol=None, **options):
        """Compares with ``TESTFILE/TEST.vtu`` or ``TESTFILE/TEST-NAME.vtu``, which ``--faceoff-record`` writes.

        Tolerances are kept with the data, and hold unless others are given: ``rtol`` is 1e-8 if none ever was, which the
        rounding of another platform does not reach. Points and cells may be numbered otherwise.
        """
        __tracebackhide__ = True
        from . import compare, write

        test = re.sub(r"[^\w.-]+", "_", self.request.node.name)
        stem = f"{test}-{name}" if name else test
        if stem in self.names:
            pytest.fail(f"{stem} is recorded twice; give each result of a test a name", pytrace=False)
        self.names.add(stem)
        folder = self.request.path.with_suffix("")
        data, recipe = folder / f"{stem}.vtu", folder / f"{stem}.json"
        if self.request.config.getoption("--faceoff-record"):
            if any(os.environ.get(name) for name in ("CI", "BUILD_NUMBER", "TF_BUILD")):
                pytest.fail("--faceoff-record takes any result for right; record on your own machine, and keep the files", pytrace=False)
            folder.mkdir(exist_ok=True)
            write(data, result)
            rtol = 1e-8 if rtol is None else rtol
            _keep(recipe, self.request.node.nodeid, {"rtol": rtol, "atol": 0.0 if atol is None else atol, **options})
            self.request.node.stash.setdefault(_RECORDED, []).append(data.name)
            return
        if not (data.exists() and recipe.exists()):
            pytest.fail(f"nothing is recorded in {data}; run pytest with --faceoff-record, and keep the file", pytrace=False)
        kept = json.loads(recipe.read_text(encoding="utf-8"))
        given = {key: value for key, value in {"rtol": rtol, "atol": atol, **options}.items() if value is not None}
        found = compare(result, data, **{**kept["tolerances"], **given})
        made = ", ".join(f"{key} {value}" for key, value in kept["made by"].items())
        self.judged(found, f"{data} was recorded with {made}; where the new result is right: pytest --faceoff-record\n")


def _keep(recipe, test, tolerances):
    """How the data were made."""
    from . import __version__

    versions = {"faceoff": __version__, "python": platform.python_version(), "platform": platform.platform()}
    for library in ("numpy", "dolfinx", "skfem", "ngsolve", "getfem", "meshio", "pyvista"):
        version = getattr(sys.modules.get(library), "__version__", None)
        if version:
            versions[library] = str(version)
    text = json.dumps({"test": test, "made by": versions, "tolerances": tolerances}, indent=2)
    part = recipe.with_suffix(".part")
    part.write_text(text + "\n", encoding="utf-8")
    part.replace(recipe)


@pytest.fixture
def faceoff_regression(request):
    """``faceoff_regression(uh)``: holds a result against the one that was recorded; see :class:`Regression`."""
    return Regression(request)
