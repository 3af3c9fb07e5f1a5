#!/usr/bin/env python3
"""machine_attack.py FOLDER_OF_SIM [COMMAND [FIRST [LAST]]] [OPTIONS]: a machine that fails.

The n-th call of write, fsync, rename, open, malloc .. of a whole command fails, for n = 1, 2, ..
until the command ends without a failure (fault_shim.cpp does it). After each: no signal, no hang;
an error that names a place and a remedy, and exit code 5; every file of before whole, the older one
or the new one of a run without faults; the checkpoint there unless its own calls failed; nothing
left that the next run does not collect. `--list` names the commands; COMMAND is a regular expression of such names.
"""
import argparse
import concurrent.futures
import os
import pathlib
import random
import re
import resource
import shutil
import struct
import subprocess
import sys
import tempfile

PLUGINS = "@PLUGINS"
ROOT = pathlib.Path(__file__).resolve().parents[2]

# How each call fails; with + it goes on failing.
CALLS = {
    "write": ("ENOSPC", "ENOSPC+", "EIO", "short", "short+", "EINTR"),
    "fsync": ("EIO", "EIO+"),
    "rename": ("EIO", "ENOSPC+"),
    "linkat": ("EOPNOTSUPP", "ENOSPC+"),
    "create": ("ENOSPC", "EMFILE+"),
    "open": ("EMFILE", "EIO", "EMFILE+"),
    "read": ("EIO", "EINTR", "EIO+"),
    "mmap": ("ENOMEM", "ENOMEM+"),
    "thread": ("EAGAIN", "EAGAIN+"),
    "malloc": ("ENOMEM", "ENOMEM+"),
    "fork": ("EAGAIN",),
    "pipe": ("EMFILE",),
    "mkdir": ("ENOSPC",),
    "truncate": ("EIO",),
}
FILE_CALLS = ("write", "fsync", "rename", "linkat", "create")

SCENE = """local sim = require "sim"
local n = sim.arg("n", 4, "particles a side")
local cloth = sim.grid { n, n, du = {0, 0, 1 / n}, dv = {1 / n, 0, 0}, mass = 1 / (n * n) }
cloth:pin(cloth:id(0, 0), cloth:id(0, n - 1))
return sim.scene { name = "mine", particles = cloth,
  forces = { sim.force.gravity { g = {0, -9.81, 0} }, sim.force.drag { k = 0.1 },
    sim.force.spring { family = "link", stiffness = 100, grid = cloth, offsets = { {0, 1}, {1, 0} } } },
  observe = { sag = function(s) return s:position(n * n - 1)[2] end },
  integrator = "rk4", dt = 0.005, duration = 0.05 }
"""
OBJ = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nf 1 2 3\nf 2/1 4/2 3/3\n"
PLY = ("ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
       "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n")
HANDS = "scene scenes/cloth.lua\nset n=4\n+0 grab 5\n+3 move 5 0.5 -0.5 0.2 over 4\n+2 release 5\n+1 pin 7\n"
TABLE = "dt,error,integrator\n0.1,0.01,rk4\n0.2,0.16,rk4\n0.1,0.1,euler\n0.2,0.2,euler\n"
FFMPEG = "#!/bin/sh\nfor last; do :; done\ncat >\"${last#file:}\"\n"  # where there is none


class Command:
    """One command line; {n} is 5, and 3 in the run before, which leaves the older files."""

    def __init__(self, words, stdin="", files=(), before=(), program="sim", snap=None, varies=(), codes=(5,),
                 series=None):
        self.words, self.stdin, self.files, self.before = words.split(), stdin, dict(files), before
        self.program, self.snap, self.varies, self.codes, self.series = program, snap, varies, codes, series


def run_of(rest, **more):
    return Command("scenes/cloth.lua -s n=4 -n {n} -j 1 -q --no-verify " + rest, **more)


