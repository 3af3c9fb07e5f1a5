#!/usr/bin/env python3
"""The package of Python against the command line and closed forms. `package_test.py LIBRARY SIM`"""

import ast
import copy
import csv
import gc
import json
import os
import pickle
import signal
import subprocess
import sys
import tempfile
import threading
import time

from tree import PROGRAM, ROOT, need_numpy

need_numpy()

import numpy as np  # noqa: E402

import sim  # noqa: E402

CLOTH = "129f25ebe3e79c14"


def raises(kind, work):
    try:
        work()
    except kind as error:
        return error
    raise AssertionError(f"{kind.__name__} was not raised")


def test_hashes_are_those_of_the_command_line():
    scenes = sim.scenes()
    assert len(scenes) > 40
    for name in scenes:
        told = subprocess.run([PROGRAM, name, "-n", "20", "--no-verify", "--json", "-q"],
                              capture_output=True, text=True, check=False)
        hashes = [one["hash"] for one in json.loads(told.stdout)["systems"]]
        with sim.load(name) as s:
            if len(hashes) == 1:
                s.step(20)
                assert [s.hash] == hashes, name
                continue
            # A world's systems go by time on the command line, each by its own steps here.
            told = subprocess.run([PROGRAM, name, "-T", "0.1", "--no-verify", "--json", "-q"],
                                  capture_output=True, text=True, check=False)
            s.run(0.1, verify=False)
            assert [one.hash for one in s.systems] == [
                one["hash"] for one in json.loads(told.stdout)["systems"]], name


def test_a_run_is_that_of_the_command_line():
    for name in ("scenes/cloth.lua", "scenes/kapitza.lua", "scenes/lorenz.lua"):
        told = json.loads(subprocess.run([PROGRAM, name, "--verify", "--json", "-q"],
                                         capture_output=True, text=True, check=False).stdout)
        with sim.load(name) as s:
            verdict = s.run(verify=True)
            one, own = told["systems"][0], s.summary["systems"][0]
            assert verdict.word == told["verdict"] and verdict.reason == one["reason"], name
            assert s.hash == one["hash"]
            for figure in ("figures", "energy", "steps", "t", "last_step"):
                assert one.get(figure) == own.get(figure), (name, figure)


def test_state_and_views():
    s = sim.load("scenes/cloth.lua")
    first = s.x
    assert first.shape == (64, 3) and s.v.shape == (64, 3) and s.t == 0
    view = s.view("position")
    assert np.array_equal(view[:], first) and view.shape == (64, 3)
    assert np.array_equal(view + 1, first + 1) and np.sum(view) == np.sum(np.asarray(view))
    kept = np.asarray(view)
    s.step()
    for use in (lambda: view + 1, lambda: view[0], lambda: view.shape, lambda: len(view),
                lambda: np.asarray(view)):
        assert isinstance(raises(sim.StaleView, use), sim.Error)
    assert np.array_equal(kept, first)  # a copy stays as it was
    assert not np.array_equal(s.x, first)
    s.step(399)
    assert s.hash == CLOTH and s.steps == 400
    assert abs(s.energy - (s.energy.kinetic + s.energy.potential)) == 0
    s.close()
    raises(sim.Error, lambda: s.x)
    s.close()
    assert "closed" in repr(s)


def test_values_of_parameters():
    for n in (4, 4.0, "4", np.int64(4), np.float64(4)):
        with sim.load("scenes/cloth.lua", n=n) as s:
            assert s.x.shape == (16, 3)
    error = raises(sim.Error, lambda: sim.load("scenes/cloth.lua", m=3))
    assert error.code == 2 and "m" in error.where and "n" in error.remedy and error.why
    error = raises(sim.Error, lambda: sim.load("scenes/clot.lua"))
    assert error.code == 5 and "cloth" in error.remedy
    raises(sim.Error, lambda: sim.load("scenes/cl\0th.lua"))
    with sim.load("cloth", args={"n": 3}, integrator="rk4", dt=0.002) as s:
        assert s.dt == 0.002 and s.description["systems"][0]["integrator"] == "rk4"


