"""The C interface, sim.h, as ctypes sees it."""

import ctypes
import html
import math
import operator
import os
import sys
import threading
import time
from ctypes import POINTER, c_char_p, c_double, c_int, c_int64, c_size_t, c_uint64, c_void_p
from pathlib import Path

MAJOR = 1  # of the interface that this package is written for

STOPPED = 9  # code: a callback asked for it


class Error(Exception):
    """What went wrong (`what`), where, why, and what to do about it (`remedy`).

    `code` is the exit code that the command line would have: 2 usage, 3 scene, 4 diverged, 5 files,
    7 plugin.
    """

    def __init__(self, what, where="", why="", remedy="", code=2):
        self.what, self.where, self.why, self.remedy, self.code = what, where, why, remedy, code
        text = ": ".join(part for part in (what, where, why) if part)
        super().__init__(text + ("; " + remedy if remedy else ""))


class ErrorRecord(ctypes.Structure):
    _fields_ = [("code", c_int), ("what", ctypes.c_char * 256), ("where", ctypes.c_char * 512),
                ("why", ctypes.c_char * 1280), ("remedy", ctypes.c_char * 1024)]

    def exception(self):
        texts = [getattr(self, name).decode("utf-8", "replace")
                 for name in ("what", "where", "why", "remedy")]
        return Error(*texts, code=self.code)


class Options(ctypes.Structure):
    _fields_ = [("size", c_size_t), ("settings", POINTER(c_char_p)), ("off", POINTER(c_char_p)),
                ("without", POINTER(c_char_p)), ("folders", POINTER(c_char_p)),
                ("libraries", POINTER(c_char_p)), ("integrator", c_char_p), ("dt", c_double),
                ("threads", c_int), ("safe", c_int), ("seed", c_uint64),
                ("lua_budget", c_char_p)]


class Part(ctypes.Structure):
    _fields_ = [("data", c_void_p), ("count", c_size_t), ("components", c_size_t),
                ("item_stride", c_size_t), ("component_stride", c_size_t),
                ("generation", c_uint64)]


class Energies(ctypes.Structure):
    _fields_ = [("kinetic", c_double), ("potential", c_double)]


class SpringRecord(ctypes.Structure):
    _fields_ = [("to", c_int), ("stiffness", c_double), ("rest", c_double), ("length", c_double),
                ("force", c_double), ("family", ctypes.c_char * 64)]


class VerdictRecord(ctypes.Structure):
    _fields_ = [("trust", c_int)] + [(name, c_double) for name in (
        "energy", "dt_share", "step_error", "momentum", "position_error", "position_share",
        "horizon", "seconds")]


class LookRecord(ctypes.Structure):
    _fields_ = [("size", c_size_t), ("width", c_int), ("height", c_int), ("color", c_char_p),
                ("camera", c_char_p), ("springs", POINTER(c_char_p)), ("wireframe", c_int),
                ("trails", POINTER(c_char_p)), ("surface", c_int)]


WATCH = ctypes.CFUNCTYPE(c_int, c_void_p, c_char_p, c_double)
FIELD = ctypes.CFUNCTYPE(c_int, c_void_p, c_double, c_void_p, c_void_p, c_size_t)

_ERROR, _OPTIONS, _VECTOR = POINTER(ErrorRecord), POINTER(Options), c_double * 3
_LOOK = POINTER(LookRecord)

