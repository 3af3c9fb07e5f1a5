#!/usr/bin/env python3
"""The package of Python against the command line and closed forms. `package_test.py LIBRARY SIM`"""

import ast
import json
import os
import signal
import subprocess
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
            # A world's systems go by time on the command line, each by itself here.
            if len(hashes) == 1:
                s.step(20)
                assert [s.hash] == hashes, name


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
    r = sim.compare("scenes/circle.lua", ["rk4", "euler"], time=1)
    assert r.rows[0]["rms"] < r.rows[1]["rms"]
    r = sim.sweep("scenes/cloth.lua", {"n": [4, 8]})
    assert [row["n"] for row in r.rows] == [4, 8] and r.rows[1]["hash"] == CLOTH
    r = sim.sweep("scenes/cloth.lua", {"n": ["many"]})
    assert "error" in r.rows[0]
    assert any(one["name"] == "spring" for one in sim.plugins())


def test_pictures(folder="."):
    s = sim.load("scenes/cloth.lua")
    data = s.picture(width=64, height=48)
    assert data.startswith(b"\x89PNG") and s._repr_png_().startswith(b"\x89PNG")
    assert data == s.picture(width=64, height=48)
    assert "no judged run" in s._repr_html_()
    s.run()
    assert "trusted" in s._repr_html_() and CLOTH in s._repr_html_()
    raises(sim.Error, lambda: s.picture(width=0))


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
