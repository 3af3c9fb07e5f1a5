#!/usr/bin/env python3
"""The window under a virtual display, with keys and a mouse of X itself: it shows something, a drag
moves what is under the pointer, keys and panel act, and the session comes again bit for bit.
`window_test.py SIM SIMREPL [SCREENSHOT.png]`"""

import mmap
import os
import shutil
import struct
import subprocess
import sys
import tempfile
import time
import zlib

from live_client import replay
from skip import need_view, skip

PROGRAM = sys.argv[1]


class Display:
    """A screen in memory, which is a file of pixels (XWD) too."""

    def __init__(self):
        self.folder = tempfile.mkdtemp()
        read, write = os.pipe()
        self.process = subprocess.Popen(
            ["Xvfb", "-displayfd", str(write), "-screen", "0", "1280x800x24", "-fbdir",
             self.folder, "-nolisten", "tcp"],
            pass_fds=(write,), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        os.close(write)
        with os.fdopen(read) as told:
            self.name = ":" + told.readline().strip()
        self.environment = dict(os.environ, DISPLAY=self.name, LIBGL_ALWAYS_SOFTWARE="1")
        self.environment.pop("WAYLAND_DISPLAY", None)
        with open(os.path.join(self.folder, "Xvfb_screen0"), "rb") as file:
            self.memory = mmap.mmap(file.fileno(), 0, prot=mmap.PROT_READ)
        head = struct.unpack(">25I", self.memory[:100])
        self.width, self.height, self.stride = head[4], head[5], head[12]
        self.start = head[0] + 12 * head[19]

    def close(self):
        self.process.kill()
        self.process.wait()
        shutil.rmtree(self.folder, ignore_errors=True)

    def rows(self):
        """Of pixels, four bytes each: blue, green, red, nothing."""
        pixels = self.memory[self.start:self.start + self.stride * self.height]
        return [pixels[y * self.stride:y * self.stride + 4 * self.width]
                for y in range(self.height)]

    def screenshot(self, file):
        raw = b"".join(b"\0" + bytes(v for x in range(0, len(row), 4)
                                     for v in (row[x + 2], row[x + 1], row[x]))
                       for row in self.rows())

        def chunk(name, data):
            return (struct.pack(">I", len(data)) + name + data +
                    struct.pack(">I", zlib.crc32(name + data)))

        with open(file, "wb") as out:
            out.write(b"\x89PNG\r\n\x1a\n" +
                      chunk(b"IHDR", struct.pack(">IIBBBBB", self.width, self.height, 8, 2, 0, 0,
                                                 0)) +
                      chunk(b"IDAT", zlib.compress(raw)) + chunk(b"IEND", b""))


class Window:
    def __init__(self, display, *arguments):
        self.display = display
        self.record = tempfile.mktemp(suffix=".rec")
        self.process = subprocess.Popen(
            [PROGRAM, "view", *arguments, "--window", "--record", self.record],
            env=display.environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.id = self.xdotool("search", "--sync", "--onlyvisible", "--name", "^sim ").split()[0]
        self.xdotool("windowmove", self.id, "0", "0")
        self.xdotool("windowfocus", self.id)
        place = dict(line.split("=") for line in
                     self.xdotool("getwindowgeometry", "--shell", self.id).split())
        self.x, self.y = int(place["X"]), int(place["Y"])
        self.width, self.height = int(place["WIDTH"]), int(place["HEIGHT"])
        self.until(lambda: self.covered()[0] > 0)

    def xdotool(self, *words):
        return subprocess.run(["xdotool", *words], env=self.display.environment, check=True,
                              capture_output=True, text=True, timeout=60).stdout

    def until(self, true, seconds=60):
        end = time.time() + seconds
        while time.time() < end:
            assert self.process.poll() is None, self.process.stderr.read()
            if found := true():
                return found
            time.sleep(0.05)
        self.display.screenshot("window_test_failed.png")
        raise AssertionError("did not come true; see window_test_failed.png")

    def covered(self):
        """How many pixels are neither sky nor ground nor panel, and one in their midst."""
        found = []
        for y, row in enumerate(self.display.rows()[:self.y + self.height - 130]):
            for x in range(self.x, self.x + self.width - 280):
                blue, green, red = row[4 * x:4 * x + 3]
                if max(blue, green, red) - min(blue, green, red) > 50:
                    found.append((x, y))
        return len(found), found[len(found) // 2] if found else None

    def lines(self):
        """Of the recording, without the numbers of steps."""
        with open(self.record, encoding="ascii") as file:
            return [line.split(" ", 1)[1].strip() for line in file if line.startswith("+")]

    def count(self, word):
        return sum(line.startswith(word) for line in self.lines())

    def said(self, word, count=1):
        self.until(lambda: self.count(word) >= count)

    def still(self):
        """Until two pictures are the same: on a busy machine a key is obeyed late."""
        last = [None]

        def same():
            before, last[0] = last[0], self.covered()
            return before == last[0]

        self.until(same)

    def key(self, name):
        self.xdotool("key", name)

    def mouse(self, x, y):
        self.xdotool("mousemove", str(x), str(y))

    def end(self, key="q", code=0):
        self.key(key)
        assert self.process.wait(30) == code, self.process.stderr.read()
        done, words = replay(PROGRAM, self.record)
        assert done == 0 and "the same bits" in words, words
        os.remove(self.record)


def drag(window, way, hold=None):
    """From the midst of the cloth, which pauses for it; what was grabbed, and where it was left."""
    window.key("space")
    time.sleep(0.3)
    window.still()
    start = window.covered()[1]
    window.mouse(*start)
    grabs = window.count("grab")
    if hold:
        window.xdotool("keydown", hold)
    window.xdotool("mousedown", "1")
    window.said("grab", grabs + 1)
    window.key("space")
    for k in range(1, 13):
        moves = window.count("move")
        window.mouse(start[0] + way[0] * k // 12, start[1] + way[1] * k // 12)
        window.said("move", moves + 1)
    window.xdotool("mouseup", "1")
    if hold:
        window.xdotool("keyup", hold)
    return [line.split()[1] for line in window.lines() if line.startswith("grab")][-1]


def test_touch(display):
    window = Window(display, "scenes/cloth.lua", "-s", "n=16")
    window.until(lambda: window.covered()[0] > 0.02 * window.width * window.height)
    particle = drag(window, (90, -60))
    window.said("release " + particle)
    pinned = drag(window, (-60, -40), "shift")
    window.said("pin " + pinned)
    lines = window.lines()
    moves = [line for line in lines if line.startswith("move " + particle + " ")]
    first, last = ([float(v) for v in moves[k].split()[2:5]] for k in (0, -1))
    # To the right, and up: what the hand says is where the pointer was.
    assert last[0] > first[0] + 0.05 and last[1] > first[1] + 0.03, (first, last)

    # Keys: each changes the picture, and none empties it.
    for key in ("f", "f", "f", "s", "c", "c", "c", "p", "question", "question"):
        window.key(key)
        time.sleep(0.15)
        # White in the middle of a scale is no colour; the springs of what was picked are.
        assert window.covered()[0] > 200, (key, window.covered()[0])
    window.key("bracketright")
    window.said("dt", 1)
    window.key("bracketleft")
    window.said("dt", 2)
    # The buttons of the panel: two of them change the step.

    def pressed():
        for y in range(55, 110, 9):
            for x in range(90, 180, 12):
                window.mouse(window.x + window.width - 264 + x, window.y + y)
                window.xdotool("click", "1")
                if sum(line.startswith("dt") for line in window.lines()) > 2:
                    return True
        return False

    assert window.until(pressed)
    steps = [float(line.split()[1]) for line in window.lines() if line.startswith("dt")]
    assert steps[0] == 2 * steps[1] and steps[2] / steps[1] in (0.5, 2), steps
    if len(sys.argv) > 3:
        window.mouse(400, 300)
        time.sleep(0.5)
        display.screenshot(sys.argv[3])
    window.key("r")
    time.sleep(0.3)
    window.end()


def test_scene_anew(display):
    """A slider begins the scene with another value; a world; and a flag has its wind."""
    window = Window(display, "scenes/flag.lua")
    window.key("w")
    window.said("switch wind off")
    window.end()
    window = Window(display, "scenes/sample.lua")
    for key in ("1", "2", "3", "1", "c"):
        window.key(key)
        time.sleep(0.1)
    window.end()


def test_large(display):
    window = Window(display, "scenes/cloth.lua", "-s", "n=256", "-i", "verlet")
    window.until(lambda: window.covered()[0] > 0.02 * window.width * window.height)
    drag(window, (40, -40))
    window.end()


def test_silhouettes(display):
    """The window draws what the rasteriser draws, in every scene of the project."""
    scripts = os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../scripts/scenes")
    scenes = sorted(os.path.join(scripts, name) for name in os.listdir(scripts))
    done = subprocess.run([os.path.join(os.path.dirname(PROGRAM), "sim_silhouette"), *scenes],
                          env=display.environment, check=False, capture_output=True, text=True,
                          timeout=300)
    assert done.returncode == 0 and done.stdout.count("\n") == len(scenes), done


def test_no_screen():
    environment = {k: v for k, v in os.environ.items()
                   if k not in ("DISPLAY", "WAYLAND_DISPLAY")}
    for name in (None, ":4711"):
        if name:
            environment["DISPLAY"] = name
        done = subprocess.run([PROGRAM, "view", "--window"], env=environment, check=False,
                              capture_output=True, text=True, timeout=60)
        assert done.returncode == 5, done
        assert done.stderr.startswith("sim: error: no window: "), done.stderr
        assert "leave out --window" in done.stderr, done.stderr


def test_old_screen(display):
    """One whose OpenGL is too old, as Mesa says it is when asked to."""
    environment = dict(display.environment, MESA_GL_VERSION_OVERRIDE="2.1")
    done = subprocess.run([PROGRAM, "view", "--window"], env=environment, check=False,
                          capture_output=True, text=True, timeout=60)
    assert done.returncode == 5, done
    assert done.stderr.startswith("sim: error: no window: "), done.stderr
    assert "the screen has no OpenGL 3.3" in done.stderr, done.stderr


if __name__ == "__main__":
    need_view(PROGRAM, "window", "GLFW, libepoxy and Dear ImGui",
              "libglfw3-dev libepoxy-dev libimgui-dev libgl1-mesa-dri")
    for tool, package in (("Xvfb", "xvfb xauth"), ("xdotool", "xdotool")):
        if not shutil.which(tool):
            skip(tool, package)
    test_no_screen()
    screen = Display()
    try:
        for test in (test_old_screen, test_silhouettes, test_touch, test_scene_anew, test_large):
            test(screen)
            print(test.__name__, "ok", flush=True)
    finally:
        screen.close()