_FUNCTIONS = {
    "sim_interface_version": (c_int, []),
    "sim_version": (c_char_p, []),
    "sim_free": (None, [c_void_p]),
    "sim_open": (c_void_p, [c_char_p, _OPTIONS, _ERROR]),
    "sim_open_text": (c_void_p, [c_char_p, c_char_p, _OPTIONS, _ERROR]),
    "sim_open_field": (c_void_p, [FIELD, c_void_p, c_void_p, c_size_t, c_double, _OPTIONS, _ERROR]),
    "sim_open_watched": (c_void_p, [c_char_p, c_char_p, _OPTIONS, WATCH, c_void_p, _ERROR]),
    "sim_close": (None, [c_void_p]),
    "sim_systems": (c_int, [c_void_p]),
    "sim_describe": (c_void_p, [c_void_p, _ERROR]),
    "sim_describe_plugins": (c_void_p, [c_char_p, _OPTIONS, _ERROR]),
    "sim_scenes": (c_void_p, [_ERROR]),
    "sim_step": (c_int, [c_void_p, c_int64, POINTER(c_int64), _ERROR]),
    "sim_step_watched": (c_int, [c_void_p, c_int64, POINTER(c_int64), WATCH, c_void_p, _ERROR]),
    "sim_step_for": (c_int, [c_void_p, c_int64, c_double, POINTER(c_int64), _ERROR]),
    "sim_run": (c_int, [c_void_p, c_double, c_int, WATCH, c_void_p, _ERROR]),
    "sim_reset": (c_int, [c_void_p, _ERROR]),
    "sim_time": (c_double, [c_void_p, c_int]),
    "sim_step_size": (c_double, [c_void_p, c_int]),
    "sim_duration": (c_double, [c_void_p, c_int]),
    "sim_step_count": (c_int64, [c_void_p, c_int]),
    "sim_generation": (c_uint64, [c_void_p]),
    "sim_snapshot_take": (c_void_p, [c_void_p, _ERROR]),
    "sim_snapshot_restore": (c_int, [c_void_p, c_void_p, _ERROR]),
    "sim_snapshot_free": (None, [c_void_p]),
    "sim_state": (c_int, [c_void_p, c_int, c_char_p, POINTER(Part), _ERROR]),
    "sim_state_parts": (c_void_p, [c_void_p, c_int, _ERROR]),
    "sim_copy_state": (c_int, [c_void_p, c_int, c_char_p, c_void_p, c_size_t, _ERROR]),
    "sim_energy": (c_int, [c_void_p, c_int, POINTER(Energies), _ERROR]),
    "sim_hash": (c_uint64, [c_void_p, c_int]),
    "sim_springs": (c_int, [c_void_p, c_int, c_int, POINTER(SpringRecord), c_size_t,
                            POINTER(c_size_t), _ERROR]),
    "sim_set_position": (c_int, [c_void_p, c_int, c_int, _VECTOR, _ERROR]),
    "sim_set_velocity": (c_int, [c_void_p, c_int, c_int, _VECTOR, _ERROR]),
    "sim_set_component": (c_int, [c_void_p, c_int, c_int, c_double, _ERROR]),
    "sim_set_pinned": (c_int, [c_void_p, c_int, c_int, c_int, _ERROR]),
    "sim_set_switch": (c_int, [c_void_p, c_int, c_char_p, c_int, _ERROR]),
    "sim_set_dt": (c_int, [c_void_p, c_int, c_double, _ERROR]),
    "sim_set_integrator": (c_int, [c_void_p, c_int, c_char_p, _ERROR]),
    "sim_cut": (c_int, [c_void_p, c_int, c_int, c_int, _ERROR]),
    "sim_judge": (c_int, [c_void_p, c_int, POINTER(VerdictRecord), _ERROR]),
    "sim_verdict_json": (c_void_p, [c_void_p, _ERROR]),
    "sim_trust_name": (c_char_p, [c_int]),
    "sim_figure": (c_int, [c_void_p, c_int, c_char_p, POINTER(c_double), _ERROR]),
    "sim_observe": (c_int, [c_void_p, c_int, c_char_p, POINTER(c_double), _ERROR]),
    "sim_choose": (c_void_p, [c_void_p, c_char_p, c_char_p, c_double, WATCH, c_void_p, _ERROR]),
    "sim_study": (c_void_p, [c_char_p, c_char_p, c_char_p, POINTER(c_char_p), _OPTIONS, WATCH,
                             c_void_p, _ERROR]),
    "sim_picture": (c_void_p, [c_void_p, c_int, c_int, c_char_p, POINTER(c_size_t), _ERROR]),
    "sim_save": (c_int, [c_void_p, c_char_p, _ERROR]),
    "sim_resume": (c_int, [c_void_p, c_char_p, _ERROR]),
    "sim_open_saved": (c_void_p, [c_char_p, _OPTIONS, _ERROR]),
    "sim_open_saved_watched": (c_void_p, [c_char_p, _OPTIONS, WATCH, c_void_p, _ERROR]),
    "sim_record": (c_int, [c_void_p, c_char_p, _ERROR]),
    "sim_record_end": (c_int, [c_void_p, _ERROR]),
    "sim_open_recorded": (c_void_p, [c_char_p, _OPTIONS, WATCH, c_void_p, _ERROR]),
    "sim_replay": (c_int, [c_void_p, c_char_p, c_int, WATCH, c_void_p, _ERROR]),
    "sim_run_engine": (c_void_p, [c_void_p, POINTER(c_char_p), c_int, WATCH, c_void_p, _ERROR]),
    "sim_export": (c_void_p, [c_void_p, c_char_p, c_char_p, POINTER(c_char_p), _ERROR]),
    "sim_import": (c_void_p, [c_char_p, POINTER(c_void_p), _ERROR]),
    "sim_come_to_rest": (c_void_p, [c_void_p, WATCH, c_void_p, _ERROR]),
    "sim_judge_figures": (c_int, [c_void_p, POINTER(c_char_p), _ERROR]),
    "sim_check": (c_int, [c_void_p, c_char_p, _ERROR]),
    "sim_tensions": (c_void_p, [c_void_p, c_int, _ERROR]),
    "sim_draw": (c_void_p, [c_void_p, _LOOK, POINTER(c_size_t), _ERROR]),
    "sim_draw_watched": (c_void_p, [c_void_p, _LOOK, POINTER(c_size_t), WATCH, c_void_p, _ERROR]),
    "sim_writer_open_look": (c_void_p, [c_void_p, c_char_p, c_double, _LOOK, _ERROR]),
    "sim_writer_finish": (c_int, [c_void_p, WATCH, c_void_p, _ERROR]),
    "sim_writer_open": (c_void_p, [c_void_p, c_char_p, c_double, _ERROR]),
    "sim_writer_add": (c_int, [c_void_p, _ERROR]),
    "sim_writer_commit": (c_int, [c_void_p, _ERROR]),
    "sim_writer_close": (None, [c_void_p]),
}


