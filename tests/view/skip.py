"""A test that cannot run here says what it needs; ctest and ./dev test count it as skipped."""

import subprocess
import sys


def skip(needs, package=""):
    print(f"skipped: needs {needs} (Debian: {package})" if package else f"skipped: needs {needs}")
    sys.exit(77)


def need_view(program, name, library, package):
    """Skips unless the program was built with this view."""
    listed = subprocess.run([program, "list", "view"], capture_output=True, text=True, check=False)
    if name not in listed.stdout:
        skip("a build with " + library, package)
