"""Comparisons of arrays and files, with NumPy alone."""

import gc
import json
import os
import signal
import subprocess
import sys
import threading
import warnings
from copy import deepcopy

import numpy as np
import pytest
from common import SQUARE, linear, quadratic, sampled, square

import faceoff_fem as fo

U = np.array([0.0, 1.0, 2.0, 3.0])


def test_equal_arrays_agree_and_one_value_that_differs_is_found():
    a = {**SQUARE, "u": U}
    assert fo.compare(a, {**SQUARE, "u": U.copy()})
    for k in range(4):
        other = U.copy()
        other[k] += 1e-6
        r = fo.compare(a, {**SQUARE, "u": other})
        assert not r.agree and r.verdict == "disagree"
        assert r.worst["worst"]["midpoint"] == [float(x) for x in SQUARE["points"][k]]
        assert r.worst["max_abs"] == pytest.approx(1e-6, rel=1e-6)
        assert fo.compare(a, {**SQUARE, "u": other}, rtol=1e-6)
        assert fo.compare(a, {**SQUARE, "u": other}, fields={"u": {"atol": 2e-6}})


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_what_is_not_finite_is_no_pass(bad):
    b = U.copy()
    b[2] = bad
    assert not fo.compare({**SQUARE, "u": U}, {**SQUARE, "u": b})
    assert not fo.compare({**SQUARE, "u": b}, {**SQUARE, "u": b.copy()})
    if np.isnan(bad):
        assert fo.compare({**SQUARE, "u": b}, {**SQUARE, "u": b.copy()}, nan_equal=["u"])


def test_a_missing_field_is_no_pass_and_what_is_left_out_is_told():
    a, b = {**SQUARE, "u": U, "v": U}, {**SQUARE, "u": U.copy()}
    assert not fo.compare(a, b)
    r = fo.compare(a, b, only=["u"])
    assert r and "v" in " ".join(r.notes) and "v" in str(r)
    assert fo.compare(a, b, except_=["v"])


def test_numbering_does_not_matter_and_connectivity_does():
    points, cells = square(6, skew=0.3)
    u = quadratic(*points.T)
    rng = np.random.default_rng(1)
    order = rng.permutation(len(points))
    inverse = np.argsort(order)
    a = {"points": points, "cells": {"triangle": cells}, "u": u}
    b = {"points": points[order], "cells": [("triangle", inverse[cells][rng.permutation(len(cells))])], "u": u[order]}
    assert fo.compare(a, b)
    b["u"] = u.copy()
    assert not fo.compare(a, b)


def test_other_meshes_are_compared_as_functions():
    a, b = sampled(quadratic, 4, 2), sampled(quadratic, 7, 2, skew=0.4)
    r = fo.compare(a, b, rtol=1e-12)
    assert r.agree and r.to_dict()["map"] == "functions"
    # Two nodes of each cell change places: the wrong order is seen.
    wrong = {**b, "cells": {"triangle6": b["cells"]["triangle6"][:, [0, 1, 2, 3, 5, 4]]}}
    with pytest.raises(fo.Error, match="folded"):
        fo.compare(a, wrong, rtol=1e-3)


def test_arrays_of_all_kinds():
    points, cells = square(2)
    mesh = {"points": points, "cells": {"triangle": cells}}
    vector = np.stack([points[:, 0], points[:, 1]], axis=1)
    given = {
        **mesh,
        "vector": vector,
        "float32": points[:, 0].astype("f4"),
        "integers": np.arange(9),
        "big": points[:, 1].astype(">f8"),
        "bool": points[:, 0] > 0.4,
        "complex": points[:, 0] + 1j * points[:, 1],
        "of cells": np.arange(8.0),
        "corner_data": {"of corners": linear(*points[cells].reshape(-1, 2).T)},
    }
    r = fo.compare(given, deepcopy(given))
    assert r.agree
    found = {(field["field"], field["on"]) for field in r.fields}
    assert {("vector", "points"), ("of cells", "cells"), ("of corners", "corners"), ("complex (imaginary)", "points")} <= found
    turned = np.asfortranarray(vector[::-1])[::-1]
    assert not turned.flags.c_contiguous
    assert fo.compare({**mesh, "u": turned}, {**mesh, "u": vector})


