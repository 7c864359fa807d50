"""Commands of the program: each runs as a process of its own, and its result comes back as JSON."""

import json
import os
import signal
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from html import escape
from pathlib import Path

from ._adapters import written
from .errors import Error, usage

#: Options that are given once for each of several values; others take a list with commas.
_REPEATED = ("field", "only", "except", "nan_equal", "pair", "include", "exclude", "exact")


def words(options):
    """Keywords as options of the program: ``rtol=1e-8`` as ``--rtol=1e-08``, ``except_`` as ``--except``."""
    for key, value in options.items():
        name = key.rstrip("_")
        flag = "--" + name.replace("_", "-")
        if value is None or value is False:
            continue
        if value is True:
            yield flag
        elif isinstance(value, (list, tuple)) and name not in _REPEATED:
            yield f"{flag}={','.join(map(str, value))}"
        else:
            for one in value if isinstance(value, (list, tuple)) else (value,):
                yield f"{flag}={os.fspath(one) if isinstance(one, os.PathLike) else one}"


class Result(Mapping):
    """What a command of the program found: its JSON as a mapping, its ``text``, and its ``verdict`` where it judges.

    ``code`` is the exit code of the program: 0 agree or done, 1 disagree or not reached. ``page`` is the page as HTML where a
    folder was given as ``report``, ``notes`` are what it said beside its answer.
    """

    def __init__(self, code, text, found, page=None, mesh=None, notes=()):
        self.code, self.text, self.page, self.mesh, self.notes = code, text, page, mesh, list(notes)
        self._found = found

    def __getitem__(self, key):
        return self._found[key]

    def __iter__(self):
        return iter(self._found)

    def __len__(self):
        return len(self._found)

    @property
    def verdict(self):
        """The verdict in a word; None of what judges nothing."""
        return self._found.get("verdict")

    @property
    def agree(self):
        """Is it done, and does all agree?"""
        return self.code == 0

    def __bool__(self):
        return self.agree

    def to_dict(self):
        """The JSON as a dictionary."""
        return dict(self._found)

    def __str__(self):
        return "\n".join([self.text, *(f"note: {note}" for note in self.notes)])

    __repr__ = __str__

    def _repr_html_(self):
        return framed(self.page) if self.page else f"<pre>{escape(str(self))}</pre>"


def framed(page):
    """A page inside of a notebook."""
    return f'<iframe style="width:100%;height:42em;border:0" sandbox="allow-scripts" srcdoc="{escape(page)}"></iframe>'


