#!/usr/bin/env python3
"""The page with the kernel in it, in a headless browser: opened from a folder it asks nothing of
anybody, steps the scene, obeys hands, gives a recording that the program repeats with the same
bits, edits the scene, and studies it. `page_test.py SIM SIM.MJS [FOLDER]`: with a folder it leaves
pictures there and prints figures."""

import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "view"))
from browser import Browser, find_browser  # noqa: E402
from hostile_scene import write_scene  # noqa: E402
from skip import skip  # noqa: E402

PROGRAM, MODULE = map(os.path.abspath, sys.argv[1:3])
PICTURES = sys.argv[3] if len(sys.argv) > 3 else ""
VIEW = "document.getElementById('scene').contentWindow.sim"


def export(folder, scene, *options):
    file = os.path.join(folder, "page.html")
    subprocess.run([PROGRAM, "export", scene, "--format", "page", file, "-q", *options], check=True)
    return file


def opened(browser, file):
    tab = browser.open("file://" + file)
    tab.until(f"window.document.readyState=='complete'&&{VIEW}&&{VIEW}.drawn>2&&{VIEW}.state")
    return tab


def seen(tab, words):
    return tab.js(f"{VIEW}.{words}")


def check_quiet(tab):
    """No error, nothing refused, and nothing that came from elsewhere."""
    errors = [event for event in tab.errors() if event["method"] == "Runtime.exceptionThrown"
              or event["params"]["entry"]["level"] == "error"]
    assert not errors, errors
    assert tab.js("performance.getEntriesByType('resource').every(e=>/^(blob|data|file):/.test("
                  "e.name))")


def recording(tab):
    """What the button gives to save."""
    tab.js("window.saved='';save=(name,text)=>{saved=text};0")
    tab.js("document.getElementById('record').click()")
    tab.until("saved")
    return tab.js("saved")


def test_hands(browser, folder):
    tab = opened(browser, export(folder, "scenes/cloth.lua", "-s", "n=12"))
    assert seen(tab, "M[0].particles") == 144
    tab.js(f"{VIEW}.say('grab 100')")
    tab.js(f"{VIEW}.say('pull 100 0.3 -0.4 0.5')")
    tab.until(f"{VIEW}.state.systems[0].held.includes(100)")
    step = seen(tab, "state.systems[0].step")
    tab.until(f"{VIEW}.state.systems[0].step>{step}+40")
    for words in ("release 100", "integrator verlet", "dt 0.004", "pin 7"):
        tab.js(f"{VIEW}.say('{words}')")
    tab.until(f"{VIEW}.state.systems[0].method.startsWith('verlet')")
    for words in ("pause", "back 25"):
        tab.js(f"{VIEW}.say('{words}')")
    tab.until(f"{VIEW}.state.systems[0].hash")
    time.sleep(0.3)
    file = os.path.join(folder, "hands.rec")
    with open(file, "w", encoding="utf8") as out:
        out.write(recording(tab))
    done = subprocess.run([PROGRAM, "--replay", file], capture_output=True, text=True,
                          check=False)
    assert done.returncode == 0 and "the same bits" in done.stderr, done.stderr
    assert seen(tab, "state.systems[0].verdict").split(":")[0] in (
        "trusted", "unverified", "suspect", "chaotic")
    check_quiet(tab)
    tab.close()
    print("test_hands ok", flush=True)


def test_parameters(browser, folder):
    tab = opened(browser, export(folder, "scenes/cloth.lua"))
    tab.js(f"{VIEW}.say('set n 10')")
    tab.until(f"{VIEW}&&{VIEW}.M&&{VIEW}.M[0].particles==100&&{VIEW}.drawn>2")
    tab.js(f"{VIEW}.say('set m 10')")
    tab.until(f"{VIEW}.said.includes('unknown parameter')")
    check_quiet(tab)
    tab.close()
    print("test_parameters ok", flush=True)


def test_error(browser, folder):
    """A choice for an error is searched for by a worker of its own, and is that of the program."""
    options = ("scenes/cloth.lua", "-s", "n=5")
    done = subprocess.run([PROGRAM, *options, "--error", "1%", "--json", "-q"], capture_output=True,
                          text=True, check=True)
    choice = json.loads(done.stdout)["systems"][0]["error_goal"]
    tab = opened(browser, export(folder, "scenes/cloth.lua"))
    tab.js(f"{VIEW}.say('set n 5')")
    tab.until(f"{VIEW}&&{VIEW}.M&&{VIEW}.M[0].particles==25&&{VIEW}.drawn>2")
    step = seen(tab, "state.systems[0].step")
    tab.js(f"{VIEW}.say('error 1e-9')")
    tab.until(f"{VIEW}.state.goal.busy")
    tab.js(f"{VIEW}.say('error 1%')")
    tab.until(f"/measured/.test({VIEW}.state.goal.words)")
    now = seen(tab, "state.systems[0]")
    assert now["method"].split(":")[0] == choice["integrator"] and now["h"] == choice["dt"], now
    assert now["step"] > step
    tab.js(f"{VIEW}.say('error 1e-9')")
    tab.until(f"{VIEW}.state.goal.busy")
    tab.js(f"{VIEW}.say('error off')")
    tab.until(f"!{VIEW}.state.goal.busy&&!searching")
    file = os.path.join(folder, "error.rec")
    with open(file, "w", encoding="utf8") as out:
        out.write(recording(tab))
    done = subprocess.run([PROGRAM, "--replay", file], capture_output=True, text=True, check=False)
    assert done.returncode == 0 and "the same bits" in done.stderr, done.stderr
    check_quiet(tab)
    tab.close()
    print("test_error ok", flush=True)