def test_bad_arguments():
    """What ctypes would cut or pad is an error with where, why and remedy; numpy's numbers pass."""
    s = sim.load("scenes/cloth.lua")
    before = s.hash
    bad = [lambda: s.springs(2**32), lambda: s.springs(1.5), lambda: s.pin(2**32 + 12),
           lambda: s.pin(-1), lambda: s.pin("12"), lambda: s.set_position(12, [0.1, 0.2]),
           lambda: s.set_position(12, [0.1, 0.2, 0.3, 0.4]), lambda: s.set_position(12, 5),
           lambda: s.set_position(12, ["a", 0, 0]), lambda: s.set_velocity(12, [0, np.nan, 0]),
           lambda: s.set_velocity(2**31, [0, 0, 0]), lambda: s.set_component(0, 1.0),
           lambda: s.cut(0, 2**32 + 1), lambda: setattr(s, "dt", np.nan),
           lambda: setattr(s, "dt", "fast"), lambda: setattr(s, "dt", 0), lambda: s.step(-1),
           lambda: s.step(1.5), lambda: s.step(None), lambda: s.step(np.float64(2)),
           lambda: s.run(0), lambda: s.run(-1), lambda: s.run(np.nan), lambda: s.run(1e300),
           lambda: s.run("1"), lambda: s.choose("1%", time=-1),
           lambda: s.picture(width=2**32 + 64), lambda: s.picture(height=-1),
           lambda: s.write("x.csv", fps=0), lambda: s.write("x.csv", time=np.inf),
           lambda: s.write("x.nonsense"), lambda: s.view("nonsense"), lambda: s.part("x\0"),
           lambda: s.switch("nonsense", True), lambda: s.set_integrator("rk44"),
           lambda: s.restore(sim.load("scenes/cloth.lua").snapshot()),
           lambda: sim.load("cloth", seed=-1), lambda: sim.load("cloth", threads=2**32 + 1),
           lambda: sim.load("cloth", dt=-1), lambda: sim.load("cloth", dt="x"),
           lambda: sim.load("cloth", n=1e400), lambda: sim.load("cloth", integrator="rk4:x=1"),
           lambda: sim.load("cloth", off="nonsense"), lambda: sim.load("cloth", without=["x"]),
           lambda: sim.field(lambda t, x: -x, [1.0], dt=0),
           lambda: sim.field(lambda t, x: -x, []), lambda: sim.field(lambda t, x: -x, [np.nan]),
           lambda: sim.field(lambda t, x: -x, [1.0], duration=-1),
           lambda: sim.scene("return 1"), lambda: sim.scene("\0")]
    for i, work in enumerate(bad):
        error = raises(sim.Error, work)
        assert error.what and error.where and error.why and error.remedy and error.code, (
            i, vars(error))
    assert s.hash == before and s.t == 0 and not os.path.exists("x.csv")
    s.pin(np.int64(12))
    s.set_position(np.int32(12), np.array([0.1, 0.2, 0.3], np.float32))
    s.step(np.int64(3))
    assert s.steps == 3 and len(s.springs(np.uint8(12))) == 11
    assert sim.load("cloth", n=np.int64(3), seed=2**64 - 1, dt=np.float32(0.25)).dt == 0.25


def test_a_scene_belongs_to_one_call_at_a_time():
    s = sim.load("scenes/cloth.lua", n=24)
    said = []

    def intrudes(what, done):
        for work in (s.step, s.reset, s.snapshot, lambda: s.x, lambda: s.energy, lambda: s.verdict,
                     lambda: s.view("position"), lambda: s.run(1), lambda: s.pin(3)):
            said.append(raises(sim.Error, work).what)
        return False

    s.run(1e6, progress=intrudes)
    assert said and set(said) == {"busy handle"}
    s.step()
    f = sim.field(lambda t, x: f.x, [1.0])  # a right-hand side that asks for its own state
    assert raises(sim.Error, f.step).what == "busy handle"


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


ENDLESS = """
local p, begun = sim.particles(), 0
p:add {0, 0, 0}
local f = sim.force.lua { f = function(t) while t > 0.05 do end return 0, 0, 0 end }
return sim.scene { particles = p, forces = { f }, integrator = "euler", dt = 0.01, duration = 1 }
"""