def _candidates():
    """Where the library may be: $SIM_LIBRARY; of the installation that this package is part of;
    of the tree that it stands in; wherever the system's loader looks."""
    if os.environ.get("SIM_LIBRARY"):
        return [os.environ["SIM_LIBRARY"]]
    name, here = f"libsim.so.{MAJOR}", Path(__file__).resolve().parent
    beside = [folder / name for folder in list(here.parents)[1:4]]
    tree = sorted((here.parents[1] / "build").glob(f"lib/{name}"))
    return [str(file) for file in beside + tree if file.exists()] + [name]


def _opened():
    failures = []
    for file in _candidates():
        try:
            library = ctypes.CDLL(file)
        except OSError as failure:
            failures.append(str(failure))
            continue
        for name, (result, arguments) in _FUNCTIONS.items():
            function = getattr(library, name)
            function.restype, function.argtypes = result, arguments
        if library.sim_interface_version() // 1000 != MAJOR:
            raise ImportError(f"{file} has another interface than this package, {MAJOR}")
        return library
    raise ImportError("the library of sim is not found: " + "; ".join(failures) +
                      "; set SIM_LIBRARY to the file, or use ./dev python")


lib = _opened()


def check(code, record):
    """Raises what the record says of a code that is not 0."""
    if code:
        raise record.exception()


