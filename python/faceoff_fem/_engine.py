"""Functions of Python as codes in `verify`."""

import contextlib
import json
import os
import sys
import tempfile
import threading
import time
import traceback
from multiprocessing.connection import Listener
from pathlib import Path

import numpy as np


def _protocol():
    """Imported where it is used: it needs Python 3.10."""
    from . import job

    return job


class Case:
    """What a code is to solve: the scheme is in the project's ``fenicsx/nitsche.py``.

    Attributes:
        id: its name.
        dimension: 2 or 3.
        element: ``"CR"``, ``"P1"`` or ``"P2"``.
        theta1, theta2, flux_corrected: the scheme, by (2.4) of the paper.
        points: of shape (N, d).
        cells: of shape (M, d+1), vertices from 0, of either orientation.
        boundary: the boundary faces, of shape (K, d).
        labels: of each, 1 on Γ_C, 2 on Γ_D, 3 on Γ_N.
        gamma: γ of each cell behind a contact face, NaN elsewhere.
        stop: when to end: ``increment`` and ``max_iterations``.
    """

    def __init__(self, folder, case, job):
        protocol = _protocol()
        self._case, self._job = case, job
        files = {key: os.path.join(folder, path) for key, path in case["mesh"].items()}
        gamma = {key: os.path.join(folder, path) for key, path in case["gamma"].items()}
        self.id, self.dimension, self.element = case["id"], case["dimension"], case["element"]
        self.theta1, self.theta2 = float(case["theta1"]), float(case["theta2"])
        self.flux_corrected, self.stop = case["flux_corrected"], job["stop"]
        self.points, self.cells, self.boundary, self.labels = protocol.read_mesh({**case, "mesh": files})
        self.gamma = protocol.read_gamma({"gamma": gamma}, len(self.cells))

    def data(self, name, x):
        """``f``, ``g``, ``t`` or ``psi`` at points, an array whose first axis has the coordinates."""
        return _protocol().values(self._case["data"][name], np.asarray(x))

    def rule(self, which):
        """Points (Q, d) on the simplex of 0 and the unit vectors and weights (Q,): for (f, v) ``"cell"``, for Γ_C and Γ_N ``"face"``."""
        return _protocol().rule(self._job["quadrature"][which])

    def nodes(self):
        """Barycentric coordinates of the dofs of a cell, in the order in which they are returned, of shape (dofs, d+1)."""
        return _protocol().nodes(self.element, self.dimension)


class Engine:
    """A function that is a code in :func:`verify`; made by :func:`engine`."""

    def __init__(self, solve, name=None, version="0"):
        self.solve, self.name, self.version = solve, name or solve.__name__, str(version)

    def __call__(self, case):
        return self.solve(case)

    def _answer(self, folder):
        """Solves the job in a folder, and writes what the protocol asks for."""
        protocol = _protocol()
        job = json.loads(Path(folder, "job.json").read_text(encoding="utf-8"))
        done = []
        for case in job["cases"]:
            start = time.perf_counter()
            found = self.solve(Case(folder, case, job))
            dofs, increments = found if isinstance(found, tuple) else (found, [0.0])
            converged = len(increments) > 0 and increments[-1] < job["stop"]["increment"]
            seconds = time.perf_counter() - start
            done.append(protocol.write_dofs(case, dofs, converged, increments, seconds, folder))
        protocol.write_status(self.version, done, folder)


def engine(solve=None, *, name=None, version="0"):
    """Makes a function a code: it gets a :class:`Case` and returns its dofs, cell by cell, of shape (M, dofs of a cell), in the
    order of ``case.nodes()``; or these and the increments of its steps. It runs in this process, so that it may be anything, also
    a function of a notebook. Needs Python 3.10.

    >>> import faceoff_fem as fo
    >>> @fo.engine
    ... def mine(case):
    ...     raise NotImplementedError(case.element)
    >>> mine.name
    'mine'
    """
    if solve is None:
        return lambda solve: Engine(solve, name, version)
    return Engine(solve, name, version)


@contextlib.contextmanager
def served(engines):
    """Names for ``--engines``. A function gets a file and a process that asks this one, which is held for as long as it takes."""
    with contextlib.ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="faceoff-")))
        named = []
        for of in engines:
            if callable(of) and not isinstance(of, Engine):
                of = Engine(of)
            if not isinstance(of, Engine):
                named.append(of)
                continue
            key = os.urandom(16)
            listener = stack.enter_context(Listener(None, authkey=key))
            threading.Thread(target=_serve, args=(listener, of), daemon=True).start()
            told = folder / f"{of.name}.json"
            told.write_text(json.dumps({"address": listener.address, "key": key.hex()}))
            told.chmod(0o600)
            line = [sys.executable, str(Path(__file__).with_name("_proxy.py")), str(told)]
            file = folder / f"{of.name}.toml"
            file.write_text(f"name = {json.dumps(of.name)}\ncommand = {json.dumps(line)}\n", encoding="utf-8")
            named.append(file)
        yield named


def _serve(listener, engine):
    """Answers until the listener is closed, one job after another."""
    while True:
        try:
            connection = listener.accept()
        except Exception:
            return
        with connection:
            try:
                engine._answer(connection.recv())
                said = None
            except Exception as error:
                where = traceback.extract_tb(error.__traceback__)[-1]
                said = f"{type(error).__name__}: {error} ({os.path.basename(where.filename)}, line {where.lineno})"
            with contextlib.suppress(OSError):
                connection.send(said)