def test_ctrl_c_ends_a_single_step():
    with sim.scene(ENDLESS) as s:
        s.step(6)
        assert interrupted(s.step) < 5 and s.steps == 6
        assert interrupted(lambda: s.step(100)) < 5 and s.steps == 6
        assert interrupted(lambda: s.run(1, verify=False)) < 5 and s.steps == 6
        s.reset()
        s.step(5)
    # One of many particles, in steps that take much longer than the library is left alone.
    with sim.load("scenes/cloth.lua", n=1000, threads=1, integrator="dop853:tol=1e-3", dt=1e3) as s:
        assert interrupted(s.step) < 20 and s.steps == 0 and s.t == 0
        s.set_integrator("rk4")
        s.dt = 1e-4
        s.step()
        cut = s.hash
        with sim.load("scenes/cloth.lua", n=1000, threads=1, dt=1e-4) as whole:
            whole.step()
            assert whole.hash == cut
        assert interrupted(lambda: s.step(10**9)) < 20 and 0 < s.steps < 10**9
    with sim.load("scenes/cloth.lua") as s:
        raises(sim.Error, lambda: s.step(10**30))
        assert interrupted(lambda: s.step(10**12)) < 5
    f = sim.field(lambda t, x: -x, [1.0])
    assert interrupted(lambda: f.step(10**9)) < 5 and f.steps > 0
    slow = sim.field(lambda t, x: time.sleep(0.01) or -x, [1.0])
    assert interrupted(lambda: slow.step(10**9)) < 5
    assert threading.active_count() < 4


def test_copies_and_forks():
    s, threaded = sim.load("scenes/cloth.lua"), sim.load("scenes/cloth.lua", n=100, threads=2)
    for owner in (s, s.snapshot()):
        for work in (copy.copy, copy.deepcopy, pickle.dumps):
            assert raises(sim.Error, lambda: work(owner)).what == "no copy"
    threaded.step()
    child = os.fork()
    if child == 0:
        code = 1
        try:
            s.step(400)
            told = raises(sim.Error, threaded.step)
            code = 0 if s.hash == CLOTH and "threads" in told.why else 2
        finally:
            os._exit(code)
    assert os.waitpid(child, 0)[1] == 0
    threaded.step()
    s.step(400)
    assert s.hash == CLOTH


def test_callbacks_that_misbehave():
    def closes(what, done):
        s.close()
        gc.collect()

    s = sim.load("scenes/cloth.lua", n=32)
    raises(sim.Error, lambda: s.run(2.0, progress=closes))

    def leaves(t, x):
        raise SystemExit(3)

    f = sim.field(leaves, [1.0])
    assert raises(SystemExit, f.step).code == 3 and f.t == 0

    def collects(t, x):
        gc.collect()
        return -x

    f = sim.field(collects, [1.0], dt=0.1)
    del collects
    f.step(10)
    assert abs(f.x[0] - np.exp(-1)) < 1e-6
    views = [sim.load("scenes/cloth.lua").view("position") for _ in range(20)]
    gc.collect()
    assert all(view.shape == (64, 3) for view in views)  # each keeps its scene
    for text in ("x" * 10**6, "\udcff", "\ud800", "%s%n", "\x1b[2J"):
        for work in (lambda: sim.load(text), lambda: sim.scene(text),
                     lambda: sim.load("cloth", integrator=text), lambda: sim.study(text, "cloth"),
                     lambda: sim.load("cloth").picture(camera=text)):
            raises(sim.Error, work)