def taken(pointer, record):
    """The text of a block that the library gave away, which is freed."""
    if not pointer:
        raise record.exception()
    try:
        return ctypes.string_at(pointer).decode("utf-8")
    finally:
        lib.sim_free(pointer)


def texts(items):
    """A list of texts that ends with a null pointer; None for none."""
    encoded = [as_bytes(item) for item in items]
    return (c_char_p * (len(encoded) + 1))(*encoded, None) if encoded else None


def as_bytes(text):
    try:
        data = os.fsencode(text) if isinstance(text, os.PathLike) else str(text).encode(
            "utf-8", "surrogateescape")  # as names of files have them
    except UnicodeEncodeError:
        raise Error("bad text", ascii(text)[:200], "it is no text of Unicode",
                    "leave surrogates out") from None
    if b"\0" in data:
        raise Error("bad text", repr(text), "it holds a zero byte", "leave it out")
    return data


def as_int(value, name, least=-2**31, most=2**31 - 1):
    """A whole number, of numpy too, that the library's integer holds: ctypes would cut it."""
    try:
        number = operator.index(value)
    except TypeError:
        raise Error("bad value", f"{name} = {value!r}", "it is not a whole number",
                    "give one like 3") from None
    if not least <= number <= most:
        raise Error("bad value", f"{name} = {value!r}", f"it is not {least} .. {most}",
                    "give one in between")
    return number


def as_number(value, name, least=-math.inf):
    """A finite number of at least `least`."""
    try:
        number = math.nan if isinstance(value, (str, bytes)) else float(value)
    except (TypeError, ValueError):
        number = math.nan
    if not (math.isfinite(number) and number >= least):
        bound = "" if least == -math.inf else f" of at least {least:g}"
        raise Error("bad value", f"{name} = {value!r}", f"it is not a finite number{bound}",
                    "give one like 0.5")
    return number


def as_vector(value, name):
    """Three numbers."""
    try:
        numbers = [float(one) for one in value]
    except (TypeError, ValueError):
        numbers = []
    if len(numbers) != 3:
        raise Error("bad value", f"{name} = {value!r}", "it is not three numbers",
                    "give them like [0, 0.5, 1]")
    return _VECTOR(*numbers)


