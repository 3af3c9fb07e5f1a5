"""Studies of a scene, and sweeps over its parameters."""

import concurrent.futures
import itertools
import json
import os
import threading

from ._library import (STOPPED, Error, ErrorRecord, Watching, as_bytes, as_setting, lib, options,
                       taken, texts)
from ._scene import _asked, load, scene as scene_of, with_language


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
    """NAME=VALUE texts: lists between commas, but for what may be there several times."""
    pairs = []
    for name, value in asked.items():
        if value is None or isinstance(value, str) and not value:
            continue
        values = value if isinstance(value, (list, tuple)) else [value]
        words = [as_setting(one) for one in values]
        pairs += [(name, word) for word in words] if name in ("over", "of", "out", "springs", "trails") else (
            [(name, ",".join(words))] if words else [])
    return texts([f"{name}={word}" for name, word in pairs])


def study(name, scene=None, asked=None, text=None, progress=None, args=None, **rest):
    """The study `name` of a scene's file, or of its `text`; `asked` are its own words, a dict.
    A Result, without rows. Named arguments else as in load()."""
    failed, record, watching = ErrorRecord(), _asked(args, rest), Watching(progress)
    block = watching.call(
        lib.sim_study, as_bytes(name), None if scene is None else as_bytes(scene),
        None if text is None else as_bytes(with_language(text)), _texts_of(asked or {}), record,
        watching.watch, None, failed)
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


def tradeoff(scene, budget="0.1%", of=None, time=None, integrators=None, csv=None, svg=None,
             **rest):
    """Speed against accuracy of every integrator, and which to take.

    budget: the error allowed, a share of the scene's size ("1%") or an amount ("1 mm"); of: what is
    judged, as "mean sag" of what the scene observes (positions if not given); time in s;
    integrators: names, all that fit if not given. progress: None shows a line for long work, True
    always, False never, or a function (what, done from 0 to 1); Ctrl-C ends it.
    csv: a file for a table of all runs, .csv or .jsonl; svg: one for the plot of error against cost.
    result.recommended, .cheapest: integrator, dt (s) or tol, error (m), command; result.rows: one a
    run, with integrator, dt, error, cost, seconds, front.
    """
    result = study("tradeoff", scene,
                   dict(budget=budget, of=of, time=time, integrators=integrators, csv=csv, svg=svg),
                   **rest)
    result.rows = _points(result)
    return result


def stability(scene, at=None, integrators=None, svg=None, **rest):
    """How fast a scene vibrates (omega_max, rad/s), and how large a step (s) each integrator
    stands. at: the state that the run has reached then, s. svg: a file for the plot. result.rows:
    one an integrator."""
    result = study("stability", scene, dict(at=at, integrators=integrators, svg=svg), **rest)
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


def compare(scene, methods=(), time=None, reference=None, of=None, out=(), look=None, **rest):
    """The same scene with several methods, each with its error against a reference.

    methods: "rk4", ("rk4", 0.001) with a step in s, ...; none: the scene's own and some known ones.
    reference: a method whose run stands for the truth, likewise; without it a solution with an
    error of its own, as result.reference["error"] (m) says. time in s; of: what the scene observes,
    to be compared, too. result.rows: one a method, with integrator, dt (s), steps, evaluations,
    seconds (of wall time), error: rms of positions, m, the largest of all times; rms: that at the
    end; most: of one particle, m; off: of what is observed; diverged_at, s.
    out: files with a panel for each method, of any kind that `sim compare --out` knows; look: how
    they look, a dict with fps, color, camera, size ("1280x720"), springs, wireframe, surface,
    trails.
    """
    asked = dict(look or {}, time=time, of=of, out=out)
    for flag in ("wireframe", "surface"):
        if flag in asked:
            asked[flag] = int(bool(asked[flag]))
    pairs = [one if isinstance(one, tuple) else (one, 0.0) for one in methods]
    if pairs:
        asked.update(integrators=[name for name, _ in pairs], dt=[dt for _, dt in pairs])
    if reference is not None:
        name, dt = reference if isinstance(reference, tuple) else (reference, 0.0)
        asked.update(reference=name, reference_dt=dt)
    result = study("compare", scene, asked, **rest)
    result.rows = [{**row, "rms": row["error_end"]} for row in result.json["methods"]]
    return result


def sweep(scene, over, run=None, time=None, threads=None, text=None, of=(), **rest):
    """Runs a scene for all combinations of values: over={"n": [8, 16], "integrator": ["rk4"]}.

    over: names are parameters of the scene, and integrator, dt (s), tol, time (s), steps, seed.
    run: what is done with each loaded scene, a function that returns a dict; without it a judged run
    of `time` s (the scene's duration), whose row has exit (0, or the code of its error), verdict,
    reason, steps, t (s), energies (J), error (m), hash and what the scene observes, and figures of
    that which `of` names, as ["mean sag"]. threads: how many run at once, all cores if not given. A
    scene that fails has a row with `error`, what went wrong. result.rows: in the order of the
    combinations. Ctrl-C ends it. progress: see tradeoff().
    """
    threads = threads or len(os.sched_getaffinity(0))
    if run is not None:
        return _swept_by(run, scene, over, threads, text, rest)
    asked = {"time": time, "of": [of] if isinstance(of, str) else list(of),
             "over": [f"{name}={_axis(name, values)}" for name, values in over.items()]}
    result = study("sweep", scene, asked, text, threads=threads, **rest)
    cases = itertools.product(*over.values())
    for case, row in zip(cases, result.json["rows"]):
        failed = {"error": row["reason"]} if row["verdict"] is None else {}
        result.rows.append({**row, **dict(zip(over, case)), **failed})
    return result


def _axis(name, values):
    """The values of an axis as the study reads them, which takes 1:5:3 and 1..5 for ranges."""
    texts_of_values = [as_setting(value) for value in values]
    for value in texts_of_values:
        listed = name == "integrator" or "," not in value
        if not value or not listed or ".." in value or value.count(":") > 1:
            raise Error("bad value in a sweep", f"{name} = {value!r}", "it reads as several values",
                        "give a function as `run`, which takes any")
    return ",".join(texts_of_values)


def _swept_by(run, scene, over, threads, text, rest):
    cases = [dict(zip(over, values)) for values in itertools.product(*over.values())]
    ended = threading.Event()
    watching = Watching(rest.pop("progress", None), ended)

    def one(case):
        try:
            arguments = {**rest, **case}
            with (load(scene, **arguments) if text is None else
                  scene_of(text, scene, **arguments)) as loaded:
                loaded._ended = ended
                return {**case, **run(loaded)}
        except Error as failure:
            return {**case, "error": str(failure)}

    with concurrent.futures.ThreadPoolExecutor(threads) as pool:
        pending = [pool.submit(one, case) for case in cases]
        try:
            while True:
                done = sum(each.done() for each in pending)
                if watching.told(f"{done} of {len(cases)} cases", done / max(1, len(cases))):
                    raise Error("stopped", code=STOPPED)
                if not concurrent.futures.wait(pending, 0.05).not_done:
                    break
            rows = [each.result() for each in pending]
        except BaseException:
            ended.set()  # runs that are on their way end, and those behind them never begin
            for each in pending:
                each.cancel()
            raise
        finally:
            watching.finish()
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