def test_checkpoints():
    with tempfile.TemporaryDirectory() as folder:
        file = os.path.join(folder, "cloth.snap")
        with sim.load("scenes/cloth.lua") as s:
            s.step(100)
            s.save(file)
            s.step(5)
            s.resume(file)
            assert s.steps == 100
            s.step(300)
            assert s.hash == CLOTH
        with sim.resume(file) as s:
            assert s.run(1.5).word == "trusted" and s.hash == CLOTH
        told = json.loads(subprocess.run(
            [PROGRAM, "scenes/cloth.lua", "--resume", file, "--json", "-q"], capture_output=True,
            text=True, check=True).stdout)
        assert told["systems"][0]["hash"] == CLOTH and "changed" not in told["reason"]
        # And the other way round, with the parameters and the books of the run.
        words = ["scenes/pendulum.lua", "-s", "n=6", "-T", "1", "--snap", file, "-q"]
        subprocess.run([PROGRAM, *words], check=True)
        told = json.loads(subprocess.run(
            [PROGRAM, "scenes/pendulum.lua", "--resume", file, "-T", "2", "--json", "-q"],
            capture_output=True, text=True, check=True).stdout)["systems"][0]
        with sim.resume(file) as s:
            assert len(s.x) == 6
            s.run(1)
            own = s.summary["systems"][0]
            assert own["hash"] == told["hash"] and own["energy"] == told["energy"]
        with sim.load("scenes/cloth.lua") as s:
            assert raises(sim.Error, lambda: s.resume(file)).code == 6
            assert s.steps == 0
        scene = os.path.join(folder, "mine.lua")
        with open(scene, "w") as out:
            out.write("return require 'scenes.cloth'")
        with sim.load(scene) as s:
            raises(sim.Error, lambda: s.save(scene))  # it was read
        assert os.path.getsize(scene) < 100


def test_what_runs_are_asked():
    with sim.load("scenes/pendulum.lua") as s:
        s.run(1, of="mean sag")
        judged = s.summary["systems"][0]["observed"]["mean sag"]["value"]
        told = json.loads(subprocess.run(
            [PROGRAM, "scenes/pendulum.lua", "-T", "1", "--of", "mean sag", "--json", "-q"],
            capture_output=True, text=True, check=True).stdout)
        assert judged == told["systems"][0]["observed"]["mean sag"]["value"]
        raises(sim.Error, lambda: s.run(1, of="sag"))
        s.check("energy=50%")
        assert raises(sim.Error, lambda: s.check("energy=0")).code == 8
        assert raises(sim.Error, lambda: s.check("nonsense")).code == 2
        rest = s.come_to_rest()
        assert rest["force"] < 1e-6 * rest["in_play"] and not s.v.any()
    with sim.load("scenes/rope.lua") as s:
        s.step(3)
        one = s.tensions[0]
        assert one["constraint"] == "distance" and one["b"] == 1 and len(one["force"]) == 3
    with sim.load("scenes/cloth.lua") as s:
        assert s.tensions == []


def test_a_scene_that_ends_the_numbers():
    with sim.load("scenes/cloth.lua", integrator="euler", dt=10) as s:
        error = raises(sim.Error, lambda: s.step(100000))
        assert error.code == 4 and "not finite" in error.why
        s.reset()
        assert s.run(1e6).word == "diverged"


def test_fields():
    assert np.allclose(sim_field_after(1.0), [np.cos(1), np.sin(1)], atol=1e-9)

    def fails(t, x):
        if t > 0.5:
            raise ValueError("too late")
        return -x

    f = sim.field(fails, np.ones(3), dt=0.01)
    assert str(raises(ValueError, lambda: f.step(100))) == "too late"
    assert 0.45 < f.t <= 0.5 and np.allclose(f.x, np.exp(-f.t), atol=1e-9)
    raises(ValueError, lambda: sim.field(lambda t, x: np.ones(7), np.ones(3)).step())
    points = np.random.default_rng(3).normal(size=(50, 4))
    many = sim.field(lambda t, x: -x, points, dt=0.01)
    many.step(100)
    assert many.x.shape == (50, 4) and np.allclose(many.x, points * np.exp(-1), atol=1e-9)


def sim_field_after(time_):
    f = sim.field(lambda t, x: np.array([-x[1], x[0]]), [1.0, 0.0], integrator="rk4", dt=0.01)
    f.step(round(time_ / 0.01))
    return f.x


