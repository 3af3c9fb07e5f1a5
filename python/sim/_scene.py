"""Scenes: their steps, runs, state and pictures."""

import base64
import collections
import ctypes
import html
import json
import os
import time
import warnings
import weakref
from ctypes import c_int64

import numpy as np

from ._library import (FIELD, STOPPED, Energies, Error, ErrorRecord, Part, SpringRecord,
                       VerdictRecord, Watching, as_bytes, as_int, as_number, as_setting, as_vector,
                       check, lib, look, options, taken, texts)

Spring = collections.namedtuple("Spring", "family to stiffness rest length force")
Spring.__doc__ = "A spring: family, particle at its other end, N/m, m, m, N (positive: stretched)."


class Energy(float):
    """The total in J; `kinetic` and `potential` are its parts."""

    def __new__(cls, kinetic, potential):
        energy = super().__new__(cls, kinetic + potential)
        energy.kinetic, energy.potential = kinetic, potential
        return energy


class StaleView(Error):
    """A view was used after the scene had moved on."""


class View(np.lib.mixins.NDArrayOperatorsMixin):
    """A part of the state where it lies, without a copy: shape (items, components), read only.

    Arithmetic and numpy's functions read the scene's own memory. Each use raises StaleView once the
    scene has stepped or was changed; what is indexed, and numpy.array(view), are copies.
    """

    def __init__(self, system, name):
        self._system, self._name = system, name
        part = system._part(name)
        self._generation = part.generation
        length = part.count and ((part.count - 1) * part.item_stride +
                                 (part.components - 1) * part.component_stride + 1)
        memory = (ctypes.c_double * length).from_address(part.data)
        strides = tuple(8 * stride for stride in (part.item_stride, part.component_stride))
        self._array = np.ndarray((part.count, part.components), np.float64, memory,
                                 strides=strides)
        self._array.flags.writeable = False

    def _fresh(self):
        scene = self._system._scene
        if lib.sim_generation(scene._open()) != self._generation:
            raise StaleView("stale view", self._name, "the scene has moved on since it was made",
                            f"ask again: .view({self._name!r})")
        return self._array

    shape = property(lambda self: self._fresh().shape)
    dtype = property(lambda self: self._fresh().dtype)
    ndim = 2

    def __len__(self):
        return len(self._fresh())

    def __getitem__(self, index):
        return np.array(self._fresh()[index])

    def __array__(self, dtype=None, copy=None):
        return np.array(self._fresh(), dtype=dtype)

    def __array_ufunc__(self, ufunc, method, *inputs, **kwargs):
        if any(isinstance(out, View) for out in kwargs.get("out", ())):
            raise Error("read only", self._name, "a view is not written to", "use .set()")
        plain = [one._fresh() if isinstance(one, View) else one for one in inputs]
        return getattr(ufunc, method)(*plain, **kwargs)

    def __repr__(self):
        return f"View({self._name!r}, {self._fresh()!r})"


class Verdict:
    """What was found of a judged run.

    word: "trusted", "unverified", "chaotic", "suspect" or "diverged"; reason: why.
    position_error: largest difference to a run with half the step, m; position_share: the same over
    the scene's size; horizon: until when positions are known, s; energy: error over the energy in
    play; dt_share: of the largest stable step; step_error: of one step, m; momentum; seconds: of
    wall time. nan: not known. figures: all of them by name, as `sim SCENE --json` has them, a dict
    with strain, neighbours, ... besides; None: not known.
    """

    def __init__(self, record, reason, figures):
        self.word, self.reason = lib.sim_trust_name(record.trust).decode(), reason
        self.figures = figures
        self.notes = []  # of run_engine()
        for name, _ in VerdictRecord._fields_[1:]:
            setattr(self, name, getattr(record, name))

    def __bool__(self):
        return self.word == "trusted"

    def __repr__(self):
        return f"{self.word}: {self.reason}"