@pytest.mark.parametrize(
    "given, words",
    [
        ({"points": [[0, 0, 0, 0]]}, "points of shape"),
        ({**SQUARE, "cells": {"triangle": [[0, 1, 4]]}, "u": U}, "there are 4"),
        ({**SQUARE, "cells": {"triangle": [[0, 1, -1]]}, "u": U}, "-1"),
        ({**SQUARE, "cells": {"triangle": [[0, 1, 2, 3]]}, "u": U}, "3 points"),
        ({**SQUARE, "cells": {"triangl": [[0, 1, 2]]}, "u": U}, "triangl"),
        ({**SQUARE, "cells": {"triangle": [[0.5, 1, 2]]}, "u": U}, "float64"),
        ({**SQUARE, "u": [1.0, 2, 3]}, "3 rows"),
        ({**SQUARE, "u": ["a"] * 4}, "u"),
        ({**SQUARE, "u": []}, "0 rows"),
        ({"points": SQUARE["points"], "point_data": {"u": [1.0, 2]}}, "u"),
        ({"u": [1.0, 2], "v": [1.0]}, "different numbers"),
        ({"cells": {"triangle": [[0, 1, 2]]}, "u": U}, "no points"),
        ({"points": [[0, 0], [1, np.nan], [0, 1], [1, 1]], "cells": SQUARE["cells"], "u": U}, ""),
        ({}, "no field"),
    ],
)
def test_bad_arrays_are_refused_with_what_and_remedy(given, words):
    with pytest.raises(fo.Error) as caught:
        fo.compare(given, deepcopy(given))
    assert words in str(caught.value) and caught.value.remedy and caught.value.what


def test_errors_have_what_where_and_remedy(tmp_path):
    file = tmp_path / "u.vtu"
    with pytest.raises(fo.FileError) as caught:
        fo.compare(file, file)
    assert isinstance(caught.value, OSError) and str(file) in caught.value.where
    file.write_text("<VTKFile type='UnstructuredGrid'>\n<nonsense")
    with pytest.raises(fo.FileError) as caught:
        fo.read(file)
    assert str(file) in caught.value.where and caught.value.what and caught.value.remedy
    with pytest.raises(fo.UsageError, match="rtol"):
        fo.compare({"u": U}, {"u": U.copy()}, rtol=-1)
    with pytest.raises(ValueError, match="--no-such"):
        fo.compare({"u": U}, {"u": U.copy()}, no_such=1)
    with pytest.raises(fo.UsageError, match="is no result"):
        fo.compare(3, {"u": U})


def test_files_times_and_folders(tmp_path):
    for k, step in enumerate((0.0, 0.5)):
        fo.write(tmp_path / f"a_{k}.vtu", {**SQUARE, "u": U + step})
        fo.write(tmp_path / f"b_{k}.vtu", {**SQUARE, "u": U + step + (k == 1) * 1e-3})
    assert fo.compare({**SQUARE, "u": U}, tmp_path / "a_0.vtu")
    r = fo.compare(tmp_path / "a_*.vtu", tmp_path / "b_*.vtu")
    assert not r and [field["verdict"] for field in r.fields] == ["agree", "disagree"]
    assert r.worst["time"] == 1.0 and len(r.to_pandas()) == 2
    for name in ("one", "other"):
        (tmp_path / name).mkdir()
        fo.write(tmp_path / name / "u.vtu", {**SQUARE, "u": U})
    assert fo.compare(tmp_path / "one", tmp_path / "other")
    with pytest.raises(fo.Error):
        fo.compare(tmp_path / "one", tmp_path / "one/u.vtu")


