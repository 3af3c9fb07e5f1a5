"""PySPH: a dam that breaks, as scenes/dam.lua has it, weakly compressible, in one thread.

pysph_dam.py DIMENSIONS SPACING WIDTH HEIGHT DEPTH LENGTH SOUND STEP LAYERS      m, m/s, s
Then "run N" on its input takes N steps, and answers with the seconds that they took; "front" with
the largest x of the water. Its first line says what it is and how many particles are water, walls.
"""
import os
import shutil
import sys
import tempfile
import time

answers = os.fdopen(os.dup(1), "w")
os.dup2(2, 1)  # what it prints itself

import numpy as np  # noqa: E402
import pysph  # noqa: E402
from pysph.base.kernels import WendlandQuintic  # noqa: E402
from pysph.base.utils import get_particle_array  # noqa: E402
from pysph.solver.application import Application  # noqa: E402
from pysph.sph.integrator import PECIntegrator  # noqa: E402
from pysph.sph.scheme import WCSPHScheme  # noqa: E402

DENSITY = 1000
HDX = 1.5  # smoothing length, in spacings
dimensions, layers = int(sys.argv[1]), int(sys.argv[9])
a, width, height, depth, length, sound, step = map(float, sys.argv[2:9])


def answer(text):
    answers.write(f"{text}\n")
    answers.flush()


def lattice(low, high):
    """Cell centres of the box from low to high, counted in cells."""
    axes = [a * (np.arange(l, h) + 0.5) for l, h in zip(low, high)]
    return [axis.ravel() for axis in np.meshgrid(*axes, indexing="ij")]


class Dam(Application):
    def create_scheme(self):
        return WCSPHScheme(["fluid"], ["boundary"], dim=dimensions, rho0=DENSITY, c0=sound,
                           h0=HDX * a, hdx=HDX, gy=-9.81, alpha=0.05, beta=0.0, gamma=7.0)

    def configure_scheme(self):
        self.scheme.configure_solver(kernel=WendlandQuintic(dim=dimensions),
                                     integrator_cls=PECIntegrator, adaptive_timestep=False,
                                     dt=step, tf=1e9, pfreq=10**9)

    def create_particles(self):
        cells = [round(extent / a) for extent in (width, height, depth)]
        # The room is as high as the water gets until it has reached the other wall.
        room = [round(length / a), cells[1] + cells[1] // 4, cells[2]]
        if dimensions == 2:
            cells, room = cells[:2], room[:2]
        water = lattice([0] * dimensions, cells)
        walls = lattice([-layers] * dimensions,
                        [room[0] + layers, room[1]] + [n + layers for n in room[2:]])
        inside = np.logical_and.reduce(
            [(x > 0) & (x < a * n) if k != 1 else x > 0 for k, (x, n) in enumerate(zip(walls, room))])
        walls = [x[~inside] for x in walls]
        arrays = []
        for name, x in (("fluid", water), ("boundary", walls)):
            more = {} if dimensions == 2 else {"z": x[2]}
            arrays.append(get_particle_array(name=name, x=x[0], y=x[1], m=DENSITY * a**dimensions,
                                             rho=float(DENSITY), h=HDX * a, **more))
        self.scheme.setup_properties(arrays)
        self.water = arrays[0]
        answer(f"PySPH {pysph.__version__}, WCSPH, predict-evaluate-correct|"
               f"{len(water[0])} {len(walls[0])}")
        return arrays

    def serve(self):
        """Reads commands until one asks for steps."""
        for line in sys.stdin:
            if line.startswith("run "):
                self.left, self.start = int(line[4:]), time.perf_counter()
                return
            answer(repr(float(self.water.x.max())))
        shutil.rmtree(self.output_dir, ignore_errors=True)
        os._exit(0)

    def pre_step(self, solver):
        if not hasattr(self, "left"):
            self.serve()

    def post_step(self, solver):
        self.left -= 1
        if self.left == 0:
            answer(repr(time.perf_counter() - self.start))
            self.serve()


app = Dam(output_dir=tempfile.mkdtemp())
app.run(["--disable-output", "--max-steps", str(10**9)])