class System:
    """One system of a scene. A scene is its own first system."""

    def __init__(self, scene, index):
        self._scene, self._index, self._shapes = scene, index, {}

    def _part(self, name):
        scene, part = self._scene, Part()
        check(lib.sim_state(scene._open(), self._index, as_bytes(name), part, scene._failed),
              scene._failed)
        return part

    def _copy(self, name):
        if name not in self._shapes:
            part = self._part(name)
            self._shapes[name] = (part.count, part.components)
        scene, out = self._scene, np.empty(self._shapes[name])
        check(lib.sim_copy_state(scene._open(), self._index, as_bytes(name), out.ctypes.data,
                                 out.size, scene._failed), scene._failed)
        return out

    def view(self, name):
        """The quick, raising look at a part of the state: see View. m, m/s."""
        return View(self, name)

    def part(self, name):
        """A copy of a part of the state, (items, components); names are in `parts`."""
        return self._copy(name)

    @property
    def parts(self):
        """Names of the parts of the state: "position", "velocity", "component", ..."""
        scene = self._scene
        return json.loads(taken(lib.sim_state_parts(scene._open(), self._index, scene._failed),
                                scene._failed))

    @property
    def x(self):
        """Positions in m, (particles, 3), a copy; of a flat state its numbers, (n,)."""
        if None not in self._shapes:
            self._shapes[None] = "position" in self.parts
        return self._copy("position") if self._shapes[None] else self._copy("component")[:, 0]

    @property
    def v(self):
        """Velocities in m/s, (particles, 3), a copy. Raises Error in a first-order scene."""
        return self._copy("velocity")

    @property
    def t(self):
        """The time, s."""
        return lib.sim_time(self._scene._open(), self._index)

    @property
    def steps(self):
        """How many steps were taken."""
        return lib.sim_step_count(self._scene._open(), self._index)

    @property
    def duration(self):
        """How long the scene says that it lasts, s."""
        return lib.sim_duration(self._scene._open(), self._index)

    @property
    def dt(self):
        """The step size, s; may be set."""
        return lib.sim_step_size(self._scene._open(), self._index)

    @dt.setter
    def dt(self, h):
        self._change(lib.sim_set_dt, as_number(h, "dt"))

    @property
    def energy(self):
        """The total energy, J, a number with parts .kinetic and .potential."""
        scene, record = self._scene, Energies()
        check(lib.sim_energy(scene._open(), self._index, record, scene._failed), scene._failed)
        return Energy(record.kinetic, record.potential)

    @property
    def hash(self):
        """Of the bits of the state, 16 hexadecimal digits, as the command line says."""
        return f"{lib.sim_hash(self._scene._open(), self._index):016x}"

    @property
    def verdict(self):
        """On the last run(). Raises Error before one."""
        scene, record = self._scene, VerdictRecord()
        check(lib.sim_judge(scene._open(), self._index, record, scene._failed), scene._failed)
        told = scene.summary["systems"][self._index]
        return Verdict(record, told["reason"], told["figures"])

    def observe(self, name):
        """What the scene observes now, by its name in `observe` of the scene."""
        scene, value = self._scene, ctypes.c_double()
        check(lib.sim_observe(scene._open(), self._index, as_bytes(name), value, scene._failed),
              scene._failed)
        return value.value

    def springs(self, particle):
        """The springs of a particle, a list of Spring."""
        scene, count = self._scene, ctypes.c_size_t()
        arguments = (scene._open(), self._index, as_int(particle, "particle"))
        check(lib.sim_springs(*arguments, None, 0, count, scene._failed), scene._failed)
        records = (SpringRecord * max(1, count.value))()
        check(lib.sim_springs(*arguments, records, count.value, count, scene._failed),
              scene._failed)
        return [Spring(one.family.decode(), one.to, one.stiffness, one.rest, one.length, one.force)
                for one in records[:count.value]]

    @property
    def tensions(self):
        """What constraints hold with now, a list of dicts: constraint, a, b (particles; -1: none),
        tension (N), force (N, on a)."""
        scene = self._scene
        return json.loads(taken(lib.sim_tensions(scene._open(), self._index, scene._failed),
                                scene._failed))

    def _change(self, function, *arguments):
        scene = self._scene
        check(function(scene._open(), self._index, *arguments, scene._failed), scene._failed)

    def set_position(self, particle, x):
        """Moves a particle to x, m."""
        self._change(lib.sim_set_position, as_int(particle, "particle"), as_vector(x, "x"))

    def set_velocity(self, particle, v):
        """Gives a particle the velocity v, m/s."""
        self._change(lib.sim_set_velocity, as_int(particle, "particle"), as_vector(v, "v"))

    def set_component(self, index, value):
        """Sets one number of a flat state."""
        self._change(lib.sim_set_component, as_int(index, "index"), as_number(value, "value"))

    def pin(self, particle, hold=True):
        """Pins a particle where it is, or lets it go."""
        self._change(lib.sim_set_pinned, as_int(particle, "particle"), bool(hold))

    def switch(self, name, on):
        """Turns a force or collider that the scene names in `switches` on or off."""
        self._change(lib.sim_set_switch, as_bytes(name), bool(on))

    def set_integrator(self, integrator):
        """Goes on with another one: "rk4", "dopri5:tol=1e-8"."""
        self._change(lib.sim_set_integrator, as_bytes(integrator))

    def cut(self, a, b):
        """Breaks the ties between two particles that may break."""
        self._change(lib.sim_cut, as_int(a, "a"), as_int(b, "b"))


