#!/usr/bin/env python3
"""live.py SIM SCENES PAGES SITE MODULE: what of the site computes.

Writes the gallery, PAGES/gallery.md, with a picture of each scene of the folder SCENES. Puts scenes
that run in the place of comments of the pages, `<!-- live: NAME WORD=VALUE .. | NAME .. -->`; the
words are those of a recording's header. SITE/live/ gets the module of ./dev web from the folder
MODULE; where that is not there, pages say how to get it.
"""
import html
import json
import pathlib
import re
import shutil
import subprocess
import sys
import urllib.parse

SIM, SCENES, PAGES, SITE, MODULE = sys.argv[1], *map(pathlib.Path, sys.argv[2:6])
STEPS = "200"
ABSENT = """```{note}
Scenes run on this page where the site is built with the kernel as WebAssembly: `./dev web`, then
`./dev docs`. Without it, the commands do the same, and `sim view SCENE` shows it in real time.
```"""
has_module = MODULE.is_dir()


def address(words):
    """Of the live page: 'circle integrator=euler set=n=4' has that scene, method and parameter."""
    scene, *more = words.split()
    pairs = [("scene", scene)] + [tuple(word.split("=", 1)) for word in more]
    return "live/index.html?" + urllib.parse.urlencode(pairs)


def title(words):
    scene, *more = words.split()
    values = [word.split("=", 1) for word in more]
    said = [value if name in ("set", "integrator") else f"{name} = {value} s"
            for name, value in values]
    return ", ".join([scene, *said])


def live(match):
    """The frames load when the reader opens them."""
    scenes = [words.strip() for words in match[1].split("|")]
    frames = "\n".join(
        f'<iframe loading="lazy" title="{html.escape(title(words))}" '
        f'src="{html.escape(address(words))}"></iframe>' for words in scenes)
    names = " | ".join(title(words) for words in scenes)
    return (f'<details class="live"><summary>Run it here: {html.escape(names)}</summary>\n'
            f'<div>\n{frames}\n</div></details>')


def put_scenes_into(page):
    text = page.read_text()
    if "<!-- live: " not in text:
        return
    pattern = re.compile(r"<!-- live: (.+?) -->")
    if has_module:
        text = pattern.sub(live, text)
    else:
        text = pattern.sub(lambda match: "", pattern.sub(lambda match: ABSENT, text, count=1))
    page.write_text(text)


def purpose(scene):
    """The first sentence of the comment that a scene begins with."""
    comment = []
    for line in scene.read_text().splitlines():
        if not line.startswith("--"):
            break
        comment.append(line.lstrip("- "))
    text = re.sub(r"^\w+\.lua: *", "", " ".join(comment))
    while (shorter := re.sub(r" \([^()]*\)", "", text)) != text:
        text = shorter
    sentence = re.split(r"(?<=[a-z0-9])[.:;] ", text)[0]
    return sentence[:1].upper() + sentence[1:].rstrip(".")


def card(scene):
    name, picture = scene.stem, PAGES / "_static/gallery" / f"{scene.stem}.png"
    subprocess.run([SIM, f"scenes/{scene.name}", "--steps", STEPS, "--no-verify", "--quiet", "--out",
                    str(picture), "--size", "400x250"], capture_output=True, check=False)
    shown = (f'<img loading="lazy" width="400" height="250" alt="" '
             f'src="_static/gallery/{name}.png">' if picture.exists() else "")
    words = f"{shown}<b>{name}</b> <span>{html.escape(purpose(scene))}</span>"
    return f'<a href="{address(name)}">{words}</a>' if has_module else f"<div>{words}</div>"


def gallery():
    (PAGES / "_static/gallery").mkdir(parents=True)
    scenes = sorted(SCENES.glob("*.lua"))
    lead = ("One click runs a scene: in this browser, with the bits of the program, and without "
            "anything sent or asked for." if has_module else ABSENT)
    cards = "\n".join(card(scene) for scene in scenes)
    (PAGES / "gallery.md").write_text(
        f"# Gallery\n\nThese {len(scenes)} scenes come with `sim`; `sim SCENE` runs one, `sim view "
        f"SCENE` lets you touch it.\n\n{lead}\n\n<div class=\"gallery\">\n{cards}\n</div>\n")


def copy_module():
    shutil.copytree(MODULE, SITE / "live")
    texts = {scene.stem: scene.read_text() for scene in sorted(SCENES.glob("*.lua"))}
    (SITE / "live/scenes.js").write_text(f"const SIM_SCENES = {json.dumps(texts)};\n")


if __name__ == "__main__":
    gallery()
    for each in sorted(PAGES.glob("*.md")):
        put_scenes_into(each)
    if has_module:
        copy_module()