def as_setting(value):
    """The text of a parameter's value: 32.0 and 32 are the same."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float) and value.is_integer() and abs(value) < 2**53:
        return str(int(value))
    if hasattr(value, "item"):  # a number of numpy
        return as_setting(value.item())
    return repr(value) if isinstance(value, float) else str(value)


def look(width=0, height=0, color=None, camera=None, springs=(), wireframe=False, trails=(),
         surface=False):
    """How pictures look, as the library takes it."""
    record = LookRecord(size=ctypes.sizeof(LookRecord), width=as_int(width, "width"),
                        height=as_int(height, "height"), color=color and as_bytes(color),
                        camera=camera and as_bytes(camera), wireframe=bool(wireframe),
                        surface=bool(surface))
    drawn = texts([springs] if isinstance(springs, (str, int)) else springs)
    if drawn is not None:
        record.springs = drawn  # the record keeps it alive
    followed = texts([trails] if isinstance(trails, (str, int)) else trails)
    if followed is not None:
        record.trails = followed
    return record


def options(args, integrator="", dt=0.0, threads=1, off=(), without=(), seed=0, safe=False,
            plugins=(), libraries=(), lua_budget=""):
    record = Options(size=ctypes.sizeof(Options), dt=as_number(dt, "dt", 0),
                     threads=as_int(threads, "threads"), safe=bool(safe),
                     seed=as_int(seed, "seed", 0, 2**64 - 1))
    lists = {"settings": [f"{name}={as_setting(value)}" for name, value in args.items()],
             "off": off, "without": without, "folders": plugins, "libraries": libraries}
    for name, items in lists.items():
        items = [items] if isinstance(items, (str, os.PathLike)) else items
        array = texts(items)
        if array is not None:
            setattr(record, name, array)  # the record keeps it alive
    if integrator:
        record.integrator = as_bytes(integrator)
    if lua_budget:
        record.lua_budget = as_bytes(lua_budget)
    return record


class Watching:
    """Progress of long work, and Ctrl-C, which ends it.

    `progress`: None shows a line where work takes longer than a second and somebody sees it, in a
    notebook a bar; True always, False never; or a function (what, done) whose answer False ends the
    work. `ended`: an event that ends it, too.
    """

    def __init__(self, progress=None, ended=None):
        self.progress, self.stopped, self._bar = progress, False, None
        self._ended, self._news, self._latest = ended or threading.Event(), threading.Event(), None
        self._begun = time.monotonic()
        self.watch = WATCH(self._asked)

    def _asked(self, _user, what, done):
        """The library asks, on the thread of the work; what is shown is shown by the other one."""
        self._latest = what.decode("utf-8", "replace"), done
        self._news.set()
        return int(self.stopped or self._ended.is_set())

    def call(self, function, *arguments):
        """function(*arguments) on a thread of its own, so that this one hears Ctrl-C: within a
        callback Python would drop it. Its result; what ends the wait is raised behind it."""
        result, raised, over = [], [], threading.Event()

        def work():
            try:
                result.append(function(*arguments))
            except BaseException as failure:  # arguments that the library does not take
                raised.append(failure)
            finally:
                over.set()
                self._news.set()

        threading.Thread(target=work).start()
        heard = None
        while not over.is_set():  # a join() that Ctrl-C ends takes the thread for finished
            try:
                self._news.wait()
                self._news.clear()
                if self._latest is not None and heard is None:
                    self.told(*self._latest)
            except BaseException as failure:
                self._ended.set()
                heard = heard or failure
        if heard is not None or raised:
            self.finish()
            raise heard or raised[0]
        return result[0]

    def given(self, free, function, *arguments):
        """As call(), for what the library gives: where Ctrl-C came too late it is freed."""
        results = []

        def work():
            results.append(function(*arguments))
            return results[0]

        try:
            return self.call(work)
        except BaseException:
            for result in results:
                free(result)
            raise

    def told(self, what, done):
        """Shows how far the work is. True: it is to end."""
        if callable(self.progress):
            if not self.stopped:
                self.stopped = self.progress(what, done) is False
        elif self._bar or self._wanted():
            self._bar = self._bar or (NotebookBar() if in_notebook() else TerminalBar())
            self._bar.show(what, min(max(done, 0.0), 1.0))
        return self.stopped or self._ended.is_set()

    def _wanted(self):
        if self.progress is not None:
            return self.progress
        return time.monotonic() - self._begun > 1 and (in_notebook() or sys.stderr.isatty())

    def finish(self):
        """Takes away what was shown."""
        if self._bar:
            self._bar.close()
            self._bar = None


class TerminalBar:
    def show(self, what, done):
        sys.stderr.write(f"\r{100 * done:4.0f} %  {what:<40.40}")
        sys.stderr.flush()

    def close(self):
        sys.stderr.write("\r" + " " * 48 + "\r")
        sys.stderr.flush()


class NotebookBar:
    """A bar of HTML below the cell, which needs no widgets."""

    def __init__(self):
        self._handle = None

    def show(self, what, done):
        self._put(f'<progress value="{done:.4f}" max="1"></progress> '
                  f"{100 * done:.0f} % {html.escape(what)}")

    def close(self):
        self._put("")

    def _put(self, text):
        from IPython.display import HTML, display
        if self._handle is None:
            self._handle = display(HTML(text), display_id=True)
        else:
            self._handle.update(HTML(text))


def in_notebook():
    shell = sys.modules.get("IPython")
    return bool(shell and shell.get_ipython() and hasattr(shell.get_ipython(), "kernel"))
