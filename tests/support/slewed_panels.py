"""The craft of cases/panel_slew_hard.toml by other means: all finite elements, solids, chains of beams."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.interpolate import CubicSpline

from femflex import fem, reduction, system
from femflex.assembly import build_mesh, build_structure_of
from femflex.body import Marker, rigid_body
from femflex.case import read_case
from femflex.dynamics import compile_system
from femflex.integrate import integrator
from femflex.mesh import box, line
from support.full_slew import Hub, Slewed

CASE = Path(__file__).parents[2] / "cases" / "panel_slew_hard.toml"
ROOT = 0.6  # of the panel from the hub's middle [m]
LENGTH, WIDTH = 6.0, 1.5  # of the panel [m]
FIRST = 3.658308  # first frequency of the clamped panel [rad/s], femflex modes


def torque(t):
    """300 N m for 5 s, then -300 N m."""
    return 300.0 if t < 5.0 else -300.0 if t < 10.0 else 0.0


HUB = Hub(170.0, 2, torque, (5.0, 10.0))


def plates(refine=0):
    """Structure of the case's own triangles, where they are on the craft."""
    case = read_case(CASE)
    table = case.bodies["panel_east"]
    mesh = build_mesh(case, "panel_east", table, refine)
    return build_structure_of(case, "panel_east", table, replace(mesh, points=mesh.points + np.array([ROOT, 0.0, 0.0])))


def solids(along, across, stiffer=1.0):
    """One layer of 27-node bricks that stretches, bends and weighs as the sandwich: faces of t at +- h / 2.

    Alike in stretch and bending is a plate of thickness sqrt(3 h^2 + t^2) and modulus 2 E t over that; shear of the
    core shifts the first frequency by less than 1e-4. stiffer: factor on the modulus.
    """
    t, h, E = 0.2e-3, 20.2e-3, 70e9 * stiffer
    thickness = np.sqrt(3 * h**2 + t**2)
    mass = 0.9 + 2 * t * 1400.0 + 0.02 * 32.0
    mesh = box(LENGTH, WIDTH, thickness, along, across, 1, "hexahedron27")
    mesh = replace(mesh, points=mesh.points + np.array([ROOT, -WIDTH / 2, -thickness / 2]))
    material = fem.Material(2 * E * t / thickness, 0.3, mass / thickness)
    return fem.build_structure(mesh, [fem.Member("volume", "solid", None, material)])


def corner(structure, clamp, times, h):
    """Displacement (n_t, 3) of the corner (x = 6, y = 0.75) of all finite elements, and the error of momentum.

    Extrapolated from steps h and h / 2, whose error falls as the square.
    """
    slewed = Slewed(structure, clamp, (0.0, 1.0, 0.0), HUB, ratio=0.005)
    node = structure.mesh.nearest_point([ROOT + LENGTH, WIDTH / 2, 0.0])
    rows, found = structure.translation[3 * node + np.arange(3)][:, slewed.free], []
    for step in (h, h / 2):
        t, moved, _, momentum = slewed.motion(rows, times[-1], step)
        given = np.where(t < 5.0, 300.0 * t, 3000.0 - 300.0 * t)
        error = np.abs(momentum - given).max()
        found.append(CubicSpline(t, moved)(times))
    return found[1] + (found[1] - found[0]) / 3, error


def beams(kind, times, segments=16):
    """Deflection (n_t, 3) of the tip of panels that are beams of the same first frequency, undamped.

    kind: "segments", "meshed" or "analytic", condensed both.
    """
    mass = (0.9 + 0.4e-3 * 1400.0 + 0.02 * 32.0) * WIDTH
    r, EI = 0.0101, FIRST**2 * mass * LENGTH**4 / 3.5160152685**2
    section = fem.sections.StiffnessSection(EI / r**2, EI, EI, EI, mass, ry=r, rz=r)
    ends, member = {"root": "start", "tip": "end"}, [fem.Member("line", "beam", section)]
    if kind == "segments":
        mesh = line([[0, 0, 0], [LENGTH, 0, 0]], 4 * segments)
        pieces = fem.cut_into_segments(mesh, member, segments, start="start")
        body = system.Segments(reduction.reduce_segments(pieces, ends, reduction.chord_modes))
    elif kind == "meshed":
        structure = fem.build_structure(line([[0, 0, 0], [LENGTH, 0, 0]], 8), member)
        modes = reduction.with_derivatives(structure, reduction.cantilever_modes(structure, "start", 12))
        body = reduction.reduce_structure(structure, modes, ends, strain="condensed")
    else:
        beam = reduction.UniformBeam(LENGTH, EI / r**2, EI, EI, EI, mass, r, r)
        body = reduction.beam_body(beam, reduction.BeamFunctions(z=6), strain="condensed")
    west = np.array([[-1.0, 0, 0], [0, -1.0, 0], [0, 0, 1.0]])
    places = {
        "east": Marker.at_position(np.array([ROOT, 0, 0])),
        "west": Marker.at_position(np.array([-ROOT, 0, 0])).with_orientation(west),
    }
    hub = rigid_body(400.0, np.diag([150.0, 170.0, 180.0]), markers=places)
    joints = [system.free("hub")]
    joints += [system.weld(way, "hub", parent_marker=way, child_marker="root") for way in ("east", "west")]
    push = np.array([[0, 300.0, 0], [0, 300.0, 0], [0, -300.0, 0], [0, -300.0, 0]])
    load = system.Load("slew", "hub", torque=push, times=np.array([0.0, 5.0, 5.0, 10.0]))
    model = compile_system(system.assembled({"hub": hub, "east": body, "west": body}, joints, [load]))
    method, rtol = ("esdirk4", 1e-7) if kind == "segments" else ("dop853", 1e-8)
    states = integrator(method, rtol=rtol, atol=rtol).solve(model, times, model.x0).states
    return model.observe(times, states)["markers/east.tip/deflection"]
