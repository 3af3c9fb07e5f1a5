#!/usr/bin/env python3
"""Recordings, engines, exports, imports, plots and budgets from Python: files and figures are those
of the command line, byte for byte. `command_line_test.py LIBRARY SIM`"""

import filecmp
import json
import os
import shutil
import signal
import subprocess
import tempfile
import threading
import time
import warnings
from pathlib import Path

from tree import PROGRAM, ROOT, need_numpy

need_numpy()

import sim  # noqa: E402

NET = (ROOT / "tests/cli/engine_case.h").read_text().split('R"lua(')[1].split(')lua"')[0]
TETRAHEDRON = """v 0 0 0
v 1 0 0
v 0 1 0
v 0 0 1
f 1 3 2
f 1 2 4
f 1 4 3
f 2 3 4
f 1 1 1
"""


def raises(kind, work):
    try:
        work()
    except kind as error:
        return error
    raise AssertionError(f"{kind.__name__} was not raised")


def told(*words, code=0, output=str):
    """What the program says on standard output."""
    ran = subprocess.run([PROGRAM, *words], capture_output=True, check=False)
    assert ran.returncode == code, (words, ran.returncode, ran.stderr.decode())
    return json.loads(ran.stdout) if output is dict else ran.stdout.decode()


def without_times(summary):
    """A summary but for the seconds that its runs took."""
    summary = json.loads(json.dumps(summary))
    summary.pop("seconds")
    return summary


def interrupted(work, after=0.3):
    """Seconds from Ctrl-C, which comes so much later, to its exception."""
    sent = []

    def send():
        sent.append(time.monotonic())
        os.kill(os.getpid(), signal.SIGINT)

    timer = threading.Timer(after, send)
    timer.start()
    raises(KeyboardInterrupt, work)
    return time.monotonic() - sent[0]


def act(s):
    s.step(100)
    s.pin(12)
    s.set_velocity(40, [0.1, 0, -0.2])
    s.step(20)
    s.dt = 0.0025
    s.set_integrator("dopri5:tol=1e-6")
    s.step(30)
    s.set_position(33, [0.5, 0.25, 0.3])
    s.pin(12, False)
    s.step(50)


def test_recordings():
    s = sim.load("scenes/cloth.lua", n=8)
    s.record("hands.rec")
    act(s)
    s.end_record()
    lines = Path("hands.rec").read_text().splitlines()
    assert lines[1:3] == ["scene scenes/cloth.lua", "set n=8"]
    assert lines[3:] == ["+100 pin 12", "+0 velocity 40 0.1 0 -0.2", "+20 dt 0.0025",
                         "+0 integrator dopri5:tol=1e-6", "+30 position 33 0.5 0.25 0.3",
                         "+0 unpin 12", f"+50 end {s.hash}"]
    line = told("--replay", "hands.rec", "--json", "-q", output=dict)
    t = sim.recorded("hands.rec")
    t.replay("hands.rec")
    assert t.hash == s.hash == line["systems"][0]["hash"]
    assert without_times(t.summary) == without_times(line)
    # A scene that was loaded likewise replays it, too; the bits of another one are not compared.
    u = sim.load("scenes/cloth.lua", n=8)
    u.replay("hands.rec")
    assert u.hash == s.hash
    with sim.recorded("hands.rec", dt=0.001) as other:
        other.replay("hands.rec", verify=False)
        assert other.hash != s.hash
    Path("wrong.rec").write_text("\n".join(lines[:-1]) + f"\n+50 end {'0' * 16}\n")
    told("--replay", "wrong.rec", "-q", code=8)
    with sim.recorded("wrong.rec") as other:
        error = raises(sim.Error, lambda: other.replay("wrong.rec", verify=False))
        assert error.code == 8 and error.where == "wrong.rec" and other.hash == s.hash
        assert other.verdict.word
    # A reset goes on with the settings; a recording that nobody ends, ends with its scene.
    s = sim.load("scenes/cloth.lua")
    s.record("reset.rec")
    act(s)
    s.reset()
    s.run(0.5, verify=False)
    mine = s.hash
    s.close()
    assert told("--replay", "reset.rec", "--json", "-q", "--no-verify",
                output=dict)["systems"][0]["hash"] == mine
    # Systems of a world have steps of their own.
    s = sim.load("scenes/sample.lua")
    s.record("world.rec")
    s.step(7)
    s.systems[1].pin(0)
    s.step(5)
    s.end_record()
    mine = [one.hash for one in s.systems]
    line = told("--replay", "world.rec", "--json", "-q", "--no-verify", output=dict)
    assert [one["hash"] for one in line["systems"]] == mine
    with sim.recorded("world.rec") as t:
        t.replay("world.rec", verify=False)
        assert [one.hash for one in t.systems] == mine