class Owner:
    """What owns something in the library, of which there is no copy."""

    def __reduce_ex__(self, _protocol):
        name = type(self).__name__
        raise Error("no copy", name, "it is a handle of the library in this process",
                    "load the scene again, or save() and sim.resume() it")


class Snapshot(Owner):
    """The state of all systems of a scene, to be restored there."""

    def __init__(self, scene):
        self._handle = lib.sim_snapshot_take(scene._open(), scene._failed)
        if not self._handle:
            raise scene._failed.exception()

    def __del__(self):
        if getattr(self, "_handle", None) and lib:
            lib.sim_snapshot_free(self._handle)


class Scene(System, Owner):
    """A scene as it is now, from sim.load(), sim.scene() or sim.field().

    One thread at a time may use it; different scenes run in different threads at once, for the
    library works without Python's lock.
    """

    def __init__(self, handle, failed, keep=(), threads=1):
        self._handle, self._failed, self._keep, self._threads = None, failed, keep, threads
        if not handle:
            raise failed.exception()
        self._handle, self._index, self._shapes = ctypes.c_void_p(handle), 0, {}
        _scenes.add(self)

    _scene = property(lambda self: self)
    _gone = "it was closed"  # where there is no handle
    _ended = None  # an event that ends runs and steps
    _long = False  # a single step takes long

    @property
    def systems(self):
        """The systems of a world, in the order of their names; this scene is the first."""
        return [self] + [System(self, i) for i in range(1, lib.sim_systems(self._open()))]

    def _open(self):
        if self._handle is None:
            raise Error("closed scene", "scene", self._gone, "load it again")
        return self._handle

    def close(self):
        """Frees its memory now, not when the last reference goes."""
        if self._handle is not None and lib:
            lib.sim_close(self._handle)
            self._handle = None

    def __del__(self):
        if getattr(self, "_handle", None) is not None:
            self.close()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def step(self, n=1):
        """Takes n steps of each system. Raises Error (code 4) where one cannot be taken; the scene
        is then as it was before that one. Ctrl-C ends it, also within a step, which is then given
        up: the scene is as it was before that one, and can be stepped further.
        """
        if n.__class__ is not int or n > _MOST:
            n = as_int(n, "n", 0, _MOST)
        if not self._long:
            taken = None if n == 1 else c_int64()
            code = _step_for(self._handle or self._open(), n, _SHORT, taken, self._failed)
            if not code:
                return
            if code != STOPPED:
                self._fail()
            n -= taken.value if taken else 0
        self._step_watched(n)

    def _step_watched(self, n):
        """Steps that take long, beside a thread that hears Ctrl-C."""
        begun, taken, watching = time.monotonic(), c_int64(), Watching(False, self._ended)
        code = watching.call(lib.sim_step_watched, self._open(), n, taken, watching.watch,
                             None, self._failed)
        self._long = time.monotonic() - begun > _SHORT * taken.value
        if code:
            self._fail()

    def _fail(self):
        failure = getattr(self, "_raised", None)
        if failure:
            self._raised = None
            raise failure
        raise self._failed.exception()

    def run(self, time=None, verify=None, progress=None, of=None):
        """A judged run of `time` s from now, or to the end of the scene's duration; returns the
        verdict. verify: True runs it a second time with half the step, False does not, None does
        where that takes a second or a core is free, until it doubts. of: figures of what the scene
        observes, "mean sag", that this run and those after it judge, too; `summary` has them.
        progress: see sim.tradeoff(). Ctrl-C ends it."""
        if of is not None:
            named = texts([of] if isinstance(of, str) else of)
            check(lib.sim_judge_figures(self._open(), named, self._failed), self._failed)
        watching = Watching(progress, self._ended)
        code = watching.call(lib.sim_run, self._open(), length(time), wish_of(verify),
                             watching.watch, None, self._failed)
        watching.finish()
        if code and not (code == STOPPED and watching.stopped):
            self._fail()
        return self.verdict

    def check(self, limits):
        """Raises Error (code 8) where the last run() is not within limits, as --check has them:
        "verified,energy=1%,strain=20%,dt=90%"."""
        check(lib.sim_check(self._open(), as_bytes(limits), self._failed), self._failed)

    def come_to_rest(self, progress=None):
        """Brings the scene to rest, where it stays, at its present time. Returns a dict: force left
        (N), in_play (N), potential (J); a list of them in a world. Raises Error where there is
        none; the scene is then as it was."""
        watching = Watching(progress, self._ended)
        block = watching.call(lib.sim_come_to_rest, self._open(), watching.watch, None,
                              self._failed)
        watching.finish()
        found = json.loads(taken(block, self._failed))["systems"]
        return found[0] if len(found) == 1 else found

    def choose(self, allowed=None, of=None, time=None, progress=None):
        """Chooses and sets a method and a step that keep an error, before the first step or change.

        allowed: "1 mm", "1%" of the scene's size; None: what the scene asks for as its `error`,
        which run() does by itself where it comes first. of: what is judged, as "mean sag" of what
        the scene observes (positions if not given); time: of the run, s (the duration). Returns a
        dict: integrator, dt (s), error (m), kept, horizon (s), candidates, ...; a list of them in
        a world, None where nothing is asked.
        """
        watching = Watching(progress, self._ended)
        block = watching.call(lib.sim_choose, self._open(), allowed and as_bytes(allowed),
                              of and as_bytes(of), length(time), watching.watch,
                              None, self._failed)
        watching.finish()
        chosen = json.loads(taken(block, self._failed))["systems"]
        return chosen[0] if len(chosen) == 1 else chosen

    def reset(self):
        """Back to t = 0 with the initial bits; changed settings stay."""
        check(lib.sim_reset(self._open(), self._failed), self._failed)

    def snapshot(self):
        """The state as it is now, for restore()."""
        return Snapshot(self)

    def restore(self, snapshot):
        """Goes on from there, bit for bit."""
        check(lib.sim_snapshot_restore(self._open(), snapshot._handle, self._failed), self._failed)

    @property
    def description(self):
        """Systems, parameters with their values, and the file, as a dict."""
        return json.loads(taken(lib.sim_describe(self._open(), self._failed), self._failed))

    @property
    def summary(self):
        """Of the last run(), as `sim SCENE --json` has it, a dict."""
        return json.loads(taken(lib.sim_verdict_json(self._open(), self._failed), self._failed))

    def save(self, file):
        """Writes a checkpoint, from which resume(), sim.resume() and `--resume` go on bit for
        bit. The file takes its name when it is whole."""
        check(lib.sim_save(self._open(), as_bytes(file), self._failed), self._failed)

    def resume(self, file):
        """Goes on where a scene that was loaded likewise was saved."""
        check(lib.sim_resume(self._open(), as_bytes(file), self._failed), self._failed)

    def record(self, file):
        """Writes what is done from now on to a file, which replay(), sim.recorded() and `--replay`
        repeat: changes, resets and whole steps, until end_record() or close(). It begins with the
        initial state."""
        check(lib.sim_record(self._open(), as_bytes(file), self._failed), self._failed)

    def end_record(self):
        """Ends the recording, with the hash of now. Raises Error where lines are missing."""
        check(lib.sim_record_end(self._open(), self._failed), self._failed)

    def replay(self, file, verify=None, progress=None):
        """A judged run that repeats a recording, from the start; returns the verdict. Raises Error
        (code 8) where the bits are other than those recorded. verify, progress: as in run()."""
        watching = Watching(progress, self._ended)
        code = watching.call(lib.sim_replay, self._open(), as_bytes(file), wish_of(verify),
                             watching.watch, None, self._failed)
        watching.finish()
        if code and not (code == STOPPED and watching.stopped):
            self._fail()
        return self.verdict

    def run_engine(self, engine="lammps", time=None, steps=None, ranks=None, launch=None,
                   compare=True, results=None, verify=None, progress=None):
        """A judged run whose steps another program makes, "lammps" or "petsc", to `time` s or
        `steps` from the start of the scene (its duration); returns the verdict, whose `notes` say
        how far the program and the kernel agree. ranks: processes of it; launch: the words that
        start it, "srun -n 512 lmp"; compare: its first steps with those of the kernel; results: a
        folder of export() where it was run by hand. verify, progress: as in run()."""
        asked = {"engine": engine, "time": time, "steps": steps, "ranks": ranks, "launch": launch,
                 "compare": None if compare else "0", "results": results}
        watching = Watching(progress, self._ended)
        block = watching.given(lib.sim_free, lib.sim_run_engine, self._open(), words_of(asked),
                               wish_of(verify), watching.watch, None, self._failed)
        watching.finish()
        told = json.loads(taken(block, self._failed))
        verdict = self.verdict
        verdict.notes = told["notes"]
        return verdict

    def export(self, format, to, time=None, steps=None, every=None):
        """Writes the scene as it is now for other programs: format "lammps", or another engine,
        into the folder `to`, for a run to `time` s or of `steps` with a state each `every` steps;
        "h5md" into a file .h5; "page" into a file .html with the kernel in it. Returns a dict of
        what was written; a list of them for a world."""
        words = words_of({"time": time, "steps": steps, "every": every})
        return json.loads(taken(lib.sim_export(self._open(), as_bytes(format), as_bytes(to), words,
                                               self._failed), self._failed))

    def picture(self, file=None, width=1280, height=720, color=None, camera=None, springs=(),
                wireframe=False, surface=False):
        """The scene as it is now: PNG as bytes, or written to a file. color: "strain", "speed:2";
        camera: "eye=1,2,3 at=0,0,0 up=0,1,0 fov=40", or parts (m, degrees); springs: which are
        drawn, of a particle, a family or "all"; wireframe: only the lines of surfaces; surface:
        water and other liquids are drawn as surfaces."""
        size = ctypes.c_size_t()
        record = look(width, height, color, camera, springs, wireframe, surface=surface)
        if record.width == 0 and record.height == 0:
            raise Error("bad value", "width = 0, height = 0", "a picture has pixels",
                        "give both, like 1280 and 720")
        watching = Watching(False, self._ended)
        block = watching.given(lib.sim_free, lib.sim_draw_watched, self._open(), record, size,
                               watching.watch, None, self._failed)
        if not block:
            raise self._failed.exception()
        try:
            data = ctypes.string_at(block, size.value)
        finally:
            lib.sim_free(block)
        if file is None:
            return data
        with open(file, "wb") as out:
            out.write(data)
        return None

    def write(self, file, time=0.0, fps=30.0, progress=None, **looks):
        """Writes a file of any kind that `sim --out` knows: of now, or of `time` s from now in
        steps, fps pictures a second of simulated time. looks: width, height, color, camera,
        springs, wireframe and surface of pictures and films, as in picture(), and trails of
        particles and bodies, 12 or "body:0", through the moments of the file. Ctrl-C ends it; no
        file is left."""
        fps, time = as_number(fps, "fps", 1e-6), as_number(time, "time", 0)
        writer = lib.sim_writer_open_look(self._open(), as_bytes(file), fps, look(**looks),
                                          self._failed)
        if not writer:
            raise self._failed.exception()
        try:
            check(lib.sim_writer_add(writer, self._failed), self._failed)
            stride = max(1, round(1 / (fps * self.dt)))
            for _ in range(round(time / (stride * self.dt))):
                self.step(stride)
                check(lib.sim_writer_add(writer, self._failed), self._failed)
            watching = Watching(progress, self._ended)
            code = watching.call(lib.sim_writer_finish, writer, watching.watch, None, self._failed)
            watching.finish()
            check(code, self._failed)
        finally:
            lib.sim_writer_close(writer)

    def __repr__(self):
        if self._handle is None:
            return "<sim.Scene, closed>"
        about = self.description
        names = ", ".join(system["name"] for system in about["systems"])
        return f"<sim.Scene {names} at t = {self.t:g} s, hash {self.hash}>"

    def _repr_png_(self):
        return self.picture(width=640, height=360)

    def _repr_html_(self):
        try:
            said = repr(self.verdict)
        except Error:
            said = "no judged run yet"
        picture = base64.b64encode(self._repr_png_()).decode()
        return (f'<img alt="the scene" src="data:image/png;base64,{picture}">'
                f"<br><code>{html.escape(repr(self))}</code><br>{html.escape(said)}")


