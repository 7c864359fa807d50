"""One mutant: a folder with inputs, and a command that must not end with 0 there."""

import functools
import itertools
import os
import shutil
import subprocess
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

SOURCE = Path(__file__).resolve().parent.parent.parent
SECONDS = 120


class At:
    """A folder where the program is run."""

    def __init__(self, program, folder):
        self.program, self.folder, self.said, self.words = program, Path(folder), "", []

    def put(self, name, data):
        path = self.folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        if isinstance(data, bytes):
            path.write_bytes(data)
        else:
            path.write_text(data)

    def put_all(self, files):
        for name, data in files.items():
            self.put(name, data)

    def shell(self, *words, env=None):
        self.words = [str(w) for w in words]
        done = subprocess.run(
            self.words, cwd=self.folder, capture_output=True, stdin=subprocess.DEVNULL, timeout=SECONDS, check=False,
            env={**os.environ, **(env or {})},
        )
        self.said = (done.stdout + done.stderr).decode(errors="replace")
        return done.returncode

    def run(self, *words, env=None):
        return self.shell(self.program, *words, env=env)

    def must(self, *words):
        """What has to succeed for the mutant to mean anything."""
        code = self.run(*words)
        if code != 0:
            raise RuntimeError(f"{' '.join(self.words)}: {code}: {self.said}")


@dataclass
class Trial:
    """`script(At)` gives the exit code. Where it `agrees`, the input is right and the code must be 0."""

    verdict: str
    fault: str
    script: Callable
    agrees: bool = False


def forever(make):
    """Of what makes some trials, the 0th time, the 1st, …: as many as one likes."""

    @functools.wraps(make)
    def trials(draw):
        for turn in itertools.count():
            yield from make(draw, turn)

    return trials


def run(program, trial, keep=None):
    """The exit code, and what was said."""
    folder = tempfile.mkdtemp(prefix="mutant-")
    try:
        at = At(program, folder)
        try:
            code = trial.script(at)
        except subprocess.TimeoutExpired:
            return -1, f"{at.words}: it did not end within {SECONDS} s"
        except RuntimeError as error:
            return -1, str(error)
        good = code == 0 if trial.agrees else code in (1, 2) and "panicked" not in at.said
        if not good and keep:
            shutil.copytree(folder, keep, dirs_exist_ok=True, symlinks=True)
            (keep / "command.txt").write_text(" ".join(at.words) + "\n" + at.said)
        return (code if good or trial.agrees or code == 0 else -1), at.said
    finally:
        shutil.rmtree(folder, ignore_errors=True)
