"""Strips, beams and frames bent far: the elastica and Kirchhoff's rod."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy import linalg
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from support.full_solution import FullModel, static_path
from support.kirchhoff import tip_of_rod

from femflex import fem, reduction
from femflex.body.symmetric import unpacked
from femflex.fem import Material, Member, build_structure
from femflex.fem.sections import Rectangle
from femflex.mesh import line, rectangle
from femflex.reduction import (
    BeamFunctions,
    UniformBeam,
    beam_body,
    cantilever_modes,
    reduce_structure,
    strain_tensors,
    with_attachment,
    with_derivatives,
)
from femflex.reduction.boundary.rigid import held_dofs

# a strip's bending in its own plane, which nothing excites here, is warned of
pytestmark = pytest.mark.filterwarnings("ignore:plates turn in their own planes")
STRIP = Material(70e9, 0.0, 2700.0)


def elastica(load, arc=0.0):
    """Displacement (inward, up) over length of the tip of an inextensible cantilever under a dead load P L^2 / EI.

    The load stands across the root; arc: the angle by which the unloaded cantilever turns, evenly.
    """

    def bent(start):
        def derivative(s, y):
            return [arc + y[1], -load * np.cos(y[0]), np.cos(y[0]), np.sin(y[0])]

        return solve_ivp(derivative, (0, 1), [0, start, 0, 0], rtol=1e-10, atol=1e-12).y

    end = bent(brentq(lambda start: bent(start)[1, -1], -2.0, 2.0))[2:, -1]
    inward, down = np.array([np.sinc(arc / np.pi), arc / 2 * np.sinc(arc / 2 / np.pi) ** 2]) - end
    return inward, -down


def bent_tip(body, force):
    """Displacement (3,) of the marker "tip" of a body under a force (3,) there, by Newton's method."""
    marker, delta = body.markers["tip"], np.zeros(body.n_modes)
    for share in np.linspace(0.1, 1.0, 10):
        for _ in range(30):
            left = body.strain.force(delta) - share * force @ marker.phi[:, : body.n_modes]
            delta -= np.linalg.solve(body.strain.tangent(delta), left)
    return marker.phi @ body.amplitudes(delta)


