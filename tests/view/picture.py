#!/usr/bin/env python3
"""The picture of the page in README.md: `picture.py SIM FILE.png`. A flag that a hand pulls."""

import sys
import time

from browser import Browser, find_browser
from live_client import Server

if not find_browser():
    print("picture.py: no browser, no picture of the page")
    sys.exit(0)
browser = Browser()
try:
    with Server(sys.argv[1], "scenes/cloth.lua", "-s", "n=32") as server:
        tab = browser.open(server.address)
        tab.until("window.sim&&sim.drawn>2&&sim.state&&sim.state.systems[0].t>0.9")
        x, y = tab.js("sim.pixel(sim.M[0],880)")
        tab.mouse("mousePressed", x, y)
        for k in range(40):
            tab.mouse("mouseMoved", x - 2 * k, y - 3 * k)
            time.sleep(0.02)
        time.sleep(0.6)
        tab.screenshot(sys.argv[2])
        server.stop()
finally:
    browser.close()
