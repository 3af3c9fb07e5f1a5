#!/usr/bin/env python3
"""The module of WebAssembly in node: every scene has the bits of the program, with the fused
multiply-add of the machine and with the one in software. `node_test.py SIM SIM.MJS`"""

import json
import os
import shutil
import subprocess
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "view"))
from skip import skip  # noqa: E402

PROGRAM, MODULE = map(os.path.abspath, sys.argv[1:3])
SCENES = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "scripts", "scenes")
STEPS = "30"
# With the multiply-add in software, too.
ALSO_EXACT = ["cloth", "pendulum", "flag", "hammock", "jelly_fem", "dam", "hires"]


def run(words, **more):
    return subprocess.run(words, capture_output=True, text=True, check=False,
                          env={**os.environ, **more}, timeout=250)


def hashes(command, scene, **more):
    words = [*command, scene, "--steps", STEPS, "--no-verify", "--json"]
    done = run(words, **more)
    if done.returncode not in (0, 4) or not done.stdout:
        return done.returncode, done.stderr[-500:]
    return done.returncode, [system["hash"] for system in json.loads(done.stdout)["systems"]]


def test_scenes():
    node = ["node", MODULE]
    names = sorted(each[:-4] for each in os.listdir(SCENES) if each.endswith(".lua"))
    other = []
    for name in names:
        scene = f"scenes/{name}.lua"
        native = hashes([PROGRAM], scene)
        own = hashes(node, scene)
        if own != native:
            other.append((name, native, own))
        if name in ALSO_EXACT and hashes(node, scene, SIM_WEB="exact") != native:
            other.append((name + ", exact", native, hashes(node, scene, SIM_WEB="exact")))
    assert not other, "\n".join(str(each) for each in other)
    assert len(names) > 40
    print("test_scenes ok:", len(names), "scenes")


def test_multiply_add():
    here = os.path.dirname(os.path.abspath(__file__))
    done = run(["node", os.path.join(here, "fma.mjs"), os.path.dirname(MODULE)])
    assert done.returncode == 0 and "in software: 200000 numbers ok" in done.stdout, done
    print("test_multiply_add ok")


def test_unpack():
    if not shutil.which("xz"):
        skip("xz", "xz-utils")
    here = os.path.dirname(os.path.abspath(__file__))
    done = run(["node", os.path.join(here, "unpack.mjs"), os.path.dirname(MODULE)])
    assert done.returncode == 0 and "8 streams ok" in done.stdout, done
    print("test_unpack ok")


def test_options():
    """Options, files, errors and exit codes are those of the program."""
    for words, code in ((["scenes/cloth.lua", "-i", "euler", "-d", "0.05", "-q"], 4),
                        (["scenes/clot.lua"], 3), (["--steps", "-1"], 2), (["--version"], 0)):
        native, own = run([PROGRAM, *words]), run(["node", MODULE, *words])
        assert own.returncode == native.returncode, (words, own.returncode, own.stderr)
        if code == 2:
            assert own.stderr == native.stderr
    words = ["scenes/cloth.lua", "--steps", "20", "--dump=-", "--every", "5", "-q"]
    assert run(["node", MODULE, *words]).stdout == run([PROGRAM, *words]).stdout != ""
    words = ["scenes/pendulum.lua", "--error", "1%", "--json", "-q"]
    native, own = (json.loads(run([*program, *words]).stdout)["systems"][0]["error_goal"]
                   for program in ([PROGRAM], ["node", MODULE]))
    assert own == native, (own, native)
    print("test_options ok")


if __name__ == "__main__":
    if not shutil.which("node"):
        skip("node", "nodejs")
    if not os.path.exists(MODULE):
        skip("the module that ./dev web builds", "emscripten libc++-16-dev")
    test_multiply_add()
    test_unpack()
    test_options()
    test_scenes()