def test_results_show_themselves(tmp_path):
    a = sampled(quadratic)
    b = {**a, "point_data": {"u": a["point_data"]["u"] + 1e-3}}
    r = fo.compare(a, b)
    assert "disagree" in str(r) and "u" in str(r)
    html = r._repr_html_()
    assert html.startswith("<iframe") and "differs" in html and "&lt;svg" in html
    r.report(tmp_path / "page")
    assert (tmp_path / "page/index.html").exists() and (tmp_path / "page/differences.vtu").exists()
    json.dumps(r.to_dict())
    places, fields = r.differences()["points"]
    assert places.shape == (36, 3) and np.abs(fields["u"] + 1e-3).max() < 1e-15
    assert list(r.to_pandas()["field"]) == ["u"] and r.to_polars()["field"].to_list() == ["u"]


def test_a_mesh_shows_its_own_memory_which_cannot_be_changed():
    u = np.arange(9.0)
    points, cells = square(2)
    mesh = fo.Mesh({"points": points, "cells": {"triangle": cells}, "u": u})
    shown = mesh.points
    assert not shown.flags.owndata and not shown.flags.writeable
    with pytest.raises(ValueError):
        shown[0, 0] = 7
    assert mesh.points.__array_interface__["data"] == shown.__array_interface__["data"]
    values = mesh["u"]
    del mesh
    gc.collect()
    assert np.array_equal(values, u) and np.array_equal(shown[:, :2], points)
    with pytest.raises(KeyError, match="u"):
        fo.Mesh({**SQUARE, "u": U})["v"]


def test_round_trip_through_files(tmp_path):
    given = sampled(quadratic, 3, 2)
    for suffix in ("vtu", "msh", "med"):
        fo.write(tmp_path / f"u.{suffix}", given)
        back = fo.read(tmp_path / f"u.{suffix}")
        assert fo.compare(given, back, rtol=1e-15) and back.cells[0][0] == "triangle6"
    with pytest.raises(fo.Error):
        fo.write(tmp_path / "u.mesh", given)
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        fo.write(tmp_path / "u.mesh", given, lossy=True)
    assert told and "u" in str(told[0].message)
    assert fo.convert(tmp_path / "u.vtu", tmp_path / "v.vtu", encoding="ascii")


def test_threads_run_side_by_side():
    """While two long comparisons run in threads, small ones begin and end in a third."""
    a, b = sampled(quadratic, 300), sampled(quadratic, 300)
    found, small = [], 0
    threads = [threading.Thread(target=lambda: found.append(fo.compare(a, b).agree)) for _ in range(2)]
    [thread.start() for thread in threads]
    while all(thread.is_alive() for thread in threads):
        assert fo.compare({"u": U}, {"u": U.copy()})
        small += 1
    [thread.join() for thread in threads]
    assert found == [True, True] and small > 5, small


def test_an_exception_leaves_nothing_locked():
    for _ in range(3):
        with pytest.raises(fo.Error):
            fo.compare({"u": U}, {**SQUARE, "u": U.copy()})
        assert fo.compare({"u": U}, {"u": U.copy()})


def test_ctrl_c_ends_a_comparison_and_the_next_one_runs():
    script = """
import signal, threading, time, os
import faceoff_fem as fo
from common import quadratic, sampled
a, b = sampled(quadratic, 250, 2), sampled(quadratic, 251, 2)
threading.Timer(0.5, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
begun = time.perf_counter()
try:
    fo.compare(a, b)
except KeyboardInterrupt:
    print("interrupted", time.perf_counter() - begun)
print(fo.compare({"u": [1.0]}, {"u": [1.0]}).agree)
"""
    run = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, cwd=os.path.dirname(__file__), check=False)
    lines = run.stdout.split()
    assert lines[:1] == ["interrupted"] and lines[2:] == ["True"], run
    assert signal.SIGINT and 0.4 < float(lines[1]) < 5


