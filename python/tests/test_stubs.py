"""The stubs say what the package has."""

import subprocess
import sys
from pathlib import Path

CONFIG = Path(__file__).parents[1] / "pyproject.toml"


def test_stubs_and_package_are_the_same():
    names = ["faceoff_fem", "--ignore-missing-stub", "--ignore-disjoint-bases", "--mypy-config-file", str(CONFIG)]
    run = subprocess.run([sys.executable, "-m", "mypy.stubtest", *names], capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stdout + run.stderr
