#!/usr/bin/env python3
"""arguments.py FOLDER_OF_SIM [EVERY]: every numeric argument of every shipped scene at other values.

Each argument of each scene is set to 0, -1 and a tenth, ten and a hundred times its default, and
the scene runs for 20 steps. A run must end by itself, not by a signal and with a documented exit
code. One that takes longer than a minute of the processor must have said how long it will take or
how far it is; it is then ended by a signal that it must hear. With EVERY = 25 only every 25th run of a scene is made, which is the short form.
"""
import json
import os
import pathlib
import re
import signal
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
SCENES = sorted((ROOT / "scripts/scenes").glob("*.lua"))
SECONDS = 60
STEPS = 20
PLAIN = {0, 2, 3, 4, 5}  # usage, scene, diverged, memory


def number_of(text):
    try:
        return float(text)
    except (TypeError, ValueError):
        return None


def cases_of(sim, scene):
    """The settings NAME=VALUE of a scene that are tried."""
    described = subprocess.run([sim, "describe", str(scene), "--json"], capture_output=True,
                               text=True, check=True)
    for argument in json.loads(described.stdout)["args"]:
        default = number_of(argument["default"])
        if default is None:
            continue
        values = {0.0, -1.0} | {default * factor for factor in (0.1, 10, 100)}
        for value in sorted(values - {default}):
            yield f"{argument['name']}={value:.12g}"


def seconds_of(process):
    """Processor time that a child has used; none when it has ended."""
    try:
        fields = pathlib.Path(f"/proc/{process}/stat").read_text().rsplit(")", 1)[1].split()
    except OSError:
        return 0
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def ends(run, begin, seconds):
    """Waits for the end of a run, for so long that it can have used so many seconds."""
    while run.poll() is None:
        if seconds_of(run.pid) > begin + seconds:
            return False
        time.sleep(0.02)
    return True


def failure_of(sim, scene, setting):
    """Why a run is wrong; nothing for one that is right."""
    command = [sim, str(scene), "-s", setting, "-n", str(STEPS), "--progress", "on"]
    with tempfile.TemporaryFile("w+", errors="replace") as said:
        run = subprocess.Popen(command, stdout=said, stderr=said)
        if not ends(run, 0, SECONDS):
            run.send_signal(signal.SIGINT)
            if not ends(run, seconds_of(run.pid), SECONDS):
                run.kill()
                run.wait()
                return f"deaf to Ctrl-C for {SECONDS} s"
            said.seek(0)
            words = said.read()
            told = re.search(r"takes about|will take|steps/s|%", words)
            return "" if told else f"no word of how long it takes in {SECONDS} s"
        said.seek(0)
        words = said.read()
    if run.returncode < 0:
        return f"signal {-run.returncode}"
    if run.returncode not in PLAIN:
        return f"exit code {run.returncode}: {words.strip().splitlines()[-1:]}"
    return ""


def main():
    sim = os.path.join(sys.argv[1], "sim")
    every = int(sys.argv[2]) if len(sys.argv) > 2 else 1
    runs, failures, begin = 0, 0, time.monotonic()
    for scene in SCENES:
        for number, setting in enumerate(cases_of(sim, scene)):
            if number % every:
                continue
            runs += 1
            why = failure_of(sim, scene, setting)
            if why:
                failures += 1
                print(f"{scene.name} -s {setting} -n {STEPS}: {why}", flush=True)
    print(f"{runs} runs, {failures} failed, {time.monotonic() - begin:.0f} s")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