PICTURE = "--size 48x32 --every 2"
SWEEP = "sweep scenes/cloth.lua -s n=4 --no-verify --over dt=0.001,0.002 --over integrator=rk4,verlet -T 0.01 --out a.csv"
LINES = ".step {n}\n.save a.lines\n.snap a.snap\n.dump a.csv\n.energy\n.hash\n"
COMMANDS = {
    "tables": run_of("--dump=a.csv --energy=b.csv"),
    "jsonl": run_of("--dump=a.jsonl --energy=b.jsonl"),
    "standard output": run_of("--dump --energy=b.csv"),
    "report": Command("scenes/cloth.lua -s n=4 -n {n} -j 1 --json"),
    "verified": Command("scenes/cloth.lua -s n=4 -n {n} -j 1 --verify"),
    "observe": Command("mine.lua -n {n} --no-verify --observe=a.csv", files={"mine.lua": SCENE}),
    "tension": Command("scenes/linkage.lua -n {n} --no-verify --tension=a.csv"),
    "energy plot": run_of("--energy=a.svg"),
    "csv": run_of("--out a.csv"),
    "jsonl writer": run_of("--out a.jsonl"),
    "png": run_of("--out a.png " + PICTURE),
    "png series": run_of("--out a-%d.png --snap a.snap " + PICTURE, snap="a.snap", series=r"a-\d\.png"),
    "html": run_of("--out a.html"),
    "npz": run_of("--out a.npz"),
    "vtp": run_of("--out a.vtp --every 2"),
    "pvd": run_of("--out a.pvd --every 2", series=r"a/.*\.vtp"),
    "ply": run_of("--out a.ply"),
    "obj": run_of("--out a.obj"),
    "pc2": run_of("--out a.pc2"),
    "xyz": run_of("--out a.xyz"),
    "mp4": run_of("--out a.mp4 --fps 200 --size 32x32"),
    "gif": run_of("--out a.gif --fps 200 --size 32x32 --snap a.snap", snap="a.snap"),
    "many files": run_of("--out a.png --out a.csv --out a.ply --dump=b.csv --snap a.snap --size 32x32", snap="a.snap"),
    "checkpoint": run_of("--snap a.snap --dump", snap="a.snap"),
    "checkpoint of threads": Command("scenes/cloth.lua -s n=48 -n {n} -j 2 --no-verify --snap a.snap", snap="a.snap"),
    "resume": Command("scenes/cloth.lua -s n=4 -n 1{n} --resume a.snap --snap b.snap --dump=a.csv --no-verify",
                      before=("scenes/cloth.lua -s n=4 -n 5 -q --no-verify --snap a.snap",), snap="b.snap"),
    "resume in place": Command("scenes/cloth.lua -s n=4 -n 15 --resume a.snap --snap a.snap --no-verify",
                               before=("scenes/cloth.lua -s n=4 -n 5 -q --no-verify --snap a.snap",), snap="a.snap"),
    "world": Command("scenes/sample.lua -n {n} --no-verify --dump=a.csv --snap a.snap", snap="a.snap"),
    "probe": run_of("--probe --dump=a.csv"),
    "sweep": Command(SWEEP + " -j 1", codes=(5, 9), varies=("a.csv", "a.cases/.*")),
    "sweep of threads": Command(SWEEP + " -j 2", codes=(5, 9), varies=("a.csv", "a.cases/.*")),
    "sweep goes on": Command(SWEEP, before=(SWEEP.replace("--over", "--part 1/2 --over", 1),), codes=(5, 9),
                             varies=("a.csv", "a.cases/.*")),
    "sweep collects": Command(SWEEP + " --collect", before=(SWEEP,), codes=(5, 9),
                              varies=("a.csv", "a.cases/.*")),
    "sweep of cases": Command("sweep scenes/cloth.lua -s n=4 --no-verify --cases c.csv -T 0.01 --out a.csv -j 1",
                              files={"c.csv": "dt,integrator\n0.001,rk4\n0.002,verlet\n"}, codes=(5, 9),
                              varies=("a.csv", "a.cases/.*")),
    "prompt reads": Command("scenes/cloth.lua -s n=4", files={"a.lines": ".step 3\n.hash\n"},
                            stdin=".read a.lines\n.step\n.hash\n", program="simrepl"),
    "record": Command("scenes/cloth.lua -s n=4 --record a.sim", stdin=".step {n}\n.dt 0.001\n.step\n.pin 5\n.step 2\n",
            program="simrepl"),
    "replay": Command("--replay hands.sim --dump=a.csv --no-verify", files={"hands.sim": HANDS}),
    "prompt": Command("scenes/cloth.lua -s n=4", stdin=LINES, program="simrepl"),
    "prompt's arguments": Command("scenes/cloth.lua -s n=4 -e .step -e energy().total -e .hash", program="simrepl"),
    "prompt's studies": Command("scenes/circle.lua", stdin=".step {n}\n.back\n.open scenes/pendulum.lua\n.step\n.dt 0.001\n.undo\n",
                                program="simrepl"),
    "order": Command("order rk4 scenes/circle.lua -T 0.5"),
    "stability": Command("stability scenes/cloth.lua -s n=4 --integrators rk4,verlet --json"),
    "tradeoff": Command("tradeoff scenes/circle.lua -T 0.5 --integrators rk4,trapezoid --csv a.csv --svg a.svg",
                        varies=("a.csv", "a.svg")),
    "minimal": Command("minimal scenes/cloth.lua -s n=4 -T 0.05"),
    "rest": Command("rest scenes/cloth.lua -s n=4 --dump=a.csv"),
    "compare": Command("compare scenes/cloth.lua -s n=4 -T 0.02 -i rk4 -i verlet --out a.png --size 64x32"),
    "import": Command("import a.obj --out b.lua", files={"a.obj": OBJ}),
    "import to standard output": Command("import a.ply", files={"a.ply": PLY}),
    "plot": Command("plot a.csv -x dt -y error --by integrator --out a.svg", files={"a.csv": TABLE}),
    "export": Command("export scenes/cloth.lua -s n=4 -i verlet -n 5 --format lammps out"),
    "describe": Command("describe scenes/cloth.lua --json"),
    "describe a plugin": Command("describe spring"),
    "list": Command("list --json"),
    "adjacency": Command("adjacency scenes/cloth.lua 12"),
    "new plugin": Command("plugin new force mine"),
    "doctor": Command("doctor"),
    "test of a plugin": Command(f"test {PLUGINS}/motions/line.so"),
    "fluid": Command("scenes/dam.lua -n 1 --no-verify -q --snap a.snap", snap="a.snap"),
    "solid": Command("scenes/jelly_fem.lua -n 1 --no-verify -q"),
    "pairs": Command("scenes/gas.lua -n 1 --no-verify -q"),
    "constraints": Command("scenes/linkage.lua -n 2 --no-verify -q"),
    "contact": Command("scenes/cloth_ball.lua -n 2 --no-verify -q"),
    "implicit": Command("scenes/cloth.lua -s n=4 -i implicit_euler -n 2 --no-verify -q"),
    "wind": Command("scenes/flag.lua -n 2 --no-verify -q"),
}