def bent_strip(family, count, slenderness, load):
    """Displacement (inward, up) over length of the tip of a condensed cantilever under P L^2 / EI = load at its tip."""
    length = 10.0
    mesh = rectangle(length, 1.0, count, max(1, count // 10), "quad" if family == "plate_bfs" else "triangle")
    thickness = length / slenderness
    structure = build_structure(mesh, [Member("surface", family, thickness, STRIP)])
    modes = with_derivatives(structure, cantilever_modes(structure, ["left"], 8), "all")
    body = reduce_structure(structure, modes, {"tip": "right"}, strain="condensed")
    tip = bent_tip(body, np.array([0, 0, load * STRIP.E * thickness**3 / 12 / length**2]))
    return -tip[0] / length, tip[2] / length


@pytest.mark.sampled(1)
@pytest.mark.parametrize(
    ("family", "count", "slenderness", "bounds"),
    [
        *(("plate_bfs", 10, slenderness, (2e-4, 1.2e-3)) for slenderness in (100, 1000, 5000)),
        ("plate", 20, 100, (2e-4, 1.2e-3)),
        ("plate", 20, 1000, (1.5e-3, 3e-3)),
        ("plate", 40, 5000, (3e-3, 6e-3)),
    ],
)
def test_thin_strips_match_elastica(family, count, slenderness, bounds):
    """To 10 and 16 % of the length. With curvature linear in the deflection they would go 1 and 3 % too far.

    Squares of slopes taken at points exact for them leave 16 % (20 triangles along) and 51 % (10 rectangles) at a
    slenderness of 5000, where sampled triangles still lock: by 3 % with 20, 0.2 % with 40 at a tenth of the length.
    The tip draws in by int w'^2 / 2, which lacks w'^4 / 8.
    """
    for load, bound in zip((0.3, 0.5), bounds, strict=True):
        exact, found = elastica(load), bent_strip(family, count, slenderness, load)
        assert found[1] == pytest.approx(exact[1], rel=bound)
        assert found[0] == pytest.approx(exact[0], rel=0.5 * exact[1] ** 2 + 4 * bound)


@pytest.mark.sampled(1)
@pytest.mark.parametrize("load", [0.15, -0.15])
def test_faceted_arc_matches_elastica(load):
    """One radian of a circle, all finite elements; with curvature linear in the deflection 0.13 to 0.2 % off."""
    thickness, width = 0.01, 0.1
    mesh = rectangle(1.0, width, 20, 2, "triangle")
    s, y, _ = mesh.points.T
    mesh = replace(mesh, points=np.stack([np.sin(s), y, 1 - np.cos(s)], axis=1))
    structure = build_structure(mesh, [Member("surface", "plate", thickness, STRIP)])
    full = FullModel(structure, held_dofs(structure, ["left"]))
    end = mesh.group_points("right")
    share = np.where(np.abs(mesh.points[end, 1] - width / 2) < 1e-9, 0.5, 0.25)
    push = load * STRIP.E * width * thickness**3 / 12
    force = (structure.translation[3 * end + 2].T @ (share * push))[full.free]
    moved = (structure.translation @ full.on_all_dofs(static_path(full, force, np.linspace(0.1, 1, 10))[-1])).reshape(
        -1, 3
    )
    exact = elastica(load, 1.0)
    assert share @ moved[end, 2] == pytest.approx(exact[1], rel=6e-4)
    assert -share @ moved[end, 0] == pytest.approx(exact[0], rel=6e-4)


LENGTH, EI, EA = 10.0, 1.4e4, 2.8e8


def meshed(EIy, GJ, strain="condensed"):
    """A condensed body whose section lies along y and z; EIz = EI."""
    section = fem.sections.StiffnessSection(EA, EIy, EI, GJ, 1.2, ry=0.01, rz=0.01)
    member = fem.Member("line", "beam", section, None, {"orientation": (0, 1, 0)})
    structure = fem.build_structure(line([[0, 0, 0], [LENGTH, 0, 0]], 8), [member])
    shapes = reduction.cantilever_modes(structure, "start", 8)
    shapes = reduction.with_attachment(structure, shapes, [], {"end": ["y", "z"]})
    shapes = reduction.with_derivatives(structure, shapes, "all")
    return reduction.reduce_structure(structure, shapes, {"tip": "end"}, strain=strain)


def on_functions(EIy, GJ, strain="condensed"):
    beam = UniformBeam(LENGTH, EA, EIy, EI, GJ, 1.2, ry=0.01, rz=0.01, orientation=(0, 1, 0))
    axial = 12 if strain == "nonlinear" else 0
    return beam_body(beam, BeamFunctions(y=4, z=4, axial=axial, torsion=4, family="polynomial"), strain=strain)


def skew(size, EIy):
    """A force (3,) that would bend the beam by so much of its length at 45 degrees, by linear theory."""
    return np.array([0.0, EI, EIy]) * 3 * size / LENGTH**2 / np.sqrt(2)


@pytest.mark.sampled(1)
@pytest.mark.parametrize(
    ("build", "strain"),
    [
        (meshed, "condensed"),
        pytest.param(meshed, "nonlinear", marks=pytest.mark.slow),
        (on_functions, "condensed"),
        (on_functions, "nonlinear"),
    ],
)
def test_round_beam_deflects_equally_in_all_directions(build, strain):
    body, size = build(EI, 0.8 * EI, strain), 0.2
    straight, askew = (bent_tip(body, force) for force in (np.array([0, 0, 3 * EI * size / LENGTH**2]), skew(size, EI)))
    assert straight[2] > 0.19 * LENGTH
    assert askew == pytest.approx([straight[0], *np.full(2, straight[2] / np.sqrt(2))], rel=1e-7)


@pytest.mark.sampled(1)
@pytest.mark.parametrize("build", [meshed, on_functions])
@pytest.mark.parametrize(
    ("ratio", "GJ"), [(1, 0.8), (4, 0.8), pytest.param(4, 1.5, marks=pytest.mark.slow), (0.3, 0.5)]
)
def test_obliquely_bent_beam_matches_kirchhoff_rod(build, ratio, GJ):
    """Uneven ones leave the plane of the load's linear answer; what is left falls at least as the square of the size.

    Curvature of second order alone was 7e-3 off at a fifth of the length.
    """
    body, apart = build(ratio * EI, GJ * EI), []
    for size in (0.1, 0.2):
        exact = tip_of_rod(LENGTH, GJ * EI, ratio * EI, EI, skew(size, ratio * EI))[0]
        apart.append(np.linalg.norm(bent_tip(body, skew(size, ratio * EI)) - exact) / np.linalg.norm(exact))
    assert apart[0] < 5e-4 and apart[1] < 4e-3


@pytest.mark.parametrize("bounded_energy", [None, True])
def test_a_right_angled_frame_of_four_modes_and_the_loads_shape(bounded_energy):
    """1.088 and -0.680 N (Argyris and others 1979), by the tangent V1 + 6 V2.x of the reduced energy."""
    mesh = line([[0, 0, 0], [0.24, 0, 0], [0.24, -0.24, 0]], 6)
    options = {"orientation": [0, 0, 1.0], "bounded_energy": bounded_energy}
    strip = Member("line", "beam", Rectangle(0.0006, 0.03), Material(71.24e9, 0.31, 2700.0), options)
    structure = build_structure(mesh, [strip])
    modes = with_attachment(structure, cantilever_modes(structure, "start", 4), (), {"end": ["x"]})
    modes = with_derivatives(structure, modes, "auto")
    tensors = strain_tensors(structure, modes.phi)
    push = (structure.translation[[3 * mesh.group_points("end")[0]]] @ modes.phi)[0]
    bend = np.linalg.solve(tensors.V1, push)
    softened = -6 * np.einsum("ijk,k->ij", unpacked(tensors.V2, modes.n_modes, 3), bend)
    factors = 1 / linalg.eigvalsh(softened, tensors.V1)[[-1, 0]]
    assert factors == pytest.approx([1.088, -0.680], rel=6e-3)