def run(command, arguments=(), report=None, **options):
    """Runs a command; Ctrl-C ends it with all that it has started.

    Raises:
        Error: what the program could not judge or do.
    """
    with tempfile.TemporaryDirectory(prefix="faceoff-") as folder:
        out = Path(folder, "result.json")
        line = [sys.executable, "-m", "faceoff_fem", *command.split(), *map(os.fspath, arguments), f"--json={out}"]
        line += words({**options, "report": report})
        with subprocess.Popen(line, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
            try:
                text, said = process.communicate()
            except BaseException:
                process.send_signal(signal.SIGINT if os.name == "posix" else signal.SIGTERM)
                process.communicate()
                raise
        text, said = (part.decode(errors="replace").strip() for part in (text, said))
        found = json.loads(out.read_text(encoding="utf-8")) if out.exists() else {}
    if process.returncode not in (0, 1) or not found:
        message = found.get("error") or "\n".join(line for line in said.splitlines() if line)
        if not message and found:
            message = text
        message = message.removeprefix("faceoff: ")
        what, _, remedy = message.rpartition("; ")
        raise Error(message or f"the program ended with {process.returncode}", what or message, "", remedy)
    page = Path(report, "index.html").read_text(encoding="utf-8") if report else None
    notes = [line.removeprefix("faceoff: ") for line in said.splitlines() if line]
    return Result(process.returncode, text, found, page, notes=notes)


def solve(scene, *, out=None, report=None, **options):
    """Solves a scene with one engine; ``result.mesh`` is the solution.

    Args:
        scene: the name of a built-in scene, or a TOML file.
        out: a file ``NAME.vtu`` that keeps the solution.
        options: those of ``faceoff solve``, as ``n=64``, ``method="cr"``, ``engine="rust"``, ``certify=True``.

    >>> import faceoff_fem as fo
    >>> solution = fo.solve("one-zone", n=4, method="p1")
    >>> solution["converged"], solution["dofs"], solution.mesh.cells[0][1].shape
    (True, 25, (32, 3))
    """
    from ._mesh import read

    with tempfile.TemporaryDirectory(prefix="faceoff-") as folder:
        target = Path(out or Path(folder, "u.vtu"))
        result = run("solve", [scene], report, out=target, **options)
        result.mesh = read(target)
    return result


def verify(*scenes, engines=None, report=None, **options):
    """Solves scenes with several codes, and judges every pair of answers.

    Args:
        scenes: names of built-in scenes, or TOML files; without any, those that the program runs by default.
        engines: names, TOML files, and functions that are marked with :func:`engine`.
        report: a folder for the page.
        options: those of ``faceoff verify``, as ``methods=["cr"]``, ``n=[8, 16]``.

    >>> import faceoff_fem as fo
    >>> import numpy as np
    >>> @fo.engine
    ... def zero(case):
    ...     return np.zeros((len(case.cells), len(case.nodes())))
    >>> fo.verify("one-zone", engines=["rust", zero], methods=["cr"], n=4).verdict
    'disagree'
    """
    from ._engine import served

    if engines is None:
        return run("verify", scenes, report, **options)
    with served(engines) as named:
        return run("verify", scenes, report, engines=named, **options)


def judge(result, scene, *, report=None, name=None, **options):
    """Puts a solution of any code into the scheme, and says where and why it does not solve it.

    Args:
        result: what :func:`compare` takes.
        scene: the name of a built-in scene, or a TOML file.
        name: what the function is called in messages.
        options: those of ``faceoff judge``, as ``method="p1"``, ``n=16``.

    >>> import faceoff_fem as fo
    >>> fo.judge(fo.solve("one-zone", n=4, method="p1").mesh, "one-zone", method="p1", field="u").verdict
    'agree'
    """
    with written([result], [name]) as (path,):
        return run("judge", [path], report, scene=scene, **options)


def certify(result, scene, *, report=None, name=None, **options):
    """Guaranteed bounds of the error of a solution of any code.

    Args:
        result: what :func:`compare` takes.
        scene: the name of a built-in scene, or a TOML file.
        options: those of ``faceoff certify``, as ``element="p2"``.

    >>> import faceoff_fem as fo
    >>> bounds = fo.certify(fo.solve("one-zone", n=4, method="p1").mesh, "one-zone", field="u", element="p1")
    >>> bounds.agree
    True
    """
    with written([result], [name]) as (path,):
        return run("certify", [path], report, scene=scene, **options)


def orders(results=None, *, scenes=(), reference=None, exact=None, report=None, name=None, **options):
    """Observed orders of convergence: of results of any code, from the coarsest to the finest, or of our methods on scenes.

    Args:
        results: a list of what :func:`compare` takes.
        scenes: instead of results, scenes with a known solution.
        reference: a result that the errors are taken against; without it each against the next.
        exact: a formula that they are taken against, as ``"sin(pi*x)*y"``; of a vector one for each component.

    >>> import faceoff_fem as fo, numpy as np
    >>> def sampled(n):
    ...     x, y = np.meshgrid(*[np.linspace(0, 1, n + 1)] * 2)
    ...     k = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).reshape(-1, 1)
    ...     cells = np.vstack([k + [0, 1, n + 2], k + [0, n + 2, n + 1]])
    ...     return {"points": np.column_stack([x.flat, y.flat]), "cells": {"triangle": cells}, "u": np.sin(x * y).ravel()}
    >>> found = fo.orders([sampled(4), sampled(8), sampled(16)], exact="sin(x*y)")
    >>> found.agree
    True
    """
    if results is None:
        return run("orders", scenes, report, **options)
    sides = list(results) + ([reference] if reference is not None else [])
    if any(isinstance(side, str) and "," in side for side in sides):
        raise usage("a path has a comma", "rename the file")
    with written(sides, [name] * len(sides)) as paths:
        if reference is not None:
            *paths, reference = paths
        return run("orders", (), report, results=paths, reference=reference, exact=exact, **options)


def convert(source, target, **options):
    """Writes a mesh in another format; see :func:`write` for options.

    >>> import faceoff_fem as fo
    >>> fo.write("square.msh", {"points": [[0, 0], [1, 0], [0, 1]], "cells": {"triangle": [[0, 1, 2]]}})
    >>> fo.convert("square.msh", "square.vtu").agree
    True
    """
    return run("mesh convert", [source, target], **options)
