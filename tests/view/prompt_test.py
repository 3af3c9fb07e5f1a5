#!/usr/bin/env python3
"""`.view` at the prompt: the scene as it is, touched through the page, and then the prompt again with
what hands did in its history and in what it saves. `prompt_test.py SIM SIMREPL`"""

import os
import signal
import subprocess
import sys
import tempfile

from live_client import Server, Socket, replay
from skip import need_view

PROGRAM, PROMPT = sys.argv[1:3]


class Prompt(Server):
    """A session that is fed lines; between open() and close() its scene is a page."""

    def __init__(self, *arguments):
        self.record = tempfile.mktemp(suffix=".rec")
        self.process = subprocess.Popen(
            [PROMPT, *arguments, "--init", "none", "--record", self.record],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
            env={k: v for k, v in os.environ.items() if k not in ("DISPLAY", "WAYLAND_DISPLAY")})

    def say(self, text):
        self.process.stdin.write(text + "\n")
        self.process.stdin.flush()

    def ask(self, text):
        self.say(text)
        return self.process.stdout.readline().strip()

    def open(self):
        self.say(".view")
        self.take_address()
        return Socket(self)

    def close(self):
        self.process.send_signal(signal.SIGINT)


def test_history():
    with Prompt("scenes/cloth.lua") as prompt:
        before = [prompt.ask(".hash")]
        prompt.say(".step 90")
        before.append(prompt.ask(".hash"))
        prompt.say(".step 10")
        prompt.say(".hand velocity 30 0 1 0")
        prompt.say(".step 20")
        before.append(prompt.ask(".hash"))
        page = prompt.open()
        state = page.until(lambda s: True)
        system = state["systems"][0]
        # The page shows the state as it is, at rest; actions of the prompt are not undone here.
        assert (system["step"], system["hash"], state["playing"]) == (120, before[2], False), state
        assert "nothing to undo" in page.error_of("undo")
        assert ".set n" in page.error_of("set n 9")
        page.say("step 5"), page.until(lambda s: s["systems"][0]["step"] == 125)
        page.say("grab 63"), page.until(lambda s: s["systems"][0]["held"] == [63])
        page.say("pull 63 0.9 -0.2 0.5"), page.say("step 40")
        page.until(lambda s: s["systems"][0]["step"] == 165)
        page.say("release 63"), page.say("pin 20"), page.say("undo")
        page.until(lambda s: 20 not in s["systems"][0]["pinned"]
                   and s["systems"][0]["step"] == 165)
        page.say("dt 0.004"), page.say("step 10"), page.say("back 3")
        after = page.until(lambda s: s["systems"][0]["step"] == 172)["systems"][0]["hash"]
        page.close()
        prompt.close()
        assert prompt.ask(".hash") == after
        assert prompt.ask(".taken") == "172"
        script = tempfile.mktemp(suffix=".lua")
        prompt.say(".save " + script)
        # Time goes back behind the view, too, and the hands come again on the way.
        prompt.say(".goto 0")
        assert prompt.ask(".hash") == before[0]
        prompt.say(".step 120")
        assert prompt.ask(".hash") == before[2]
        prompt.say(".step 52")
        assert prompt.ask(".hash") == after
        # A second time, from where the first one ended: back before it, and on another way.
        page = prompt.open()
        page.until(lambda s: s["systems"][0]["hash"] == after)
        page.say("back 82"), page.until(lambda s: s["systems"][0]["hash"] == before[1])
        page.say("pin 9"), page.say("step 7")
        other = page.until(lambda s: s["systems"][0]["step"] == 97)["systems"][0]["hash"]
        page.close()
        prompt.close()
        assert prompt.ask(".hash") == other
        whole = tempfile.mktemp(suffix=".lua")
        prompt.say(".save " + whole)
        prompt.say(".quit")
        assert prompt.process.wait(30) == 0, prompt.process.stderr.read()
        code, words = replay(PROGRAM, prompt.record)
        assert code == 0 and "the same bits" in words, words
    for file, expected in ((script, after), (whole, other)):
        with open(file, "a", encoding="utf-8") as out:
            out.write(".hash\n")
        done = subprocess.run([PROMPT, "-f", file], capture_output=True, text=True, check=False)
        with open(file, encoding="utf-8") as text:
            said = text.read()
        assert done.returncode == 0 and done.stdout.split()[-1] == expected, (done, said)
        assert ".view" not in said, said
        os.remove(file)


def test_world():
    """Systems go together in their own way; the history is whole, what is saved says what it lacks."""
    with Prompt("scenes/sample.lua") as prompt:
        prompt.say(".step 10")
        page = prompt.open()
        page.until(lambda s: len(s["systems"]) == 3)
        page.say("cloth: pin 20"), page.say("step 5")
        hashes = [s["hash"] for s in page.until(
            lambda s: not s["playing"] and s["systems"][0]["step"] == 15)["systems"]]
        page.close()
        prompt.close()
        found = [prompt.ask(".hash")] + [prompt.process.stdout.readline() for _ in range(2)]
        assert [line.split()[0] for line in found] == hashes, (found, hashes)
        prompt.say(".quit")
        assert prompt.process.wait(30) == 0, prompt.process.stderr.read()


def test_refusals():
    for words, what in ((".view sky", "expected page, terminal or window"),
                        (".view terminal", "terminal"), (".view page 3", "1 argument")):
        done = subprocess.run([PROMPT, "-e", words], capture_output=True, text=True, check=False,
                              stdin=subprocess.DEVNULL)
        assert done.returncode in (2, 5) and what in done.stderr, done


if __name__ == "__main__":
    need_view(PROGRAM, "web", "Boost", "libboost-dev")
    for test in (test_history, test_world, test_refusals):
        test()
        print(test.__name__, "ok", flush=True)