def test_threads_run_at_once():
    """The library is without Python's lock: this thread goes on while another steps."""
    s = sim.load("scenes/cloth.lua", n=64)
    begun, over, counted = threading.Event(), threading.Event(), 0

    def work():
        begun.set()
        sim._library.lib.sim_step(s._handle, 3000, None, None)  # one call
        over.set()

    worker = threading.Thread(target=work)
    worker.start()
    begun.wait()
    while not over.is_set():
        counted += 1
    worker.join()
    assert counted > 1000
    hashes = []
    workers = [threading.Thread(target=lambda: hashes.append(run_cloth())) for _ in range(4)]
    for one in workers:
        one.start()
    for one in workers:
        one.join()
    assert hashes == 4 * [CLOTH]


def run_cloth():
    with sim.load("scenes/cloth.lua") as s:
        s.run(verify=False)
        return s.hash


def test_ctrl_c_ends_long_work():
    for work in (lambda s: s.step(10**12), lambda s: s.run(1e7, progress=False)):
        with sim.load("scenes/pendulum.lua") as s:
            timer = threading.Timer(0.3, lambda: os.kill(os.getpid(), signal.SIGINT))
            begun = time.monotonic()
            timer.start()
            raises(KeyboardInterrupt, lambda: work(s))
            assert s.steps > 0 and time.monotonic() - begun < 60
            s.step()
    with sim.load("scenes/pendulum.lua") as s:
        told = []
        s.run(1e7, progress=lambda what, done: told.append(done) or len(told) < 3)
        assert len(told) == 3 and s.verdict.word == "suspect" and not s.verdict


def test_studies():
    r = sim.tradeoff("scenes/circle.lua", budget="1%", integrators=["rk4", "euler"], time=1)
    assert r.recommended.integrator in ("rk4", "euler") and len(r.rows) > 4
    assert {"integrator", "dt", "error", "cost"} <= set(r.rows[0])
    r = sim.order("scenes/circle.lua", integrators=["rk4"], time=1)
    assert abs(r.integrators[0]["observed"] - 4) < 0.3
    r = sim.stability("scenes/cloth.lua", integrators=["verlet"])
    assert r.omega_max > 0 and r.rows[0]["name"] == "verlet"
    assert sim.rest("scenes/cloth.lua").force < 1e-6
    r = sim.minimal("scenes/cloth.lua", time=0.2, progress=False)
    assert r.rows and "option" in r.rows[0]
    raises(sim.Error, lambda: sim.tradeoff("scenes/circle.lua", budget="nonsense"))
    raises(sim.Error, lambda: sim.study("nonsense", "scenes/circle.lua"))
    assert any(one["name"] == "spring" for one in sim.plugins())


def test_an_error_is_asked_for():
    words = ["--error", "1e-4", "-T", "1", "--json", "-q"]
    told = json.loads(subprocess.run([PROGRAM, "scenes/pendulum1.lua", *words],
                                     capture_output=True, text=True, check=True).stdout)
    with sim.load("scenes/pendulum1.lua") as s:
        chosen = s.choose("1e-4", time=1)
        goal = told["systems"][0]["error_goal"]
        for name in ("integrator", "dt", "error", "allowed", "kept", "cost", "candidates"):
            assert chosen[name] == goal[name], name
        assert s.dt == chosen["dt"] and chosen["kept"] and chosen["error"] <= 1e-4
        verdict = s.run(1)
        assert s.hash == told["systems"][0]["hash"] and verdict.word == told["verdict"]
        assert s.summary["systems"][0]["error_goal"]["dt"] == s.dt
        assert verdict.figures == told["systems"][0]["figures"]
        raises(sim.Error, lambda: s.choose("1e-4"))  # not at its start any more
    # A scene that asks for itself: its run does what the program does.
    with tempfile.TemporaryDirectory() as folder:
        file = os.path.join(folder, "own.lua")
        with open(os.path.join(str(ROOT), "scripts/scenes/pendulum1.lua")) as scene:
            text = scene.read().replace("duration = ", 'error = "1e-4", duration = ')
        assert "error = " in text
        with open(file, "w") as out:
            out.write(text)
        told = json.loads(subprocess.run([PROGRAM, file, "--json", "-q"], capture_output=True,
                                         text=True, check=True).stdout)
        with sim.load(file) as s:
            s.run()
            assert s.hash == told["systems"][0]["hash"]
            assert s.summary["systems"][0]["error_goal"]["integrator"] == \
                told["systems"][0]["error_goal"]["integrator"]
        with sim.load(file) as s:
            assert s.run(1e6, progress=lambda what, done: False).word == "suspect" and s.t < 1e6
    with sim.load("scenes/cloth.lua") as s:
        assert s.choose() is None  # it asks for nothing
        raises(sim.Error, lambda: s.choose("nonsense"))
        raises(sim.Error, lambda: s.choose("1%", of="nonsense"))
    with sim.load("scenes/pendulum.lua") as s:
        s.step(3)
        assert s.description["systems"][0]["observed"] == ["sag"]
        assert abs(s.observe("sag")) < 10
        raises(sim.Error, lambda: s.observe("mean sag"))
        raises(sim.Error, lambda: s.observe("sog"))
        s.run(0.1)
        assert s.observe("sag") == s.summary["systems"][0]["observed"]["sag"]["value"]