class Place:
    """A folder as a command finds it, and what the command makes of it."""

    def __init__(self, name, older):
        self.command, self.name, self.older = COMMANDS[name], name, older
        self.start = pathlib.Path(tempfile.mkdtemp(prefix="sim_machine_", dir=WORK))
        for file, text in self.command.files.items():
            (self.start / file).write_text(text)
        for words in self.command.before:
            ended = execute([SIM / "sim"] + words.split(), self.start, "")
            assert ended.returncode == 0, ended
        if older:
            ended = self.run(self.start, steps="3")
            assert ended.returncode == 0, (name, ended)
        if older and self.name == "new plugin":  # what is there is refused
            shutil.rmtree(self.start / "mine")
        self.before = contents(self.start)
        self.after, self.out = None, None
        self.same_out = True  # as where no other duration is told
        for _ in range(2):
            folder = self.copy()
            ended = self.run(folder)
            assert ended.returncode == 0, (name, ended)
            now = contents(folder)
            if self.after is not None:
                differ = {f for f in set(now) | set(self.after) if now.get(f) != self.after.get(f)}
                assert all(map(self.varies, differ)), (name, differ)
                self.same_out = self.out == without_durations(ended.stdout)
            self.after, self.out = now, without_durations(ended.stdout)
            shutil.rmtree(folder)

    def varies(self, file):
        """Durations stand in it."""
        return any(re.fullmatch(pattern, file) for pattern in self.command.varies)

    def copy(self):
        folder = pathlib.Path(tempfile.mkdtemp(prefix="sim_machine_", dir=WORK)) / "at"
        shutil.copytree(self.start, folder)
        return folder

    def run(self, folder, steps="5", fault=None, report=None):
        words = [word.replace("{n}", steps).replace(PLUGINS, str(SIM.parent / "lib/sim/plugins")) for word in self.command.words]
        return execute([SIM / self.command.program] + words, folder, self.command.stdin.replace("{n}", steps),
                       fault, report)


