#!/usr/bin/env python3
"""Every example of docs/python.md, in its order. `examples_test.py LIBRARY SIM`"""

import os
import re
import sys
import tempfile
from pathlib import Path

from tree import ROOT, need_numpy

need_numpy()


def main():
    page = (ROOT / "docs/python.md").read_text()
    examples = re.findall(r"^## (.+?)$|^```python\n(.*?)^```$", page, re.M | re.S)
    title, ran, skipped, names = "", 0, 0, {}
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        for heading, code in examples:
            if heading:
                title = heading
                continue
            if "scipy" in code:
                try:
                    import scipy.optimize  # noqa: F401
                except ImportError:
                    print(f"skipped: '{title}' needs scipy (Debian: python3-scipy)")
                    skipped += 1
                    continue
            try:
                exec(compile(code, f"docs/python.md, '{title}'", "exec"), names)
            except BaseException:
                print(f"failed: '{title}'")
                raise
            ran += 1
        assert Path("now.png").read_bytes().startswith(b"\x89PNG")
    assert ran + skipped >= 10, (ran, skipped)
    print(f"{ran} passed, 0 failed, {skipped} skipped")


main()
