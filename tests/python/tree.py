"""Where the tests of the package find it, and what they need."""

import os
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
LIBRARY, PROGRAM = sys.argv[1], sys.argv[2]
os.environ["SIM_LIBRARY"] = LIBRARY
sys.path.insert(0, str(ROOT / "python"))
sys.dont_write_bytecode = True


def need_numpy():
    try:
        import numpy  # noqa: F401
    except ImportError:
        # Debian's python3 has Debian's numpy, whatever else comes first in the path.
        debian = "/usr/bin/python3"
        if os.path.realpath(sys.executable) != os.path.realpath(debian) and os.path.exists(debian):
            os.execv(debian, [debian, "-B", *sys.argv])
        print("skipped: needs numpy (Debian: python3-numpy)")
        sys.exit(77)