_scenes = weakref.WeakSet()


def _leave_to_parent():
    """In a child of os.fork(): the threads that steps use are those of the parent."""
    for scene in list(_scenes):
        if scene._handle is not None and scene._threads != 1:
            scene._handle, scene._gone = None, "its threads are in the process that forked this one"


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_leave_to_parent)

_step_for = lib.sim_step_for
_MOST = 2**63 - 1
_SHORT = 0.05  # s, that the thread which hears Ctrl-C may be in the library


def wish_of(verify):
    return 1 if verify is None else 2 if verify else 0


def words_of(asked):
    """NAME=VALUE texts of what is asked for."""
    return texts([f"{name}={as_setting(value)}" for name, value in asked.items()
                  if value is not None])


def length(time):
    """Of a run, s, as the library takes it: None is the scene's duration."""
    if time is None:
        return 0.0
    if not as_number(time, "time", 0) > 0:
        raise Error("bad value", f"time = {time!r}", "the run has no length",
                    "give more than 0 s, or nothing for the scene's duration")
    return float(time)


def _opened(function, *words, args, rest):
    """A scene that the library opens, on a thread beside the one that hears Ctrl-C."""
    failed, record, watching = ErrorRecord(), _asked(args, rest), Watching(False)
    handle = watching.given(lib.sim_close, function, *words, record, watching.watch, None, failed)
    return Scene(handle, failed, threads=record.threads)


