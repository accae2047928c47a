"""The deflection that the advice foretells before a run is the one that the run then finds, on hinges and in spins."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from femflex.advice.deflections import farthest_places
from femflex.advice.motion_estimate import estimate_motion
from femflex.advice.strain import motion_extents
from femflex.case import read_case
from femflex.pipeline import run
from femflex.pipeline.decisions import decided

MESHES = Path(__file__).parents[2] / "meshes"
HINGED = """
title = "plate on a hinge"
[run]
duration = "{duration} s"
samples = 401
[materials.metal]
E = "70 GPa"
nu = 0.3
density = "2700 kg/m^3"
[sections.skin]
kind = "plate"
thickness = "4 mm"
[bodies.plate]
kind = "flexible"
mesh = "{mesh}"
members = [{{ group = "panel", family = "plate", section = "skin", material = "metal" }}]
reduction = {{ method = "cantilever", clamp = "root", modes = 4 }}
markers.tip = {{ group = "tip" }}
[[joints]]
kind = "revolute"
child = "plate"
child_marker = "root"
axis = [0, 1, 0]
name = "hinge"
stiffness = "{stiffness} N m/rad"
[[loads]]
name = "push"
body = "plate"
marker = "tip"
force = [[0, 0, 0], [0, 0, {force}], [0, 0, {force}], [0, 0, 0]]
times = [0, 0.1, {hold}, {end}]
"""
SPUN = """
title = "beam turned about an inclined axis"
[run]
duration = "20 s"
samples = 401
[bodies.beam]
kind = "analytic"
length = "10 m"
EA = "2.8e7 N"
EIy = "14000 N m^2"
EIz = "14000 N m^2"
GJ = "12000 N m^2"
mass_per_length = "1.2 kg/m"
ry = "22.36 mm"
rz = "22.36 mm"
radius = "50 mm"
functions = {{ y = 4, z = 4, axial = 3, family = "polynomial" }}
[[joints]]
kind = "revolute"
child = "beam"
child_marker = "root"
axis = [{x}, 0, {z}]
name = "hub"
motion.angle = {{ kind = "table", file = "angle.csv", column = "angle", degree = 5 }}
"""


def bends(path: Path, body: str) -> tuple[float, float]:
    """Deflection of a body that is estimated from its linear model before a run, and the largest of the run [m]."""
    linear = path.with_name("linear.toml")
    linear.write_text(path.read_text().replace(f"[bodies.{body}]\n", f'[bodies.{body}]\nstrain = "linear"\n'))
    found = decided(read_case(linear))
    extent = motion_extents(estimate_motion(found.system, found.case.run.duration), found.known)[body]
    deflection = run(read_case(path), path.with_suffix(".h5"))[f"markers/{body}.tip/deflection"]
    return extent.bent * extent.size, float(np.linalg.norm(deflection, axis=1).max())


@pytest.mark.sampled(1)
@pytest.mark.parametrize(
    ("stiffness", "force", "hold", "duration"), [(0, 1, 0.9, 5), (5, 1, 3.9, 8), (1000, 3, 3.9, 8)]
)
def test_of_a_plate_on_a_hinge(
    write_case: Callable[..., Path], stiffness: float, force: float, hold: float, duration: float
):
    """A free hinge lets the plate turn away under the load: it bends by a small part of what a clamp would make it."""
    text = HINGED.format(
        mesh=MESHES / "wing_panel.msh", stiffness=stiffness, force=force, hold=hold, end=hold + 0.1, duration=duration
    )
    estimated, reached = bends(write_case(text), "plate")
    assert estimated == pytest.approx(reached, rel=0.05)


@pytest.mark.slow
@pytest.mark.sampled(1)
@pytest.mark.parametrize(("inclination", "rate"), [(10, 2), (30, 2), (20, 3)])
def test_of_a_beam_spun_up_about_an_inclined_axis(write_case: Callable[..., Path], inclination: float, rate: float):
    """The pull of the spin holds the beam straight while it bends out of the plane that is normal to the axis."""
    a, t = math.radians(inclination), np.linspace(0.0, 20.0, 401)
    smooth = t**2 / 2 + (15 / (2 * math.pi)) ** 2 * (np.cos(2 * math.pi * t / 15) - 1)
    angle = rate / 15 * np.where(t < 15, smooth, 15 * (t - 7.5))
    path = write_case(SPUN.format(x=math.sin(a), z=math.cos(a)))
    rows = "\n".join(f"{ti:.10g},{ai:.15g}" for ti, ai in zip(t, angle, strict=True))
    (path.parent / "angle.csv").write_text(f"time [s],angle [rad]\n{rows}\n")
    estimated, reached = bends(path, "beam")
    assert estimated == pytest.approx(reached, rel=0.05)


@pytest.mark.parametrize("seed", range(4))
def test_few_places_show_how_far_all_of_them_move(seed: int):
    """Smooth shapes of which one is local: the places chosen hold the farthest point of random mixtures to 4 %."""
    rng = np.random.default_rng(seed)
    x, y = np.meshgrid(np.linspace(0, 2, 160), np.linspace(0, 1, 80))
    waves = [np.sin(rng.uniform(0.5, 5) * x + rng.uniform(0, 3)) * np.cos(rng.uniform(0, 5) * y) for _ in range(5)]
    local = np.exp(-(((x - rng.uniform(0, 2)) / 0.05) ** 2) - ((y - rng.uniform(0, 1)) / 0.05) ** 2)
    shapes = np.stack([wave.ravel()[:, None] * rng.standard_normal(3) for wave in (*waves, local)])
    few = farthest_places(shapes)
    assert few.shape[1] < 0.08 * shapes.shape[1]
    for amplitudes in rng.standard_normal((50, 6)):
        seen, there = (np.linalg.norm(np.einsum("spa,s->pa", one, amplitudes), axis=1).max() for one in (few, shapes))
        assert 0.96 * there < seen <= there * (1 + 1e-12)
    np.testing.assert_array_equal(farthest_places(shapes[:, :800]), shapes[:, :800])
