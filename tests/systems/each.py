"""Runs a script for all of its first faults in one process, once, and copies the files of one: each.py SCRIPT MESH OUT PROBLEM FAULT COUNT."""

import fcntl
import os
import runpy
import shutil
import sys

script, mesh, out, problem, fault, count = sys.argv[1:]
kept = os.path.abspath(f"{script}-{problem}")
with open(f"{kept}.lock", "w") as lock:
    fcntl.flock(lock, fcntl.LOCK_EX)
    if not os.path.exists(kept):
        for k in range(1, int(count) + 1):
            os.makedirs(f"{kept}/{k}")
            sys.argv = [script, mesh, f"{kept}/{k}", problem, str(k)]
            runpy.run_path(script, run_name="__main__")
# With the date of now: results that are older than a run are not taken.
shutil.copytree(f"{kept}/{fault}", out, copy_function=shutil.copyfile, dirs_exist_ok=True)
