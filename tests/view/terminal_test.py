#!/usr/bin/env python3
"""`sim view --terminal` in a pseudo terminal: pictures come, the mouse pulls, keys work, and the
terminal is as before on every way out. `terminal_test.py SIM`"""

import fcntl
import os
import pty
import re
import resource
import select
import signal
import struct
import sys
import tempfile
import termios
import time

from live_client import replay

PROGRAM = sys.argv[1]
LEAVE = b"\x1b[?1006l\x1b[?1002l\x1b[?25h\x1b[0m\x1b[?1049l"


class Terminal:
    def __init__(self, *arguments, colours="truecolor", columns=80, rows=24):
        self.record = tempfile.mktemp(suffix=".rec")
        self.output = b""
        self.child, self.file = pty.fork()
        if self.child == 0:
            os.environ.update(TERM="xterm-256color", COLORTERM=colours)
            os.environ.pop("NO_COLOR", None)
            resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
            time.sleep(0.2)  # until the size is set
            os.execv(PROGRAM, [PROGRAM, "view", *arguments, "--terminal", "--record", self.record])
        fcntl.ioctl(self.file, termios.TIOCSWINSZ, struct.pack("HHHH", rows, columns, 0, 0))
        self.modes = termios.tcgetattr(self.file)[:4]

    def read(self, seconds):
        end = time.time() + seconds
        new = b""
        while (left := end - time.time()) > 0:
            if not select.select([self.file], [], [], left)[0]:
                break
            try:
                more = os.read(self.file, 65536)
            except OSError:
                break
            if not more:
                break
            new += more
        self.output += new
        return new

    def until(self, pattern, seconds=20):
        end = time.time() + seconds
        start = len(self.output)
        while time.time() < end:
            self.read(0.1)
            if found := re.search(pattern, self.output[start:]):
                return found
        raise AssertionError("did not come: " + str(pattern) + str(self.output[-300:]))

    def write(self, text):
        os.write(self.file, text if isinstance(text, bytes) else text.encode())

    def mouse(self, code, x, y, end="M"):
        self.write("\x1b[<%d;%d;%d%s" % (code, x + 1, y + 1, end))

    def wait(self):
        """The exit code, or minus the signal; the terminal is as it was."""
        end = time.time() + 20
        while time.time() < end:
            self.read(0.05)
            time.sleep(0.02)
            done, status = os.waitpid(self.child, os.WNOHANG)
            if done:
                break
        else:
            os.kill(self.child, signal.SIGKILL)
            raise AssertionError("it does not end")
        self.read(0.2)
        assert self.output.rstrip().endswith(LEAVE) or LEAVE in self.output[-400:], \
            self.output[-400:]
        assert termios.tcgetattr(self.file)[:4] == self.modes, "modes of the terminal"
        os.close(self.file)
        return os.waitstatus_to_exitcode(status)


def test_touch():
    one = Terminal("scenes/cloth.lua", "-s", "n=12")
    one.until(rb"t = 0\.[3-9]")
    assert one.output.count(b"\xe2\x96\x80") > 80 * 20
    held = None
    for y in range(4, 20, 2):  # somewhere there is the cloth
        for x in range(30, 60, 5):
            one.mouse(0, x, y)
            found = one.until(rb"trusted|suspect|particle (\d+)")
            one.read(0.1)
            if found := re.search(rb"particle (\d+)", one.output[-4000:]):
                held = found[1]
                break
            one.mouse(0, x, y, "m")
        if held:
            break
    assert held, "nothing under the mouse"
    for k in range(10):
        one.mouse(32, x + k, y)
        one.read(0.05)
    one.mouse(0, x + 10, y, "m")
    for key in ("f", "c", "p", "?", "\x1b[C", "\x1b[D", "]", "u", " ", "+", "[", "w"):
        one.write(key)
        one.read(0.08)
    one.until(rb"paused|real time")
    for junk in (b"\x1b[<", b"\x1b[<999999999999999999999;1;1M", b"\x1b[<0;0;0M", b"\x1b[1;2;3;4R",
                 b"\xff\xfe\x00\x01", b"\x1bOP", b"\x1b[200~paste", b"\x1b[<0;5", b"\x1b[<a;b;cM"):
        one.write(junk)
        one.read(0.05)
    one.write("r")
    one.read(0.2)
    one.write("q")
    assert one.wait() == 0
    with open(one.record, encoding="ascii") as file:
        text = file.read()
    assert " grab " + held.decode() in text and " move " in text and " release " in text, text
    code, words = replay(PROGRAM, one.record)
    assert code == 0 and "the same bits" in words, words
    os.remove(one.record)


def test_status():
    """The share of the largest stable step is known in a scene of particles."""
    for scene, share in (("scenes/cloth.lua", True), ("scenes/circle.lua", False)):
        one = Terminal(scene, columns=120)
        line = one.until(rb"t = [^\x1b]* x real time|t = [^\x1b]*  paused")[0]
        assert (b" % of limit" in line) == share, line
        assert b"nan" not in line, line
        one.write("q")
        assert one.wait() == 0
        os.remove(one.record)


def test_ways_out():
    for number, code in ((signal.SIGTERM, 143), (signal.SIGINT, 130), (signal.SIGHUP, -1),
                         (signal.SIGQUIT, -3), (signal.SIGSEGV, -11), (signal.SIGABRT, -6)):
        one = Terminal()
        one.until(rb"real time")
        os.kill(one.child, number)
        assert one.wait() == code, number
        os.remove(one.record)
    one = Terminal()
    one.until(rb"real time")
    one.write("\x03")  # as Ctrl-C
    assert one.wait() == 130
    os.remove(one.record)


def test_cost():
    for colours, most in (("truecolor", 30000), ("", 12000)):
        one = Terminal("scenes/cloth.lua", "-s", "n=24", colours=colours)
        one.until(rb"t = 0\.[2-9]")
        pictures = one.read(2)
        count = pictures.count(b"\x1b[?2026h")
        assert count > 3 and len(pictures) / count < most, (colours, count, len(pictures))
        one.write("q")
        assert one.wait() == 0
        os.remove(one.record)


if __name__ == "__main__":
    test_touch()
    test_status()
    test_ways_out()
    test_cost()
    print("ok")
