"""Drives a headless Chromium over its debugging pipe: no package is needed. Only what a test of the
page asks for."""

import base64
import json
import os
import shutil
import subprocess
import tempfile
import time


def find_browser():
    for name in ("chromium-headless-shell", "chromium", "chromium-browser", "google-chrome"):
        if path := shutil.which(name):
            return path
    return None


class Browser:
    def __init__(self):
        to_browser, self.out = os.pipe()
        self.inp, from_browser = os.pipe()

        def pipes():  # the browser reads 3 and writes 4
            os.dup2(to_browser, 13)
            os.dup2(from_browser, 14)
            os.dup2(13, 3)
            os.dup2(14, 4)

        self.folder = tempfile.mkdtemp()
        self.process = subprocess.Popen(
            [find_browser(), "--headless", "--remote-debugging-pipe", "--no-sandbox",
             "--disable-backgrounding-occluded-windows", "--disable-renderer-backgrounding",
             "--user-data-dir=" + self.folder, "about:blank"],
            preexec_fn=pipes, close_fds=False, stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL)
        os.close(to_browser)
        os.close(from_browser)
        self.buffer, self.last, self.events = b"", 0, []

    def close(self):
        self.process.kill()
        self.process.wait()
        shutil.rmtree(self.folder, ignore_errors=True)

    def _read(self):
        while b"\0" not in self.buffer:
            more = os.read(self.inp, 1 << 20)
            if not more:
                raise RuntimeError("the browser has gone")
            self.buffer += more
        one, self.buffer = self.buffer.split(b"\0", 1)
        return json.loads(one)

    def call(self, method, session=None, **parameters):
        self.last += 1
        message = {"id": self.last, "method": method, "params": parameters}
        if session:
            message["sessionId"] = session
        os.write(self.out, json.dumps(message).encode() + b"\0")
        while True:
            answer = self._read()
            if answer.get("id") == self.last:
                if "error" in answer:
                    gone = "navigated" in answer["error"].get("message", "")
                    raise (Navigated if gone else RuntimeError)(
                        method + ": " + str(answer["error"]))
                return answer["result"]
            self.events.append(answer)

    def open(self, address):
        return Tab(self, address)


class Navigated(RuntimeError):
    """The page loaded anew while it was asked."""


class Tab:
    def __init__(self, browser, address):
        self.browser = browser
        # A window of its own: a tab behind another is not drawn.
        self.target = browser.call("Target.createTarget", url="about:blank",
                                   newWindow=True)["targetId"]
        self.session = browser.call("Target.attachToTarget", targetId=self.target,
                                    flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log"):
            self.call(domain + ".enable")
        # The size of the page itself; of that of a window, bars may take a part.
        self.call("Emulation.setDeviceMetricsOverride", width=960, height=640,
                  deviceScaleFactor=1, mobile=False)
        self.call("Page.navigate", url=address)

    def call(self, method, **parameters):
        return self.browser.call(method, self.session, **parameters)

    def close(self):
        self.browser.call("Target.closeTarget", targetId=self.target)

    def js(self, code):
        result = self.call("Runtime.evaluate", expression=code, returnByValue=True,
                           awaitPromise=True)
        if "exceptionDetails" in result:
            raise RuntimeError(code + ": " + json.dumps(result["exceptionDetails"])[:600])
        return result["result"].get("value")

    def until(self, code, seconds=60):
        end = time.time() + seconds
        while time.time() < end:
            try:
                if self.js(code):
                    return
            except Navigated:
                pass  # the new page is asked
            time.sleep(0.03)
        raise AssertionError("did not come true: " + code)

    def errors(self):
        """Exceptions and messages of the console."""
        self.js("1")
        return [event for event in self.browser.events
                if event["method"] in ("Runtime.exceptionThrown", "Log.entryAdded")
                and event.get("sessionId") == self.session]

    def mouse(self, kind, x, y, modifiers=0, buttons=1):
        self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left",
                  buttons=buttons, clickCount=1, modifiers=modifiers)

    def key(self, key):
        for kind in ("keyDown", "keyUp"):
            self.call("Input.dispatchKeyEvent", type=kind, key=key,
                      text=key if len(key) == 1 and kind == "keyDown" else "")

    def screenshot(self, file):
        data = self.call("Page.captureScreenshot", format="png")["data"]
        with open(file, "wb") as out:
            out.write(base64.b64decode(data))