def test_methods_are_compared():
    asked = ["rk4", ("verlet", 0.01), ("rk4", 0.005)]
    r = sim.compare("scenes/pendulum1.lua", asked, time=1)
    told = json.loads(subprocess.run(
        [PROGRAM, "compare", "scenes/pendulum1.lua", "-T", "1", "--json", "-i", "rk4", "-i",
         "verlet", "-i", "rk4", "-d", "0.01", "-d", "0.01", "-d", "0.005"], capture_output=True,
        text=True, check=True).stdout)
    assert r.reference["how"] == told["reference"]["how"] and r.reference["error"] < 1e-12
    with sim.load("scenes/pendulum1.lua") as s:
        assert r.rows[0]["dt"] == s.dt
    for own, other in list(zip(r.rows, told["methods"]))[1:]:
        for name in ("integrator", "dt", "steps", "evaluations", "error", "error_end", "most"):
            assert own[name] == other[name], name
    # The motion of verlet itself, against a reference of one's own.
    given = sim.compare("scenes/pendulum1.lua", [("verlet", 0.01)], time=1,
                        reference=("dop853", 0.001))
    with sim.load("scenes/pendulum1.lua", integrator="verlet", dt=0.01) as one:
        with sim.load("scenes/pendulum1.lua", integrator="dop853", dt=0.001) as true:
            one.step(100)
            true.step(1000)
            off = (one.x - true.x)[1:]
    assert given.reference["error"] is None
    assert abs(given.rows[0]["rms"] - np.sqrt(np.mean(off**2))) < 1e-10
    assert abs(r.rows[1]["rms"] - given.rows[0]["rms"]) < 1e-3 * r.rows[1]["rms"]
    assert len(sim.compare("scenes/circle.lua", time=0.1).rows) == 3
    raises(sim.Error, lambda: sim.compare("scenes/circle.lua", ["rk4"], time=-1))


def test_scenes_are_swept():
    r = sim.sweep("scenes/cloth.lua", {"n": [4, 8], "integrator": ["rk4", "euler"]}, threads=2)
    assert [(row["n"], row["integrator"]) for row in r.rows] == [
        (4, "rk4"), (4, "euler"), (8, "rk4"), (8, "euler")]
    assert r.rows[2]["hash"] == CLOTH and r.rows[2]["verdict"] == "trusted"
    assert r.rows[3]["verdict"] == "diverged" and r.rows[3]["exit"] == 4
    table = subprocess.run([PROGRAM, "sweep", "scenes/cloth.lua", "--over", "n=4,8", "--over",
                            "integrator=rk4,euler", "--progress", "off"], capture_output=True,
                           text=True, check=True).stdout.splitlines()
    for row, line in zip(r.rows, csv.DictReader(table)):
        for name in ("verdict", "reason", "hash"):
            assert row[name] == line[name], name
        for name in ("steps", "evaluations", "t", "kinetic", "drift", "error"):
            assert row[name] == (float(line[name]) if line[name] else None), name
    r = sim.sweep("scenes/cloth.lua", {"n": ["many", 3]})
    assert "many" in r.rows[0]["error"] and "error" not in r.rows[1] or r.rows[1]["error"] > 0
    text = """
    local w = sim.arg("w", 1, "rad/s")
    return sim.scene { name = "c", state = { x = {{1, 0, 0}} },
      field = sim.field.rotation { omega = w }, integrator = "rk4", dt = 0.01, duration = 1,
      observe = { px = function(s) return s:position(0)[1] end } }"""
    r = sim.sweep("c.lua", {"w": np.linspace(1, 2, 5)}, text=text, of="mean px")
    for row in r.rows:
        assert abs(row["px"] - np.cos(row["w"])) < 1e-6
        assert abs(row["mean px"] - np.sin(row["w"]) / row["w"]) < 1e-3
    r = sim.sweep("c.lua", {"w": [1, 2]}, text=text, run=lambda s: {"end": (s.run(), s.x[0, 0])[1]})
    assert [abs(row["end"] - np.cos(row["w"])) < 1e-6 for row in r.rows] == [True, True]
    for name, value in (("w", "1,2"), ("w", "1..2"), ("w", "1:2:3"), ("w", "")):
        raises(sim.Error, lambda: sim.sweep("c.lua", {name: [value]}, text=text))
    raises(sim.Error, lambda: sim.sweep("scenes/cloth.lua", {"nonsense": [1]}))


