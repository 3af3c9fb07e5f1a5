#!/usr/bin/env python3
"""attack.py FOLDER_OF_SIM [COUNT [SEED]]: hostile input of every kind, chosen at random.

Each attack is a run of `sim` or `simrepl` on damaged scenes, arguments, checkpoints, plugins,
recordings, meshes, with little memory, full disks, or signals at any time. A run must end by
itself, with an exit code that its kind allows, leave no file that is not whole, and never be ended
by a signal that nobody sent. What fails is printed with its seed, and its files are kept:
`attack.py FOLDER 1 SEED` repeats it.
"""
import os
import pathlib
import random
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
SCENES = sorted((ROOT / "scripts/scenes").glob("*.lua"))
SECONDS = 300  # of a run; far more than any needs, also on a busy machine
WORDS = (
    "nil true false 0 1 -1 2 0.5 1e308 -1e308 5e-324 0/0 1/0 2^53 math.huge math.mininteger {} "
    "{0,0,0} {1,2,3} {{0,1},{1,2}} 'x' '' \"\\0\" function(t)return{t,t,t}end print sim cloth "
    "sim.particles{} sim.force.gravity{} sim.motion.line{velocity={1,0,0}} # .. == not and or "
    "-- --[[ ]] [[ ( ) { } [ ] = , ; end do then local return goto :: 1000000 1e9 99999999999"
).split()
PLAIN = {0, 2, 3, 4, 5, 6, 7, 8}  # every documented end of a run but "internal"


def damaged(rng, data, words=()):
    """Bytes with a few random changes."""
    data = bytearray(data)
    for _ in range(rng.choice((1, 1, 1, 2, 3, 8))):
        at = rng.randrange(len(data) + 1)
        kind = rng.randrange(6)
        if kind == 0 and data:
            data[at % len(data)] ^= 1 << rng.randrange(8)
        elif kind == 1:
            del data[at:at + rng.choice((1, 2, 10, 200))]
        elif kind == 2:
            data[at:at] = data[at:at + rng.choice((1, 5, 50))]
        elif kind == 3:
            data[at:at] = bytes(rng.randrange(256) for _ in range(rng.randrange(1, 9)))
        elif kind == 4 and words:
            data[at:at] = (" " + rng.choice(words) + " ").encode()
        elif words:  # a number or a name becomes another word
            end = at
            while end < len(data) and chr(data[end]).isalnum():
                end += 1
            data[at:end] = rng.choice(words).encode()
        else:
            data = data[:at]
    return bytes(data)


class Run:
    """What an attack is: a command line, how it is started, and what it may end with."""

    def __init__(self, program, *args, codes=PLAIN, stdin=b"", memory=None, stop=None, after=None):
        self.program, self.args, self.codes = program, [str(a) for a in args], codes
        self.stdin, self.memory, self.stop, self.after = stdin, memory, stop, after


def scene(rng, folder):
    file = rng.choice(SCENES)
    (folder / "a.lua").write_bytes(damaged(rng, file.read_bytes(), WORDS))
    return Run("sim", "a.lua", "-n", "3", "-q", "--no-verify")


def arguments(rng, folder):
    options = {
        "-i": "rk4 verlet euler rk4:precision=single auto:tol=0 dopri5:tol=1e-3 nothing x:y=z",
        "-d": "0 1 -1 1e308 nan 1e-9 0.001", "-T": "0 0.01 -1 inf x", "-n": "0 1 5 -1 1e9 9999999999999999999",
        "-s": "n=5 n=-1 n=1e9 n=x =3 n= stiffness=1e300", "--tol": "0 1e-3 -1 x", "--every": "0 1 7 -1 x",
        "--precision": "single double half", "--debug-particle": "0 5 -1 99999 x a:1", "--energy": "e.csv e.svg",
        "--dump": "a.csv a.jsonl a.nothing . /", "--snap": "a.snap / .", "--out": "a.png a.ply a.html a.npz a.csv",
        "--fps": "30 0 -1 1e9", "--size": "16x16 0x0 1x1 99999x9 x", "--camera": "eye=1 eye=0,0,0 at=1,2,3 fov=0",
        "--color": "strain strain:0 speed:1 error mode x", "--springs": "0 all x -1", "--check": "energy=1% dt=0 x",
        "-j": "0 1 2 -1 999999", "--off": "wind x", "--without": "gravity x", "--seed": "0 -1 x",
        "--load": "/dev/null . a.so", "--lua-budget": "time=1 memory=1 steps=10 x"}
    args = [rng.choice(SCENES), "-n", "2", "-q", "--no-verify"]
    for _ in range(rng.randrange(1, 5)):
        name = rng.choice(sorted(options))
        args += [name, rng.choice(options[name].split())][:2 if rng.random() < 0.95 else 1]
    verb = rng.choice(("", "", "", "list", "describe", "order", "stability", "rest", "help", "plot",
                       "import", "doctor"))
    if verb == "import":
        args = ["a.obj"] + args[4:]
    return Run("sim", *([verb] if verb else []), *args, codes=PLAIN | {9}, stop=(signal.SIGINT, 20))


