"""A laboratory for mass-spring and particle simulation, from Python.

    import sim
    s = sim.load("scenes/cloth.lua", n=32)
    s.step(100); s.run(2.0)
    s.x, s.v, s.t, s.energy, s.hash, s.verdict

Units are SI: m, s, kg, N, J. Everything that fails raises sim.Error, with what, where, why and
remedy. docs/python.md has examples.
"""

try:
    import numpy  # noqa: F401
except ImportError as missing:
    raise ImportError("sim needs numpy; Debian: apt-get install python3-numpy") from missing

from ._library import Error, lib as _lib
from ._scene import (Energy, Field, Scene, Snapshot, Spring, StaleView, System, Verdict, View,
                     field, import_scene, load, recorded, resume, scene)
from ._study import (Result, compare, minimal, order, plugins, rest, scenes, stability, study,
                     sweep, tradeoff)

__version__ = _lib.sim_version().decode()

__all__ = ["Energy", "Error", "Field", "Result", "Scene", "Snapshot", "Spring", "StaleView",
           "System", "Verdict", "View", "compare", "field", "import_scene", "load", "minimal",
           "order", "plugins", "recorded", "rest", "resume", "scene", "scenes", "stability",
           "study", "sweep", "tradeoff"]
