"""A scene of a stranger: all that it may say is a script, a tag or a placeholder."""

import json
import os
import tempfile

# Each would set window.pwned where a page takes it for anything but text.
TEXTS = ("</script><script>window.pwned=1</script>", "<img src=x onerror=window.pwned=1>",
         "\" onmouseover=window.pwned=1 x=\"", "' autofocus onfocus=window.pwned=1 x='",
         "<!--<script>", "@SOCKET@ @HEAD@ @DATA@ @LIVE@ text=DATA H=HEAD /*LIVE*/",
         "\\u003cscript\\u003e${window.pwned=1}`")


def write_scene():
    """The file of such a scene, in a folder of its own."""
    text = json.dumps(" ".join(TEXTS), ensure_ascii=False)
    file = os.path.join(tempfile.mkdtemp(prefix="sim_hostile_"), "hostile.lua")
    with open(file, "w", encoding="utf-8") as out:
        out.write(f"""local sim = require "sim"
local text = {text}
sim.arg("words", text, text)
local p = sim.grid {{ 4, 4, origin = {{0,0,0}}, du = {{0,0,0.1}}, dv = {{0.1,0,0}}, mass = 0.1 }}
p:pin(p:id(0, 0))
return sim.scene {{ name = "hostile", particles = p, integrator = "rk4", dt = 0.001, duration = 0.1,
  forces = {{ sim.force.gravity {{ g = {{0, -9.81, 0}} }},
    sim.force.spring {{ family = text, stiffness = 50, grid = p, offsets = {{ {{0,1}}, {{1,0}} }} }} }} }}
""")
    return file