def execute(words, folder, stdin, fault=None, report=None):
    environment = {k: v for k, v in os.environ.items() if not k.startswith(("SIM_", "FAIL_"))}
    environment["PATH"] = f"{WORK / 'programs'}:{environment['PATH']}"
    environment["HOME"] = environment["XDG_STATE_HOME"] = str(WORK / "home")
    environment["TMPDIR"] = str(WORK / "home")
    if fault:
        environment |= {"LD_PRELOAD": str(SHIM), "SIM_FAULT": fault, "SIM_FAULT_REPORT": str(report)}
    return subprocess.run([str(word) for word in words], cwd=folder, input=stdin, env=environment, text=True,
                          errors="replace", capture_output=True, timeout=OPTIONS.seconds,
                          preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_CORE, (0, 0)))


def without_durations(told):
    """Durations are seldom the same twice, and the two runs without faults may be such a pair."""
    return re.sub(r"^ran .*", "", told, flags=re.M)


def contents(folder):
    return {str(f.relative_to(folder)): f.read_bytes() for f in folder.rglob("*") if f.is_file()}


def is_leftover(name):
    return pathlib.Path(name).name.startswith(".sim-") and ".tmp" in name


def looks_whole(name, data):
    if name.endswith(".svg"):
        return data.rstrip().endswith(b"</svg>")
    return data.endswith(b"\n")


def read_report(file):
    """How many calls, how many of them failed, and the program's functions behind the first."""
    data = file.read_bytes() if file.exists() else b""
    if len(data) < 24:
        return 0, 0, []
    count, failed, frames = struct.unpack("qqq", data[:24])
    names = [data[24 + 112 * i:24 + 112 * (i + 1)].split(b"\0")[0].decode() for i in range(frames)]
    return count, failed, [name for name in names if name and "shim" not in name]


def functions(frames):
    """Names of sim's own functions among them, the innermost first."""
    found = []
    for frame in frames:
        name, offset = frame.rsplit("+", 1)
        file = LIBRARIES.get(name)
        if file is None:
            continue
        told = subprocess.run(["addr2line", "-Cfie", file, hex(int(offset, 16) - 1)], capture_output=True, text=True)
        lines = told.stdout.split("\n")[::2]
        found += [line.split("(")[0][-70:] for line in lines if line and not line.startswith(("std::", "__gnu"))]
    return found


SAID = re.compile(r"^sim: error: [^:]+: .+; .+", re.M)


def wrong_end(place, ended):
    """Why this is no way to end."""
    if ended.returncode < 0:
        return f"signal {-ended.returncode}"
    for word in ("please report", "terminate called", "internal"):
        if word in ended.stderr:
            return f"it said '{word}'"
    if ended.returncode == 0:
        return ""
    if ended.returncode not in place.command.codes:
        return f"exit code {ended.returncode}"
    if not SAID.search(ended.stderr) and not (ended.returncode == 9):
        return "no place or remedy in its error"
    return ""


