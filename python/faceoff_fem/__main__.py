"""The program ``faceoff``."""

import os
import sys

from . import _core


def main():
    code = _core.main(["faceoff", *sys.argv[1:]])
    # A command that was ended may still look at what Python would take away.
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)


if __name__ == "__main__":
    main()
