"""Static stretch of condensed bodies at markers: by spin, by an accelerated base, by weight."""

from __future__ import annotations

import numpy as np
import pytest
from support.spin_up import KANE

from femflex import fem
from femflex.body import Marker, rigid_body
from femflex.dynamics import compile_system
from femflex.mesh import line
from femflex.reduction import (
    BeamFunctions,
    UniformBeam,
    beam_body,
    cantilever_modes,
    reduce_structure,
    with_derivatives,
)
from femflex.system import Environment, Profile, System, prismatic, revolute, weld

RADIUS, SPEED, G = 1.5, 3.0, 9.81


def meshed(direction=(1.0, 0, 0), modes=4):
    end = KANE.length * np.asarray(direction) / np.linalg.norm(direction)
    structure = fem.build_structure(line([[0, 0, 0], end.tolist()], 8), [fem.Member("line", "beam", KANE.section)])
    shapes = with_derivatives(structure, cantilever_modes(structure, "start", modes))
    return reduce_structure(structure, shapes, {"root": "start", "tip": "end"}, strain="condensed")


def twisting(torsion):
    """On functions, its sections with shapes of their own that follow."""
    flat = UniformBeam(KANE.length, KANE.EA, KANE.EI, 2 * KANE.EI, KANE.EI, KANE.mass, 0.02, 0.03)
    return beam_body(flat, BeamFunctions(y=3, z=2, torsion=torsion), strain="condensed")


BODIES = {"meshed": meshed, "analytic": lambda: KANE.body("condensed", y=3), "turning": lambda: twisting(1)}


def marker_channel(system, key, t=0.0):
    model = compile_system(system)
    return model.observe(np.array([t]), model.x0[None])[f"markers/beam.tip/{key}"][0]


@pytest.mark.parametrize("strain", ["meshed", "one"])
def test_spun_beam_has_static_stretch(strain):
    times = np.linspace(0.0, 18.0, 181)
    tip = KANE.meshed("condensed", 2, times=times) if strain == "meshed" else KANE.single_body("condensed", times, y=2)
    assert tip[times > 15.5, 0].mean() == pytest.approx(KANE.stretch, rel=3e-3)


@pytest.mark.parametrize("name", BODIES)
def test_static_stretch_includes_hub_radius(name):
    """m Om^2 (L^3 / 3 + R L^2 / 2) / EA."""
    body = BODIES[name]()
    hub = rigid_body(10.0, np.eye(3), markers={"rim": Marker.at_position(np.array([RADIUS, 0, 0]))})
    turn = revolute("hub", axis=(0, 0, 1), motion=(Profile(np.zeros(1), np.array([[0.0, SPEED]])),))
    system = System({"hub": hub, "beam": body}, (turn, weld("beam", "hub", parent_marker="rim", child_marker="root")))
    L = KANE.length
    exact = KANE.mass * SPEED**2 * (L**3 / 3 + RADIUS * L**2 / 2) / KANE.EA
    assert marker_channel(system, "deflection")[0] == pytest.approx(exact, rel=2e-3)


@pytest.mark.parametrize("direction", [(0, 0, -1.0), (0, 0.6, -0.8)])
def test_hanging_beam_stretches_by_its_weight(direction):
    """m g L^2 / 2 EA along the beam, of the part of gravity along it; also read back from a file."""
    d = np.asarray(direction)
    system = System({"beam": meshed(d)}, (weld("beam", child_marker="root"),), environment=Environment((0, 0, -G)))
    assert marker_channel(system, "deflection") @ d == pytest.approx(
        -d[2] * KANE.mass * G * KANE.length**2 / 2 / KANE.EA, rel=1e-3
    )


def test_free_fall_has_no_static_stretch():
    slide = prismatic("beam", axis=(0, 0, 1), child_marker="root")
    system = System({"beam": meshed((0, 0, -1.0))}, (slide,), environment=Environment((0, 0, -G)))
    assert np.abs(marker_channel(system, "deflection")).max() < 1e-10