def test_ctrl_c_ends_every_study():
    slow = dict(n=48)

    def circle(s):
        return {"t": s.run(1e6, progress=False) and s.t}

    works = {
        "tradeoff": lambda: sim.tradeoff("scenes/cloth.lua", **slow),
        "stability": lambda: sim.stability("scenes/drape_self.lua", **slow),
        "order": lambda: sim.order("scenes/cloth.lua", **slow),
        "minimal": lambda: sim.minimal("scenes/cloth.lua", **slow),
        "compare": lambda: sim.compare("scenes/cloth.lua", **slow),
        "compare with a run": lambda: sim.compare("scenes/cloth.lua", ["rk4"], time=1e6,
                                                  reference=("rk4", 1e-4), **slow),
        "sweep": lambda: sim.sweep("scenes/cloth.lua", {"seed": list(range(400))}, time=1e3),
        "sweep by a function": lambda: sim.sweep("scenes/circle.lua", {"seed": [1, 2, 3, 4]},
                                                 run=circle),
        "rest": lambda: sim.rest("scenes/drape_self.lua", **slow),
        "extremes": lambda: sim.study("extremes"),
    }
    for name, work in works.items():
        timer = threading.Timer(0.5, lambda: os.kill(os.getpid(), signal.SIGINT))
        begun = time.monotonic()
        timer.start()
        raises(KeyboardInterrupt, work)
        assert time.monotonic() - begun < 60, name
    assert threading.active_count() < 4


class Notebook:
    """What IPython is to the package: a shell with a kernel, and a display that may be updated."""

    def __init__(self):
        self.shown, self.threads = [], []

    def get_ipython(self):
        return self

    kernel = True

    def HTML(self, text):
        return text

    def display(self, text, display_id=False):
        assert display_id
        self.update(text)
        return self

    def update(self, text):
        self.shown.append(text)
        self.threads.append(threading.current_thread())


def test_progress():
    told = []
    with sim.load("scenes/cloth.lua", n=24) as s:
        s.run(1.0, progress=lambda what, done: told.append((what, done)))
        assert told and all(isinstance(what, str) and 0 <= done <= 1 for what, done in told)
        assert sorted(done for _, done in told[:3]) == [done for _, done in told[:3]]

        def fails(what, done):
            raise ValueError(what)

        raises(ValueError, lambda: s.run(1.0, progress=fails))
        s.step()
    book = Notebook()
    sys.modules["IPython"] = sys.modules["IPython.display"] = book
    try:
        with sim.load("scenes/cloth.lua", n=24) as s:
            s.run(1.0, progress=True)
        assert "<progress" in book.shown[0] and book.shown[-1] == ""
        assert set(book.threads) == {threading.main_thread()}
        count = len(book.shown)
        with sim.load("scenes/cloth.lua") as s:
            s.run()  # too short to be shown
            s.run(0.1, progress=False)
        assert len(book.shown) == count
        timer = threading.Timer(2, lambda: os.kill(os.getpid(), signal.SIGINT))
        timer.start()
        with sim.load("scenes/cloth.lua", n=24) as s:
            raises(KeyboardInterrupt, lambda: s.run(1e6))  # shown after a second, and taken away
        assert len(book.shown) > count + 1 and book.shown[-1] == ""
    finally:
        del sys.modules["IPython"], sys.modules["IPython.display"]


