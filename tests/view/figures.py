#!/usr/bin/env python3
"""Figures of the live view, for tests/bench/RESULTS.md: pictures a second, bytes, how long a start and
a touch take. `figures.py SIM`"""

import os
import statistics
import sys
import time

from live_client import Server, Socket

PROGRAM = sys.argv[1]


def cpu(process):
    """Seconds of the processor so far."""
    with open("/proc/%d/stat" % process.pid, encoding="ascii") as file:
        fields = file.read().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def figures(n, method):
    begin = time.time()
    with Server(PROGRAM, "scenes/cloth.lua", "-s", "n=%d" % n, "-i", method) as server:
        started = time.time() - begin
        page = Socket(server)
        page.until(lambda s: True)
        first = time.time() - begin
        for _ in range(30):
            page.receive()
        begin, used, frames, bytes_ = time.time(), cpu(server.process), 0, 0
        while time.time() - begin < 6:
            frames += "systems" in page.receive()
            bytes_ = page.bytes_of_points
        seconds = time.time() - begin
        used = cpu(server.process) - used
        touches = []
        for k in range(30):
            begin, pinned = time.time(), n * n // 2 + k
            page.say("pin %d" % pinned)
            page.until(lambda s, p=pinned: p in s["systems"][0]["pinned"])
            touches.append(1000 * (time.time() - begin))
            time.sleep(0.02)
        print("| %d x %d, `%s` | %.0f | %.1f / %.1f ms | %.2f | %.0f %% | %.2f | %.2f / %.2f s |" % (
            n, n, method, frames / seconds, statistics.median(touches),
            statistics.quantiles(touches, n=10)[-1], bytes_ / (n * n), 100 * used / seconds,
            page.state["real"], started, first))
        page.close()
        server.stop()


print("load", os.getloadavg()[0])
print("| cloth | pictures/s | touch to picture, median / 90 % | bytes a particle | processor | of real "
      "time | address, first picture after |\n|---|---|---|---|---|---|---|")
for size, name in ((64, "rk4"), (64, "verlet"), (256, "verlet")):
    figures(size, name)