def load(name, args=None, **rest):
    """A scene from a file, found as the command line finds it: "scenes/cloth.lua", "cloth".

    Named arguments: integrator ("rk4", "dopri5:tol=1e-8"), dt (s), threads, seed, off (switches),
    without (forces, colliders, families), safe, plugins (folders), libraries, lua_budget (of the
    scene's Lua: "time=60,memory=4096,steps=1e9", s and MB in the whole run); all others, and those
    in the dict `args`, are parameters of the scene: load("scenes/cloth.lua", n=32). Ctrl-C ends it.
    """
    return _opened(lib.sim_open_watched, as_bytes(name), None, args=args, rest=rest)


def resume(file, args=None, **rest):
    """The scene of a checkpoint, which save() or `sim --snap` wrote, where it was then; or of the
    folder of an export. Other arguments as in load(), over those that the checkpoint names."""
    return _opened(lib.sim_open_saved_watched, as_bytes(file), args=args, rest=rest)


def recorded(file, args=None, **rest):
    """The scene of a recording, which record() or `sim view --record` wrote, at its start, for
    replay(). Other arguments as in load(), over those that the recording names."""
    return _opened(lib.sim_open_recorded, as_bytes(file), args=args, rest=rest)


def import_scene(file):
    """A mesh (.obj, .ply) or H5MD (.h5) as a scene in Lua, a text for scene(). What that cannot
    express is a warning."""
    failed, notes = ErrorRecord(), ctypes.c_void_p()
    text = taken(lib.sim_import(as_bytes(file), notes, failed), failed)
    for note in taken(notes.value, failed).splitlines():
        warnings.warn(note, stacklevel=2)
    return text


