#!/usr/bin/env python3
"""The site of the documents: whole, with every link inside it, and asking nothing of anybody; its
scenes run in a browser where ./dev web has built the kernel. `site_test.py BIN SOURCE`"""

import html.parser
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import urllib.parse

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "view"))
from browser import Browser, find_browser  # noqa: E402
from skip import skip  # noqa: E402

BIN, SOURCE = map(os.path.abspath, sys.argv[1:3])
SCENES = sorted(each.stem for each in pathlib.Path(SOURCE, "scripts/scenes").glob("*.lua"))
LOADS = {"img": "src", "script": "src", "iframe": "src", "link": "href", "source": "src"}


class Links(html.parser.HTMLParser):
    """Where a page points to, and what it loads by itself."""

    def __init__(self, page):
        super().__init__()
        self.targets, self.loaded = [], []
        self.feed(page.read_text(encoding="utf-8"))

    def handle_starttag(self, tag, attributes):
        for name, value in attributes:
            if name in ("href", "src") and value:
                self.targets.append(value)
                if LOADS.get(tag) == name:
                    self.loaded.append(value)


def test_links(site):
    pages = [page for page in site.rglob("*.html") if page.parent.name != "live"]
    assert len(pages) > 20
    for page in pages:
        links = Links(page)
        for target in links.loaded:
            assert not re.match(r"[a-z]+:|//", target) or target.startswith("data:"), (page, target)
        for target in links.targets:
            parts = urllib.parse.urlsplit(target)
            if not parts.scheme and parts.path:
                file = page.parent / urllib.parse.unquote(parts.path)
                assert file.exists(), (page, target)
    for style in site.rglob("*.css"):
        text = re.sub(r"/\*.*?\*/", "", style.read_text(), flags=re.DOTALL)
        assert not re.search(r"url\([\"']?(https?:|/)", text), style
    assert not re.search(r"^import ", (site / "_static/scripts/furo.js").read_text(), re.MULTILINE)
    print("test_links ok:", len(pages), "pages")


def test_gallery(site, live):
    page = (site / "gallery.html").read_text(encoding="utf-8")
    for name in SCENES:
        assert f"<b>{name}</b>" in page, name
        assert (site / f"_static/gallery/{name}.png").stat().st_size > 1000, name
        assert (f'href="live/index.html?scene={name}"' in page) == live, name
    lab = (site / "lab.html").read_text(encoding="utf-8")
    assert lab.count('<details class="live">') == (3 if live else 0)
    for text in (page, lab):  # words of code are in tags of their own
        assert ("./dev web" in re.sub(r"<[^>]*>", "", text)) == (not live)
    print("test_gallery ok:", len(SCENES), "scenes", "that run" if live else "")


def test_lab(site):
    """Opened from a folder: the scenes of an experiment load when they are opened, Euler flies off
    and RK4 holds, as the verdicts beside them say."""
    browser = Browser()
    try:
        tab = browser.open(f"file://{site}/lab.html")
        tab.until("document.readyState=='complete'&&document.querySelectorAll('details.live').length==3")
        assert not tab.js("performance.getEntriesByType('resource').some(e=>/kernel/.test(e.name))")
        tab.js("(d=>{d.open=true;d.scrollIntoView();0})(document.querySelectorAll('details.live')[2])")
        addresses = [f"{site}/live/index.html?scene=cloth&integrator=euler",
                     f"{site}/live/index.html?scene=cloth"]
        frames = "[...document.querySelectorAll('details.live')[2].querySelectorAll('iframe')]"
        assert tab.js(f"{frames}.map(f=>f.src).join(' ')") == " ".join(
            f"file://{each}" for each in addresses)
        for address, integrator, words in zip(addresses, ("euler", "rk4"),
                                              ("diverged", "trusted|unverified")):
            scene = browser.open("file://" + address)
            view = "document.getElementById('scene').contentWindow"
            scene.until(f"document.readyState=='complete'&&{view}&&{view}.sim&&{view}.sim.drawn>2")
            scene.until(f"/^({words})/m.test({view}.document.body.innerText)", 120)
            assert scene.js(f"{view}.document.querySelector('select').value") == integrator
            assert scene.js("performance.getEntriesByType('resource').every(e=>/^(blob|data|file):/"
                            ".test(e.name))")
            assert "grid" in scene.js("document.getElementById('text').value")
            scene.close()
        scene = browser.open(f"file://{site}/live/index.html?scene=no%0Aset%20n=2")
        scene.until("document.body&&document.body.dataset.error")
        scene.close()
    finally:
        browser.close()
    print("test_lab ok")


if __name__ == "__main__":
    if not shutil.which("sphinx-build"):
        skip("Sphinx", "python3-sphinx furo python3-myst-parser")
    with tempfile.TemporaryDirectory() as folder:
        built = subprocess.run([os.path.join(SOURCE, "docs/build.sh"), BIN, folder],
                               capture_output=True, text=True, check=False)
        assert built.returncode == 0, built.stderr[-3000:]
        site, live = pathlib.Path(folder, "html"), os.path.isdir(f"{SOURCE}/build/web/site")
        test_links(site)
        test_gallery(site, live)
        if live and find_browser():
            test_lab(site)
        else:
            print("test_lab skipped: needs ./dev web and a browser (Debian: chromium-headless-shell)")
