"""Runs scripts in children of a process that has loaded libraries, which takes longer than most scripts: `python3 -c THIS MODULE…`.

Of a MODULE with a + before it only the library is loaded, since what it does then is for each process: it starts MPI.

Each line of the input is the path of a script and its words, with tabs between. It runs as the main program of a child process, in its
folder, where `stdout` and `stderr` get what it prints. Each line of the output is the exit code of a child; minus the signal where one
ended it.
"""

import ctypes
import importlib.machinery
import importlib.util
import os
import runpy
import sys


def library(module):
    """Loads the library of an extension module, and neither initialises it nor imports the package that it is in."""
    package, _, name = module.rpartition(".")
    folders = importlib.util.find_spec(package).submodule_search_locations
    ctypes.CDLL(importlib.machinery.PathFinder.find_spec(name, folders).origin)


for module in sys.argv[1:]:
    library(module[1:]) if module.startswith("+") else importlib.import_module(module)
for line in sys.stdin:
    child = os.fork()
    if child == 0:
        break
    print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), flush=True)
else:
    sys.exit()

script, *words = line.rstrip("\n").split("\t")
os.chdir(os.path.dirname(script))
for stream, name in enumerate((os.devnull, "stdout", "stderr")):
    os.dup2(os.open(name, os.O_RDWR | os.O_CREAT | os.O_TRUNC), stream)
sys.argv, sys.path[0] = [script, *words], os.path.dirname(script)
runpy.run_path(script, run_name="__main__")
