"""Studies of a scene, and sweeps over its parameters."""

import concurrent.futures
import itertools
import json
import math
import os

from ._library import (Error, ErrorRecord, Watching, as_bytes, as_setting, lib, options,
                       taken, texts)
from ._scene import _asked, load, scene as scene_of


class Result:
    """What a study found: its JSON as attributes (`.recommended.dt`) and items; `rows` are its
    table, a list of dicts that pandas.DataFrame takes."""

    def __init__(self, data, rows=()):
        self.json = data
        self.rows = list(rows)

    def __getattr__(self, name):
        try:
            return _wrapped(self.__dict__["json"][name])
        except KeyError:
            raise AttributeError(name) from None

    def __getitem__(self, name):
        return self.json[name]

    def __repr__(self):
        return f"<sim.Result {', '.join(self.json)}; {len(self.rows)} rows>"


def _wrapped(value):
    return Result(value) if isinstance(value, dict) else value


def _texts_of(asked):
    pairs = {name: ",".join(map(str, value)) if isinstance(value, (list, tuple)) else
             as_setting(value) for name, value in asked.items() if value not in (None, (), "")}
    return texts([f"{name}={value}" for name, value in pairs.items()])


def study(name, scene=None, asked=None, text=None, progress=None, args=None, **rest):
    """The study `name` of a scene's file, or of its `text`; `asked` are its own words, a dict.
    A Result, without rows. Named arguments else as in load()."""
    failed, record, watching = ErrorRecord(), _asked(args, rest), Watching(progress)
    block = watching.call(
        lib.sim_study, as_bytes(name), None if scene is None else as_bytes(scene),
        None if text is None else as_bytes(text), _texts_of(asked or {}), record, watching.watch,
        None, failed)
    if not block:
        watching.finish()
        raise failed.exception()
    found = taken(block, failed)
    watching.finish()
    return Result(json.loads(found) if found else {})


def _points(result):
    return [{"integrator": one["name"], "order": one["order"], **point}
            for system in result.json.get("systems", [result.json])
            for one in system.get("integrators", []) for point in one.get("points", [])]


def tradeoff(scene, budget="0.1%", of=None, time=None, integrators=None, **rest):
    """Speed against accuracy of every integrator, and which to take.

    budget: the error allowed, a share of the scene's size ("1%") or an amount ("1 mm"); of: what is
    judged, as "mean sag" of what the scene observes (positions if not given); time in s;
    integrators: names, all that fit if not given. progress: None shows a line for long work, True
    always, False never, or a function (what, done from 0 to 1); Ctrl-C ends it.
    result.recommended, .cheapest: integrator, dt (s) or tol, error (m), command; result.rows: one a
    run, with integrator, dt, error, cost, seconds, front.
    """
    result = study("tradeoff", scene,
                   dict(budget=budget, of=of, time=time, integrators=integrators), **rest)
    result.rows = _points(result)
    return result


def stability(scene, at=None, integrators=None, **rest):
    """How fast a scene vibrates (omega_max, rad/s), and how large a step (s) each integrator
    stands. at: the state that the run has reached then, s. result.rows: one an integrator."""
    result = study("stability", scene, dict(at=at, integrators=integrators), **rest)
    systems = result.json.get("systems", [result.json])
    result.rows = [one for system in systems for one in system.get("integrators", [])]
    return result


def order(scene, integrators=None, of=None, time=None, **rest):
    """The order of convergence that methods really have; result.rows: one a run."""
    result = study("order", scene, dict(of=of, time=time, integrators=integrators), **rest)
    result.rows = _points(result)
    return result


def minimal(scene, budget="1%", of=None, time=None, **rest):
    """Which parts of a scene its result needs; result.rows: one a part."""
    result = study("minimal", scene, dict(budget=budget, of=of, time=time), **rest)
    result.rows = result.json.get("parts", [])
    return result