def test_pictures(folder="."):
    s = sim.load("scenes/cloth.lua")
    data = s.picture(width=64, height=48)
    assert data.startswith(b"\x89PNG") and s._repr_png_().startswith(b"\x89PNG")
    assert data == s.picture(width=64, height=48)
    assert "no judged run" in s._repr_html_()
    s.run()
    assert "trusted" in s._repr_html_() and CLOTH in s._repr_html_()
    raises(sim.Error, lambda: s.picture(width=0))
    raises(sim.Error, lambda: s.picture(width=0, height=0))
    other = s.picture(width=64, height=48, camera="eye=3,1,2 at=0.5,0,0.5 fov=25", springs="shear",
                      wireframe=True)
    assert other.startswith(b"\x89PNG") and other != data
    raises(sim.Error, lambda: s.picture(camera="eye=1"))
    with tempfile.TemporaryDirectory() as folder:
        film = os.path.join(folder, "cloth.html")
        s.write(film, time=0.1, width=64, height=48, color="speed", camera="fov=20")
        assert os.path.getsize(film) > 1000
        raises(sim.Error, lambda: s.write(os.path.join(folder, "a-%d.png"), time=0.1, camera="x"))
        assert os.listdir(folder) == ["cloth.html"]
        sides = os.path.join(folder, "sides.png")
        r = sim.compare("scenes/pendulum1.lua", ["rk4", "verlet"], time=1, out=sides,
                        look={"color": "speed", "size": "128x64"})
        with open(sides, "rb") as file:
            assert file.read(4) == b"\x89PNG" and len(r.rows) == 2


def test_two_threads_in_one_scene():
    """Each call is whole or refused."""
    s, taken, said = sim.load("scenes/cloth.lua"), [0, 0], set()

    def work(i):
        for _ in range(3000):
            try:
                s.step()
                taken[i] += 1
            except sim.Error as error:
                said.add(error.what)

    workers = [threading.Thread(target=work, args=(i,)) for i in range(2)]
    for one in workers:
        one.start()
    for one in workers:
        one.join()
    assert s.steps == sum(taken) and said <= {"busy handle"}, (s.steps, taken, said)


def test_syntax_is_that_of_3_9():
    files = sorted((ROOT / "python/sim").glob("*.py*"))
    assert len(files) >= 5
    for file in files:
        ast.parse(file.read_text(), str(file), feature_version=(3, 9))


def test_stubs_name_what_there_is():
    """Every public name and method has a type in the stub, and none is invented."""
    stub = ast.parse((ROOT / "python/sim/__init__.pyi").read_text())
    typed = {}
    for node in stub.body:
        if isinstance(node, ast.ClassDef):
            typed[node.name] = {each.name if isinstance(each, ast.FunctionDef) else each.target.id
                                for each in node.body
                                if isinstance(each, (ast.FunctionDef, ast.AnnAssign))}
        elif isinstance(node, ast.FunctionDef):
            typed[node.name] = None
    assert set(typed) == set(sim.__all__), set(typed) ^ set(sim.__all__)
    for name, members in typed.items():
        assert getattr(sim, name).__doc__, name
        if members is None:
            continue
        public = {one for one in dir(getattr(sim, name)) if not one.startswith("_")}
        own = {one for one in vars(getattr(sim, name)) if not one.startswith("_")}
        assert own <= members, (name, own - members)
        if name in ("Scene", "System"):
            extra = {one for one in members if not one.startswith("_")} - public - {"systems"}
            assert not extra, (name, extra)


def main():
    tests = [(name, test) for name, test in globals().items() if name.startswith("test_")]
    for name, test in tests:
        try:
            test()
        except BaseException:
            print(f"failed: {name}")
            raise
    print(f"{len(tests)} passed, 0 failed")


main()