def checkpoint(rng, folder):
    made(folder, "--snap", "a.snap", "-n", "5")
    data = bytearray((folder / "a.snap").read_bytes()[:-8])
    if rng.random() < 0.5:
        data = damaged(rng, data)
    else:  # one number of it
        at = rng.randrange(1, len(data) // 8) * 8 + rng.randrange(8) * rng.randrange(2)
        word = rng.choice((0, 1, 2**31, 2**63, 2**64 - 1, 0x7FF8 << 48, 0x7FEF << 48, rng.getrandbits(64)))
        data[at:at + 8] = word.to_bytes(8, "little")
    sealed = checksum(data) if rng.random() < 0.8 else rng.getrandbits(64)
    (folder / "a.snap").write_bytes(data + sealed.to_bytes(8, "little"))
    return Run("sim", "scenes/cloth.lua", "-s", "n=4", "-q", "--no-verify", "--resume", "a.snap",
               "-n", "9")


def checksum(data):
    """Of a checkpoint, so that false contents get past it."""
    state, most = 0, 2**64 - 1
    whole_words = len(data) // 8 * 8
    words = [int.from_bytes(data[i:i + 8], "little") for i in range(0, whole_words, 8)]
    for word in words + list(data[whole_words:]):
        state = (state + word + 0x9E3779B97F4A7C15) & most
        state = ((state ^ state >> 30) * 0xBF58476D1CE4E5B9) & most
        state = ((state ^ state >> 27) * 0x94D049BB133111EB) & most
        state ^= state >> 31
    return state


def library(rng, folder):
    file = rng.choice(sorted(PLUGINS.glob("*/*.so")))
    (folder / file.name).write_bytes(damaged(rng, file.read_bytes()))
    return Run("sim", "-q", "--no-verify", "-n", "1", "--load", folder / file.name, codes={0, 7})


def recording(rng, folder):
    text = (b"scene scenes/cloth.lua\nset n=4\n+0 grab 5\n+3 move 5 0.5 -0.5 0.2 over 4\n+2 release 5\n"
            b"+1 pin 7\n+4 unpin 7\n+1 dt 0.0005\n+2 integrator rk4\n+2 reset\n")
    (folder / "a.sim").write_bytes(damaged(rng, text, WORDS + "grab move release pin".split()))
    return Run("sim", "-q", "--no-verify", "--replay", "a.sim", stop=(signal.SIGINT, 10))


def mesh(rng, folder):
    text = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nf 1 2 3\nf 2/1 4/2 3/3\n"
    ply = (b"ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty "
           b"float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 "
           b"0\n0 1 0\n3 0 1 2\n")
    name, data = rng.choice((("a.obj", text), ("a.ply", ply)))
    (folder / name).write_bytes(damaged(rng, data, WORDS))
    if rng.random() < 0.3:
        (folder / name).write_bytes(data)
    return Run("sim", "import", name, "--out", "b.lua")


def prompt(rng, folder):
    lines = (".step 5|.back|x(3)|.pin 3|.dt 0.001|.integrator verlet|.energy|.springs 2|.save a.txt|"
             ".open scenes/pendulum.lua|.undo|return 1|for i=1,3 do step() end|.help|.snap a.snap|"
             "pos(1)|.record e energy() every 3|.plot e|.forces 4|.reload|while true do end").split("|")
    text = "\n".join(rng.choice(lines) for _ in range(rng.randrange(1, 15))).encode() + b"\n"
    return Run("simrepl", "scenes/cloth.lua", "-s", "n=4", "--lua-budget", "time=1",
               stdin=damaged(rng, text, WORDS))


def memory(rng, folder):
    extra = rng.choice((["--out", "a.png"], ["--out", "a.html"], ["--dump=a.csv"], []))
    return Run("sim", rng.choice(SCENES), "-n", "3", "-q", "--no-verify", *extra,
               memory=rng.randrange(6, 60) << 20, codes={0, 3, 4, 5, 7, 127}, after=whole)


def signals(rng, folder):
    sent = rng.choice((signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGKILL))
    return Run("sim", "scenes/cloth.lua", "-s", "n=12", "-T", "50", "-q", "--no-verify", "--dump=a.csv",
               "--every", "3", "--energy=b.csv", "--out", "c.png", "--size", "80x60", "--snap",
               "d.snap", stop=(sent, rng.random() * 0.6), codes={0, -9, 128 + int(sent)}, after=whole)


def no_room(rng, folder):
    where = rng.choice(("/dev/full", "/nowhere/a.csv", "/proc/a.csv", "a.csv/b.csv"))
    (folder / "a.csv").write_text("mine\n")
    return Run("sim", "-n", "5", "-q", "--no-verify", f"--dump={where}", codes={2, 5})


def whole(folder):
    """What is wrong with the files that a run left."""
    for file in folder.rglob("*"):
        data = file.read_bytes() if file.is_file() else b"\n"
        if file.name.startswith(".") or ".tmp" in file.name:
            return f"left {file.name}"
        if file.suffix == ".csv" and not data.endswith(b"\n"):
            return f"half of {file.name}"
        if file.suffix == ".png" and b"IEND" not in data[-16:]:
            return f"half of {file.name}"
    return ""


def made(folder, *args):
    subprocess.run([SIM / "sim", "scenes/cloth.lua", "-s", "n=4", "-q", "--no-verify", *args],
                   cwd=folder, check=True, timeout=SECONDS)


def attempt(attack, seed, folder):
    """Why it failed; empty when it did not."""
    run = attack(random.Random(seed), folder)
    command = [str(SIM / run.program)] + run.args

    def limit():
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        if run.memory:
            resource.setrlimit(resource.RLIMIT_AS, (run.memory, run.memory))

    child = subprocess.Popen(command, cwd=folder, stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                             stderr=subprocess.PIPE, preexec_fn=limit)
    sent = None
    try:
        try:
            out, err = child.communicate(run.stdin, timeout=run.stop[1] if run.stop else SECONDS)
        except subprocess.TimeoutExpired:
            if not run.stop:
                raise
            sent = run.stop[0]
            child.send_signal(sent)
            out, err = child.communicate(timeout=SECONDS)
    except subprocess.TimeoutExpired:
        child.kill()
        child.communicate()
        return f"did not end in {SECONDS} s: {' '.join(command)}"
    said = err.decode(errors="replace")
    ends[attack.__name__, child.returncode] = ends.get((attack.__name__, child.returncode), 0) + 1
    allowed = set(run.codes) | ({128 + int(sent)} if sent else set())
    if sent and not any(folder.iterdir()):
        allowed.add(-int(sent))  # before it began
    why = ""
    if child.returncode not in allowed:
        why = f"exit code {child.returncode}"
    for word in ("please report", "terminate called", "Sanitizer", "runtime error"):
        why = why or (f"it said '{word}'" if word in said else "")
    if not why and run.after and child.returncode != -signal.SIGKILL:
        why = run.after(folder)
    return why and f"{why}: {' '.join(command)}\n    {said.strip()[-400:]}"


ATTACKS = (scene, scene, scene, arguments, checkpoint, library, recording, mesh, prompt, memory, signals,
           no_room)

if __name__ == "__main__":
    SIM = pathlib.Path(sys.argv[1]).resolve()
    PLUGINS = SIM.parent / "lib/sim/plugins"
    count = int(sys.argv[2]) if len(sys.argv) > 2 else 1000
    first = int(sys.argv[3]) if len(sys.argv) > 3 else time.time_ns() % 10**9
    print(f"attack: {count} from seed {first}", flush=True)
    failures, ends = 0, {}
    for seed in range(first, first + count):
        attack = ATTACKS[seed % len(ATTACKS)]
        folder = pathlib.Path(tempfile.mkdtemp(prefix="sim_attack_"))
        why = attempt(attack, seed, folder)
        if why:
            failures += 1
            print(f"  seed {seed}, {attack.__name__}, files in {folder}\n    {why}", flush=True)
        else:
            shutil.rmtree(folder, ignore_errors=True)
    for attack in sorted(set(ATTACKS), key=lambda a: a.__name__):
        codes = sorted((code, n) for (name, code), n in ends.items() if name == attack.__name__)
        print(f"  {attack.__name__:12}" + "".join(f"  exit {code}: {n}" for code, n in codes))
    print(f"attack: {failures} of {count} failed")
    sys.exit(1 if failures else 0)