def rest(scene, **rest):
    """Where a scene comes to rest: force left (N), in_play (N), potential (J)."""
    return study("rest", scene, **rest)


def compare(scene, methods, time=None, reference=None, **rest):
    """The same scene with several methods, each with its error against a reference.

    methods: "rk4", ("rk4", 0.001) with a step in s, ...; reference: likewise, and without it the
    first method with a sixteenth of its step. result.rows: integrator, dt (s), steps, seconds (of
    wall time), rms and most (m): of all particles at the end, and of the worst one; hash, verdict.
    """
    import numpy as np
    methods = [one if isinstance(one, tuple) else (one, 0.0) for one in methods]

    def ran(integrator, dt):
        loaded = load(scene, **{**rest, "integrator": integrator, "dt": dt})
        verdict = loaded.run(time, verify=False, progress=False)
        return loaded, verdict

    if reference is None:
        name, dt = methods[0]
        reference = (name, (dt or load(scene, **{**rest, "integrator": name}).dt) / 16)
    elif not isinstance(reference, tuple):
        reference = (reference, 0.0)
    true = ran(*reference)[0]
    rows = []
    for integrator, dt in methods:
        loaded, verdict = ran(integrator, dt)
        off = np.linalg.norm(np.atleast_2d(loaded.x - true.x), axis=-1)
        good = verdict.word != "diverged"
        rows.append({"integrator": integrator, "dt": loaded.dt, "steps": loaded.steps,
                     "seconds": verdict.seconds, "hash": loaded.hash, "verdict": verdict.word,
                     "rms": float(np.sqrt(np.mean(off**2))) if good else math.nan,
                     "most": float(off.max()) if good else math.nan})
    return Result({"reference": {"integrator": reference[0], "dt": true.dt}, "time": true.t}, rows)


def sweep(scene, over, run=None, time=None, threads=None, text=None, **rest):
    """Runs a scene for all combinations of values: over={"n": [8, 16], "integrator": ["rk4"]}.

    run: what is done with each loaded scene, a function that returns a dict; without it a judged run
    of `time` s (the scene's duration), and its row has verdict, reason, hash, t (s), steps and what
    the scene observes. threads: how many run at once, all cores if not given. A scene that fails
    has a row with `error`. result.rows: in the order of the combinations.
    """
    names = list(over)
    cases = [dict(zip(names, values)) for values in itertools.product(*over.values())]

    def judged(loaded):
        verdict = loaded.run(time, progress=False)
        system = loaded.summary["systems"][0]
        seen = {name: one["value"] for name, one in system.get("observed", {}).items()}
        return {"verdict": verdict.word, "reason": verdict.reason, "hash": loaded.hash,
                "t": loaded.t, "steps": loaded.steps, **seen}

    def one(case):
        try:
            arguments = {**rest, **case}
            with (load(scene, **arguments) if text is None else
                  scene_of(text, scene, **arguments)) as loaded:
                return {**case, **(run or judged)(loaded)}
        except Error as failure:
            return {**case, "error": str(failure)}

    workers = threads or len(os.sched_getaffinity(0))
    with concurrent.futures.ThreadPoolExecutor(workers) as pool:
        pending = [pool.submit(one, case) for case in cases]
        try:
            rows = [each.result() for each in pending]
        except BaseException:
            for each in pending:
                each.cancel()
            raise
    return Result({"scene": str(scene), "over": {k: list(v) for k, v in over.items()}}, rows)


def plugins(name=None, **rest):
    """What plugins say of themselves: a list of dicts with kind, name, params (type, unit, default,
    doc), formula, source. Of one name, or of all."""
    failed = ErrorRecord()
    block = lib.sim_describe_plugins(name and as_bytes(name), options({}, **rest), failed)
    return json.loads(taken(block, failed))


def scenes():
    """Names of the scenes that load() finds."""
    failed = ErrorRecord()
    return json.loads(taken(lib.sim_scenes(failed), failed))
