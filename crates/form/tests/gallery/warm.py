"""Runs scripts in children of a process that has loaded libraries, which takes longer than most scripts: `warm.py MODULE…`.

Each line of the input is the path of a script. It runs as the main program of a child process, in its folder, where `stdout` and
`stderr` get what it prints. Each line of the output is the exit code of a child; minus the signal where one ended it.
"""

import importlib
import os
import runpy
import sys

for module in sys.argv[1:]:
    importlib.import_module(module)
for line in sys.stdin:
    child = os.fork()
    if child == 0:
        break
    print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), flush=True)
else:
    sys.exit()

script = line.rstrip("\n")
os.chdir(os.path.dirname(script))
for stream, name in enumerate((os.devnull, "stdout", "stderr")):
    os.dup2(os.open(name, os.O_RDWR | os.O_CREAT), stream)
sys.argv, sys.path[0] = [script], os.path.dirname(script)
runpy.run_path(script, run_name="__main__")
