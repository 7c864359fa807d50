"""What Python costs: a million values of a discontinuous function, compared here and by the program.

python bench.py          # of an installed wheel in release; ends with 1 where Python takes more than 1.2 times as long, or as
                         # much memory beside the arrays as a copy of a fifth of them would explain: the program has them once
"""

import subprocess
import sys
import sysconfig
import tempfile
import time
from pathlib import Path

import numpy as np

import faceoff_fem as fo

MB = 1024
#: What is counted of a program is at least what the one that started it had then: a small one starts it.
PEAK = """
import resource, subprocess, sys
subprocess.run(sys.argv[1:], check=True, stdout=sys.stderr)
print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)
"""


def million():
    """A third of a million triangles whose corners have values of their own."""
    n = 409
    x, y = np.meshgrid(np.linspace(0, 1, n + 1), np.linspace(0, 1, n + 1))
    points = np.column_stack([x.ravel(), y.ravel(), np.zeros((n + 1) ** 2)])
    k = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).reshape(-1, 1)
    places = points[np.vstack([k + [0, 1, n + 2], k + [0, n + 2, n + 1]])].reshape(-1, 3)
    cells = np.arange(len(places), dtype=np.uint32).reshape(-1, 3)
    return {"points": places, "cells": {"triangle": cells}, "point_data": {"u": np.sin(places[:, 0] + 3 * places[:, 1])}}


def best(of, times):
    taken = []
    for _ in range(times):
        begun = time.perf_counter()
        of()
        taken.append(time.perf_counter() - begun)
    return min(taken)


def most(program):
    """Memory that a program had at most, in MB."""
    measured = subprocess.run([sys.executable, "-c", PEAK, *program], check=True, capture_output=True, text=True)
    return float(measured.stdout) / MB


def held(what):
    """Memory of this process, in MB."""
    lines = Path("/proc/self/status").read_text().splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith(what)) / MB


def compared(times):
    """Seconds of a comparison, the memory that it takes beside its arrays, that of the arrays, and the arrays."""
    a, b = million(), million()
    b["point_data"]["u"] = b["point_data"]["u"] * (1 + 1e-13)
    arrays = 2 * sum(of.nbytes for of in (a["points"], a["cells"]["triangle"], a["point_data"]["u"])) / MB**2
    # 5 sets the peak back to what is held now.
    Path("/proc/self/clear_refs").write_text("5")
    before = held("VmRSS")
    seconds = best(lambda: fo.compare(a, b), times)
    return seconds, held("VmHWM") - before, arrays, (a, b)


def main():
    here, more, arrays, sides = compared(5)
    with tempfile.TemporaryDirectory() as folder:
        files = [Path(folder, name) for name in ("a.vtu", "b.vtu")]
        for file, given in zip(files, sides):
            fo.write(file, given, encoding="raw")
        program = [Path(sysconfig.get_path("scripts"), "faceoff"), "compare", *files, "--quiet"]
        if len(sys.argv) > 1:
            program[0] = sys.argv[1]
        theirs = best(lambda: subprocess.run(program, check=True), 5)
        peak = most(program) - most([program[0], "--version"])
    print(f"{len(sides[0]['points'])} values: {here:.3f} s here, {theirs:.3f} s by the program: {here / theirs:.2f} times")
    print(f"memory: {more:.0f} MB more here than the arrays' own {arrays:.0f}, {peak:.0f} MB by the program for the same")
    return here > 1.2 * theirs or more > peak - arrays + 0.2 * arrays


if __name__ == "__main__":
    sys.exit(main())