def test_what_a_recording_refuses():
    s = sim.load("scenes/cloth.lua")
    before = s.snapshot()
    for work in (lambda: s.record("-"), lambda: s.record(""), lambda: s.record("/nowhere/x.rec"),
                 s.end_record):
        error = raises(sim.Error, work)
        assert error.what and error.where and error.why and error.remedy, vars(error)
    s.record("first.rec")
    bad = [lambda: s.record("second.rec"), lambda: s.restore(before), s.come_to_rest,
            lambda: s.choose("1%"), lambda: s.resume("x.snap"), lambda: s.run(0.0123),
            lambda: s.replay("first.rec"), lambda: s.run_engine("lammps")]
    for i, work in enumerate(bad):
        error = raises(sim.Error, work)
        assert error.what and error.where and error.why and error.remedy, (i, vars(error))
    assert not os.path.exists("second.rec") and not os.path.exists("-")
    s.step(3)
    s.end_record()
    error = raises(sim.Error, lambda: s.record("late.rec"))
    assert error.code == 2 and "start" in error.what and not os.path.exists("late.rec")
    text = ("return sim.scene { state = {1}, field = sim.field.formula { '-u', names = {'u'} }, "
            "integrator = 'rk4', dt = 0.1, duration = 1 }")
    assert "file" in raises(sim.Error, lambda: sim.scene(text).record("text.rec")).what
    Path("bad.rec").write_text("scene scenes/cloth.lua\n+3 fly 12\n")
    assert raises(sim.Error, lambda: sim.recorded("bad.rec")).where == "bad.rec:2"
    assert raises(sim.Error, lambda: sim.recorded("none.rec")).code == 5
    if os.path.exists("/dev/full"):
        Path("full.rec").symlink_to("/dev/full")
        raises(sim.Error, lambda: sim.load("scenes/cloth.lua").record("full.rec"))


def test_plots_and_tables():
    some = "rk4,midpoint,verlet"
    for name in ("tradeoff", "stability"):
        told(name, "scenes/circle.lua" if name == "tradeoff" else "scenes/cloth.lua",
             "--integrators", "rk4,midpoint" if name == "tradeoff" else some, "--json", "--svg",
             f"{name}-line.svg", *(["--csv", "line.csv"] if name == "tradeoff" else []))
    sim.tradeoff("scenes/circle.lua", integrators=["rk4", "midpoint"], svg="tradeoff-own.svg",
                 csv="own.csv")
    sim.stability("scenes/cloth.lua", integrators=some.split(","), svg="stability-own.svg")
    for name in ("tradeoff", "stability"):
        assert filecmp.cmp(f"{name}-line.svg", f"{name}-own.svg", shallow=False), name
    mine, line = ([row.split(",")[:18] for row in Path(file).read_text().splitlines()]
                  for file in ("own.csv", "line.csv"))
    assert mine == line and len(mine) > 4  # but for the seconds of wall time and their spread
    error = raises(sim.Error, lambda: sim.stability("scenes/sample.lua", svg="world.svg"))
    assert error.code == 2 and not os.path.exists("world.svg")
    for wrong in (dict(svg="-"), dict(csv="-"), dict(csv="x.png"), dict(svg="/nowhere/x.svg")):
        error = raises(sim.Error, lambda: sim.tradeoff("scenes/circle.lua", **wrong))
        assert error.what and error.where and error.remedy, wrong