def wrong_files(place, ended, folder, for_ever):
    now = contents(folder)
    for name in set(now) | set(place.before) | set(place.after):
        data, old, new = now.get(name), place.before.get(name), place.after.get(name)
        if is_leftover(name):
            continue
        if place.varies(name) and data is not None and data != old:
            if not looks_whole(name, data):
                return f"half of {name}"
            continue
        if ended.returncode == 0 and data != new:
            return f"exit code 0 and {name} is " + ("missing" if data is None else "another")
        if data != old and data != new:
            return f"{name} is " + ("gone" if data is None else "neither the older nor the new one")
    if ended.returncode == 0 and place.same_out and without_durations(ended.stdout) != place.out:
        return "exit code 0 and another standard output"
    series = [f for f in set(now) | set(place.after) if place.command.series and re.fullmatch(place.command.series, f)]
    if (not for_ever and any(now.get(f) != place.before.get(f) for f in series)
            and any(now.get(f) != place.after.get(f) for f in series)):
        return "some files of a series are new and some old"
    if any(map(is_leftover, now)):
        again = place.run(folder)
        if again.returncode != 0 and place.name != "new plugin":
            return f"the next run ends with {again.returncode}: {again.stderr[-200:]}"
        if left := [name for name in contents(folder) if is_leftover(name)]:
            return f"left for good: {left}"
    snap = place.command.snap
    if snap and ended.returncode != 0 and now.get(snap) != place.after[snap] and snap not in ended.stderr:
        return f"no checkpoint in {snap}"
    return ""


def attempt(place, call, number, how):
    """(injected, why it failed)"""
    for_ever = how.endswith("+")
    folder = place.copy()
    report = folder.parent / "report"
    fault = f"{call}:{number}{'+' if for_ever else ''}:{how.rstrip('+')}"
    frames, why, ended = [], "", None
    try:
        ended = place.run(folder, fault=fault, report=report)
    except subprocess.TimeoutExpired as late:
        why = f"did not end in {OPTIONS.seconds} s"
    _, failed, frames = read_report(report)
    why = why or wrong_end(place, ended) or wrong_files(place, ended, folder, for_ever)
    if not why and call == "linkat" and ended.returncode != 0:
        why = "a file that could not be linked was not copied"
    if why and why.startswith("no checkpoint") and is_before_run(functions(frames)):
        why = ""
    if why:
        said = ended.stderr.strip()[-300:] if ended else ""
        trail = " < ".join(functions(frames)[:12])
        why = (why, f"{fault}{'' if place.older else ' without older files'}", said, trail)
    shutil.rmtree(folder.parent)
    return failed > 0, why


def is_before_run(names):
    own = [name for name in names if "::" in name]  # Lua has functions like finishbinexpval
    return not any(word in name for name in own for word in ("follow", "advance", "commit", "finish", "write_files"))