def test_editor(browser, folder):
    """A stranger's text stays text; an error is shown at its line; then the scene goes on."""
    scene = os.path.join(folder, "strange.lua")
    with open(scene, "w", encoding="utf8") as out:
        out.write("-- </script><script>window.pwned=1</script><!-- @SCENE@ ]]>\n"
                  "local sim = require 'sim'\n"
                  "sim.arg('words', '<img src=x onerror=window.pwned=1>', '\"><script>')\n"
                  "return sim.scene { name = 'strange',\n"
                  "  state = { x = { {1, 0, 0} } }, field = sim.field.rotation { omega = 1 },\n"
                  "  integrator = 'rk4', dt = 0.01, duration = 10 }\n")
    tab = opened(browser, export(folder, scene))
    assert tab.js("text.value").startswith("-- </script><script>window.pwned=1</script><!-- @S")
    tab.js("document.getElementById('edit').click()")
    tab.js("text.value=text.value.replace('omega','omga');open_scene()")
    tab.until("document.getElementById('error').textContent.includes('omga')")
    assert tab.js("document.querySelector('#lines .bad').textContent") == "5"
    tab.js("text.value=text.value.replace('omga','omega').replace('0.01','0.02');open_scene()")
    tab.until(f"!document.getElementById('error').textContent&&{VIEW}&&{VIEW}.state&&"
              f"Math.abs({VIEW}.state.systems[0].h-0.02)<1e-9")
    tab.js("text.value+='\\nsim.force.grav';text.focus();"
           "text.setSelectionRange(text.value.length,text.value.length);suggest(true)")
    tab.until("document.querySelector('#names li')&&"
              "document.querySelector('#names li').textContent.startsWith('sim.force.gravity')")
    assert not tab.js("window.pwned||document.getElementById('scene').contentWindow.pwned")
    check_quiet(tab)
    tab.close()
    hostile = write_scene()
    tab = opened(browser, export(folder, hostile))
    time.sleep(0.5)
    assert not tab.js("window.pwned||document.getElementById('scene').contentWindow.pwned")
    assert seen(tab, "state.systems[0].step") > 0
    check_quiet(tab)
    tab.close()
    shutil.rmtree(os.path.dirname(hostile))
    print("test_editor ok", flush=True)


def test_studies(browser, folder):
    tab = opened(browser, export(folder, "scenes/cloth.lua", "-s", "n=4"))
    tab.js("document.getElementById('stability').click()")
    tab.until("document.body.dataset.studied=='stability'", 120)
    assert "verlet" in tab.js("document.getElementById('said').textContent")
    plot = "document.querySelector('#plot img')"
    tab.until(f"{plot}&&{plot}.complete&&{plot}.naturalWidth>100")
    assert tab.js(f"decodeURIComponent({plot}.src).split('<rect').length") > 5
    check_quiet(tab)
    tab.close()
    tab = opened(browser, export(folder, "scenes/circle.lua"))
    tab.js("document.getElementById('tradeoff').click()")
    tab.until("document.body.dataset.studied=='tradeoff'", 200)
    said = tab.js("document.getElementById('said').textContent")
    assert re.search(r"^[* ] rk4 +4/", said, re.MULTILINE), said
    tab.until(f"{plot}&&{plot}.complete&&{plot}.naturalWidth>100")
    assert not tab.js("document.getElementById('tradeoff').disabled")
    check_quiet(tab)
    tab.close()
    # A plot is of one system; a world has the words alone.
    tab = opened(browser, export(folder, "scenes/sample.lua"))
    tab.js("document.getElementById('stability').click()")
    tab.until("document.body.dataset.studied=='stability'", 200)
    said = tab.js("document.getElementById('said').textContent")
    assert said.count("verlet") >= 2, said
    assert not tab.js(f"!!{plot}")
    check_quiet(tab)
    tab.close()
    print("test_studies ok", flush=True)


def pictures(browser, folder):
    """Pictures at three widths, light and dark, and how long the first picture takes."""
    file = export(folder, "scenes/flag.lua")
    for scheme in ("light", "dark"):
        for width, height in ((1280, 800), (768, 1024), (390, 844)):
            tab = browser.open("file://" + file)
            tab.call("Emulation.setDeviceMetricsOverride", width=width, height=height,
                     deviceScaleFactor=1, mobile=width < 500)
            tab.call("Emulation.setEmulatedMedia",
                     features=[{"name": "prefers-color-scheme", "value": scheme}])
            tab.call("Page.reload")
            tab.until(f"window.document.readyState=='complete'&&{VIEW}&&{VIEW}.drawn>2")
            print(width, scheme, "first picture after",
                  round(tab.js("+document.body.dataset.shown")), "ms; exact:",
                  tab.js("document.body.dataset.exact"), flush=True)
            time.sleep(2)
            tab.screenshot(os.path.join(PICTURES, f"page-{width}-{scheme}.png"))
            tab.close()


if __name__ == "__main__":
    if not os.path.exists(MODULE):
        skip("the module that ./dev web builds", "emscripten libc++-16-dev")
    if not find_browser():
        skip("a browser", "chromium-headless-shell")
    chromium = Browser()
    try:
        with tempfile.TemporaryDirectory() as place:
            if PICTURES:
                pictures(chromium, place)
            else:
                for test in (test_hands, test_parameters, test_error, test_editor, test_studies):
                    test(chromium, place)
    finally:
        chromium.close()