def scene(text, name="scene.lua", args=None, **rest):
    """A scene from its Lua text: scene("return sim.scene {..}") after `local sim = require "sim"`,
    which may be left out. `name` is what errors call it. Other arguments as in load()."""
    return _opened(lib.sim_open_watched, as_bytes(name), as_bytes(with_language(text)), args=args,
                   rest=rest)


def with_language(text):
    known = ('require "sim"', "require 'sim'", 'require("sim")', "require('sim')")
    return text if any(one in text for one in known) else 'local sim = require "sim" ' + text


def field(f, x0, integrator="rk4", dt=0.01, duration=1.0, **rest):
    """A first-order system dx/dt = f(t, x) with a right-hand side in Python.

    f gets the time (s) and an array of x0's shape, many points at once, and returns an array that
    fits it; it depends on nothing else. What it raises, step() raises, the state being that before
    the step. dt and duration in s.
    """
    x0 = np.ascontiguousarray(x0, np.float64)
    shape, failures = x0.shape, []

    def called(_user, t, x, dxdt, n):
        try:
            buffer = ctypes.c_double * n
            inside = np.frombuffer(buffer.from_address(x)).reshape(shape)
            inside.flags.writeable = False
            np.frombuffer(buffer.from_address(dxdt)).reshape(shape)[...] = f(t, inside)
            return 0
        except BaseException as failure:  # goes on behind the library
            failures.append(failure)
            return 1

    callback, failed = FIELD(called), ErrorRecord()
    record = _asked(None, dict(rest, integrator=integrator, dt=dt))
    handle = lib.sim_open_field(callback, None, x0.ctypes.data, x0.size,
                                as_number(duration, "duration", 0), record, failed)
    if not handle and failures:
        raise failures.pop()
    return Field(handle, failed, callback, failures, shape)


class Field(Scene):
    """A system of sim.field(); x has the shape of its x0."""

    def __init__(self, handle, failed, callback, failures, shape):
        super().__init__(handle, failed, keep=(callback,))
        self._failures, self._shape = failures, shape

    # Ctrl-C that Python hears on its way into a callback would be lost: steps are always taken
    # beside the thread that hears it.
    _long = property(lambda self: True, lambda self, value: None)

    @property
    def x(self):
        """The numbers of the state, a copy in the shape of x0."""
        return self._copy("component")[:, 0].reshape(self._shape)

    def _fail(self):
        if self._failures:
            failure = self._failures[-1]
            self._failures.clear()
            raise failure
        super()._fail()

    def run(self, time=None, verify=None, progress=None, of=None):
        try:
            return super().run(time, verify, progress, of)
        finally:
            self._failures.clear()


def _asked(args, rest):
    known = ("integrator", "dt", "threads", "off", "without", "seed", "safe", "plugins",
             "libraries", "lua_budget")
    named = {name: rest.pop(name) for name in known if name in rest}
    return options({**rest, **(args or {})}, **named)