def points(count, options, rng):
    """Which numbers of calls are tried, of so many."""
    if options.short:
        return sorted({1 + count * k // options.short for k in range(options.short)} & set(range(1, count + 1)))
    most = options.every
    if options.all or count <= 2 * most:
        return list(range(1, count + 1))
    stride = (count - most) // most
    return list(range(1, most + 1)) + list(range(most + 1 + rng.randrange(stride), count + 1, stride))


def attack(name, options, pool):
    tried, failures, rng = 0, [], random.Random(f"{options.seed} {name}")
    for older in (True, False):
        place = Place(name, older)
        if not older and place.before == PLACES[name].before:
            shutil.rmtree(place.start)
            continue
        PLACES[name] = place
        for call, ways in CALLS.items():
            if options.calls and call not in options.calls or not older and call not in FILE_CALLS:
                continue
            folder = place.copy()
            report = folder.parent / "report"
            place.run(folder, fault=f"{call}:0:EIO", report=report)
            count = read_report(report)[0]
            shutil.rmtree(folder.parent)
            for how in ways[:1] if options.short and call in ("read", "open") else ways:
                chosen = [n for n in points(count, options, rng) if options.first <= n <= options.last]
                results = list(pool.map(lambda n: attempt(place, call, n, how), chosen))
                tried += sum(injected for injected, _ in results)
                failures += [why for _, why in results if why]
                # Threads may add calls: on, until the whole command passes.
                number = count + 1
                while count and not options.short and options.last > number and number < count + 50:
                    injected, why = attempt(place, call, number, how)
                    tried, failures = tried + injected, failures + [why] * bool(why)
                    if not injected:
                        break
                    number += 1
        if not older:
            break
    for place in {PLACES[name]}:
        shutil.rmtree(place.start, ignore_errors=True)
    return tried, failures


def parse():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("command", nargs="?", default="")
    parser.add_argument("first", nargs="?", type=int, default=1)
    parser.add_argument("last", nargs="?", type=int, default=sys.maxsize)
    parser.add_argument("--seed", type=int, default=1, help="of the offset of strides")
    parser.add_argument("--every", type=int, default=300, metavar="N",
                        help="of a call with more than 2 N points the first N, and N more at a stride (300)")
    parser.add_argument("--all", action="store_true", help="every point of every call")
    parser.add_argument("--short", type=int, default=0, metavar="N", help="N points of each call")
    parser.add_argument("--calls", type=lambda text: text.split(","), help="only these, as write,malloc")
    parser.add_argument("--seconds", type=float, default=120, help="of a command, more than it needs (120)")
    parser.add_argument("-j", type=int, default=os.cpu_count(), help="commands at once")
    parser.add_argument("--list", action="store_true", help="names of commands and calls")
    return parser.parse_args()


def tell(failures):
    """One of each kind, with the others' numbers."""
    kinds = {}
    for why, fault, said, trail in failures:
        kind = fault.split(":")[0], re.sub(r"\d+", "N", why), re.sub(r"\d+|/\S+/|[\w-]+\.so", "N", said)
        kinds.setdefault(kind, []).append((why, fault, said, trail))
    for alike in kinds.values():
        why, fault, said, trail = alike[0]
        more = f" and {len(alike) - 1} like it: {' '.join(a[1] for a in alike[1:4])}" if alike[1:] else ""
        print(f"    {fault}: {why}{more}\n      {said}\n      in {trail}", flush=True)


def main(options):
    (WORK / "programs").mkdir()
    (WORK / "home").mkdir()
    program = WORK / "programs/ffmpeg"
    program.write_text(FFMPEG)
    program.chmod(0o755)
    names = [name for name in COMMANDS if re.fullmatch(options.command or ".*", name)]
    if not names:
        sys.exit(f"machine: no command like '{options.command}'; --list names them")
    total, failures = 0, []
    with concurrent.futures.ThreadPoolExecutor(options.j) as pool:
        for name in names:
            try:
                tried, wrong = attack(name, options, pool)
            except AssertionError as unfit:
                tried, wrong = 0, [("it cannot be prepared", ":", str(unfit), "")]
            total, failures = total + tried, failures + wrong
            print(f"  {name:28} {tried:6} points, {len(wrong)} failed", flush=True)
            tell(wrong)
    print(f"machine: {len(failures)} of {total} points failed, {len(names)} commands, seed {options.seed}")
    return 1 if failures else 0


if __name__ == "__main__":
    OPTIONS = parse()
    SIM = OPTIONS.folder.resolve()
    SHIM = SIM.parent / "tests/fixtures/fault_shim.so"
    LIBRARIES = {file.name: file for file in [SIM / "sim", SIM / "simrepl", *SIM.parent.glob("lib/**/*.so*")]}
    PLACES = {}
    if OPTIONS.list:
        print("\n".join(COMMANDS), "\ncalls:", *CALLS)
        sys.exit(0)
    WORK = pathlib.Path(tempfile.mkdtemp(prefix="sim_machine_"))
    try:
        sys.exit(main(OPTIONS))
    finally:
        shutil.rmtree(WORK, ignore_errors=True)