def test_thousands_of_small_comparisons_leak_nothing():
    """In a process of its own, whose most memory is not that of a test before, and without threads, each of which takes some for itself."""
    pytest.importorskip("resource")
    script = """
import gc, resource, sys
import faceoff_fem as fo
from test_compare import SQUARE, U
a, b, bad = ({**SQUARE, "u": u} for u in (U, U + 1e-3, U[:3]))

def most(count):
    for k in range(count):
        assert not fo.compare(a, b).agree
        if k % 10 == 0:
            try:
                fo.compare(a, bad)
            except fo.Error:
                pass
            else:
                raise AssertionError("it was compared")
    gc.collect()
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss

count = int(sys.argv[1])
first = most(count // 4)
print(most(count) - first)
"""
    count = 8000 if "FACEOFF_SCENES" in os.environ else 1000
    run = [sys.executable, "-c", script, str(count)]
    told = subprocess.run(run, capture_output=True, text=True, cwd=os.path.dirname(__file__), check=False)
    assert told.returncode == 0, told
    assert int(told.stdout) < count // 4, f"kB in {count} comparisons: {told.stdout}"


def test_a_result_speaks_of_what_was_compared_whatever_the_arrays_are_later(tmp_path):
    points, u = np.column_stack([SQUARE["points"], np.zeros(4)]), U + 0.5
    cells = {"triangle": np.array(SQUARE["cells"]["triangle"], dtype=np.uint32)}
    mesh = fo.Mesh({"points": points, "cells": cells, "u": u})
    r = fo.compare({"points": points, "cells": cells, "u": u}, {"points": points + 0, "cells": cells, "u": U})

    def told(folder):
        r.report(folder)
        ((places, fields),) = r.differences().values()
        page = folder.joinpath("index.html").read_text(encoding="utf-8")
        return page, str(r), r.to_dict(), places.tolist(), {name: values.tolist() for name, values in fields.items()}

    before = told(tmp_path / "before")
    points[:], u[:], cells["triangle"][:] = 7, 7, 0
    assert told(tmp_path / "after") == before
    assert mesh.points.max() == 1 and mesh.cells[0][1].max() == 3 and mesh["u"].tolist() == (U + 0.5).tolist()


@pytest.mark.skipif(sys.platform != "linux", reason="the peak of memory is set back through Linux's /proc")
def test_a_million_values_are_compared_without_a_copy():
    """What the comparison takes beside the arrays is less than another copy of them for its work, and a fifth of one."""
    measure = "import bench; print(*bench.compared(1)[1:3])"
    folder = os.path.dirname(__file__)
    measured = subprocess.run([sys.executable, "-c", measure], cwd=folder, check=True, capture_output=True, text=True)
    more, arrays = map(float, measured.stdout.split())
    assert arrays > 60 and more < 1.2 * arrays


def test_one_buffer_is_not_two_results():
    table = np.arange(8.0).reshape(4, 2)
    fortran = np.asfortranarray(np.arange(8.0).reshape(4, 2))
    big = np.arange(4.0).astype(">f8")
    for u in (U, table[:, 0], fortran, big, table[:, 0] + 1j, np.arange(4) > 1):
        for other in (u, u[::1]):
            with pytest.raises(fo.UsageError, match="same memory"):
                fo.compare({**SQUARE, "u": u}, {**SQUARE, "u": other})
        assert fo.compare({**SQUARE, "u": u}, {**SQUARE, "u": u.copy()})
    with pytest.raises(fo.UsageError, match="same memory"):
        fo.compare({"u": U}, {"v": U}, pair=["u=v"])
    rows = {**SQUARE, "u": [0.0, 1, 2, 3]}
    with pytest.raises(fo.UsageError, match="same object"):
        fo.compare(rows, rows)
    assert not fo.compare({**SQUARE, "u": table[:, 0]}, {**SQUARE, "u": table[:, 1]})
    both = {**SQUARE, "number": U}
    assert fo.compare({**both, "u": U + 1}, {**both, "u": U + 1}, except_=["number"])


def test_arrays_that_are_not_aligned_are_copied():
    u = np.frombuffer(b"\0" + np.arange(4.0).tobytes(), dtype=np.float64, offset=1)
    assert not u.flags.aligned
    assert fo.compare({**SQUARE, "u": u}, {**SQUARE, "u": np.arange(4.0)})
    assert not fo.compare({**SQUARE, "u": u}, {**SQUARE, "u": np.arange(4.0) + 1})