def test_budgets_of_lua():
    endless = "local x = 0 while true do x = x + 1 end"
    begun = time.monotonic()
    error = raises(sim.Error, lambda: sim.scene(endless, lua_budget="steps=1e6"))
    assert error.code == 3 and "too long" in error.what and time.monotonic() - begun < 60
    error = raises(sim.Error, lambda: sim.scene("local s = ('x'):rep(3e7)", lua_budget="memory=20"))
    assert error.code == 3 and "20 MB" in error.why
    for wrong in ("time", "time=0", "speed=3", "time=1,,steps=2"):
        error = raises(sim.Error, lambda: sim.load("cloth", lua_budget=wrong))
        assert error.code == 2 and "lua_budget" in error.where and error.remedy
    with sim.load("scenes/cloth.lua", lua_budget="time=60,memory=512,steps=1e8") as s:
        s.step(400)
        assert s.hash == "129f25ebe3e79c14"


def test_ctrl_c_ends_loading_and_pictures():
    endless = "local x = 0 while true do x = x + 1 end"
    Path("endless.lua").write_text(endless)
    interrupted(lambda: sim.scene(endless))
    interrupted(lambda: sim.load("endless.lua"))
    with sim.load("scenes/flag.lua") as s:
        large = dict(width=3000, height=2000)
        begun = time.monotonic()
        s.picture(**large)
        whole = time.monotonic() - begun
        assert interrupted(lambda: s.picture(**large), whole / 3) < whole / 3
        assert s.picture(width=64, height=48).startswith(b"\x89PNG")  # and can be used further
    assert threading.active_count() < 4


def test_pictures_have_the_bytes_of_the_command_line():
    told("scenes/flag.lua", "-n", "20", "--no-verify", "-q", "--size", "1600x1200", "--out",
         "line.png")
    with sim.load("scenes/flag.lua") as s:
        s.write("own.png", time=20 * s.dt, fps=1e6, width=1600, height=1200)
        assert filecmp.cmp("line.png", "own.png", shallow=False)


def test_imports():
    Path("tetra.obj").write_text(TETRAHEDRON)
    with warnings.catch_warnings(record=True) as notes:
        warnings.simplefilter("always")
        text = sim.import_scene("tetra.obj")
    assert text == told("import", "tetra.obj") and "4 points" in text
    assert [str(note.message) for note in notes] == [
        "note: 1 triangles without an area are left out"]
    with sim.scene(text) as s:
        assert s.x.shape == (4, 3)
    Path("bad.obj").write_text("v 0 0\n")
    for file, code in (("bad.obj", 2), ("none.obj", 5), ("none.h5", 5), ("x.stl", 5)):
        error = raises(sim.Error, lambda: sim.import_scene(file))
        assert error.code == code and error.what and error.where and error.why, vars(error)


def same_folders(mine, line):
    names = sorted(os.listdir(line))
    assert sorted(os.listdir(mine)) == names
    for name in names:
        assert filecmp.cmp(f"{mine}/{name}", f"{line}/{name}", shallow=False), name


def test_exports():
    Path("net.lua").write_text(NET)
    for name, words, asked in (
            ("net.lua", [], {}), ("net.lua", ["-n", "100", "--every", "10"],
                                  {"steps": 100, "every": 10}),
            ("net.lua", ["-T", "0.1234"], {"time": 0.1234})):
        line = told("export", name, "line", "--format", "lammps", "--json", *words, output=dict)
        with sim.load(name) as s:
            assert s.export("lammps", "mine", **asked) == {**line, "folder": "mine"}
        same_folders("mine", "line")
        shutil.rmtree("mine")
        shutil.rmtree("line")
    s = sim.load("scenes/cloth.lua")  # drag that LAMMPS means likewise, but rk4
    for work in (lambda: s.export("lammps", "no"), lambda: s.export("lampms", "no"),
                 lambda: s.export("lammps", "-"), lambda: s.export("h5md", "no.png"),
                 lambda: s.export("page", "no.png"), lambda: s.export("page", "x.html", time=1),
                 lambda: s.export("lammps", "no", time=1, steps=1),
                 lambda: s.export("lammps", "no", every=0),
                 lambda: s.export("lammps", "no", time="x")):
        error = raises(sim.Error, work)
        assert error.what and error.where and error.why and error.remedy, vars(error)
    assert not os.path.exists("no") and not os.path.exists("x.html")
    if "h5md" in {one["name"] for one in sim.plugins()}:
        line = told("export", "net.lua", "line.h5", "--format", "h5md", "--json", output=dict)
        with sim.load("net.lua") as s:
            assert s.export("h5md", "mine.h5") == {**line, "file": "mine.h5"}
        assert sim.import_scene("mine.h5").splitlines()[1:] == told(
            "import", "line.h5").splitlines()[1:]
    if (ROOT / "build/web/page.html").exists():
        told("export", "net.lua", "line.html", "--format", "page", "-q", "-s", "n=50")
        with sim.load("net.lua", n=50) as s:
            s.export("page", "mine.html")
        assert filecmp.cmp("line.html", "mine.html", shallow=False)


def test_engines():
    Path("net.lua").write_text(NET)
    for engine, method, program in (("lammps", "verlet", shutil.which("lmp")),
                                    ("petsc", "rk4", Path(PROGRAM).with_name("sim-petsc"))):
        if not program or not os.path.exists(program):
            print(f"skipped: {engine}")
            continue
        line = told("net.lua", "-i", method, "--engine", engine, "--json", "-q", "-n", "100",
                    output=dict)
        with sim.load("net.lua", integrator=method) as s:
            verdict = s.run_engine(engine, steps=100)
            assert without_times(s.summary) == without_times(line), engine
            assert verdict.word == line["verdict"]
            assert len(verdict.notes) == 1 and "agree to" in verdict.notes[0]
        with sim.load("net.lua", integrator=method) as s:
            s.run_engine(engine, steps=100, compare=False, verify=False)
            assert s.hash == line["systems"][0]["hash"]
    s = sim.load("scenes/cloth.lua")
    for work in (lambda: s.run_engine("lampms"), lambda: s.run_engine("lammps"),
                 lambda: s.run_engine("lammps", ranks=0), lambda: s.run_engine("lammps", ranks=1.5),
                 lambda: s.run_engine("lammps", ranks=2, launch="lmp"),
                 lambda: s.run_engine("lammps", time=1, steps=2),
                 lambda: s.run_engine("lammps", results="nowhere")):
        error = raises(sim.Error, work)
        assert error.what and error.where and error.why and error.remedy, vars(error)
    assert s.steps == 0


def test_results_of_an_engine():
    if not shutil.which("lmp"):
        print("skipped: lammps")
        return
    Path("net.lua").write_text(NET)
    with sim.load("net.lua", without="drag") as s:
        s.export("lammps", "away", time=0.1)
    ran = subprocess.run(["lmp", "-in", "scene.in"], cwd="away", capture_output=True, check=False)
    assert ran.returncode == 0, ran.stdout
    line = told("import", "away", "--json", "-q", output=dict)
    with sim.resume("away") as s:
        s.run_engine(results="away")
        assert without_times(s.summary) == without_times(line)


def main():
    tests = [(name, test) for name, test in globals().items() if name.startswith("test_")]
    home = os.getcwd()
    for name, test in tests:
        with tempfile.TemporaryDirectory() as folder:
            os.chdir(folder)
            try:
                test()
            except BaseException:
                print(f"failed: {name}")
                raise
            finally:
                os.chdir(home)
    print(f"{len(tests)} passed, 0 failed")


main()
