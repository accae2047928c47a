"""Forces of induced strain on bodies: static bends, and the buckling of what is held, against closed forms."""

from __future__ import annotations

import numpy as np
import pytest

from femflex.fem import Member, Support, build_structure
from femflex.fem.sections import Material, Tube, isotropic
from femflex.mesh import line, rectangle
from femflex.reduction import (
    BeamFunctions,
    UniformBeam,
    beam_body,
    cantilever_modes,
    reduce_structure,
    with_attachment,
    with_derivatives,
)
from femflex.reduction.induced_strain import loads_of_induced_strain

METAL = Material(E=70e9, nu=0.3, density=2700)
L, H = 10.0, 0.01


def meshed_boom(strain, ends=("start",), n_modes=2, loads=None):
    structure = build_structure(line([[0, 0, 0], [L, 0, 0]], 16), [Member("line", "beam", TUBE, METAL)])
    modes = cantilever_modes(structure, list(ends), n_modes)
    modes = with_attachment(structure, modes, (), {}, loads_of_induced_strain(structure, "line")[:, loads])
    modes = modes if strain == "linear" else with_derivatives(structure, modes)
    return reduce_structure(structure, modes, {"tip": "end"}, None, strain, None, ["line"], None, ["line"])


TUBE = Tube(outer_radius=0.05, thickness=1e-3)


@pytest.mark.parametrize("direction", [0, 1])
@pytest.mark.parametrize(("strain", "loads"), [("linear", [1, 2]), ("condensed", [1, 2]), ("nonlinear", [0, 1, 2])])
def test_two_modes_and_a_static_shape_bend_as_the_closed_form(strain, loads, direction):
    """A gradient g of strain over the section bends the tip by g L^2 / 2, away from the side that grows; a stretch e
    moves it by e L. Nothing holds them, so that no stress is left, and no stiffness changes but by the coordinates."""
    body = meshed_boom(strain, loads=loads)
    induced, n = body.induced["line"], body.n_modes
    rest = -np.linalg.lstsq(body.strain.V1, induced.f0[:, 1 + direction].sum(axis=0), rcond=None)[0]
    tip = body.markers["tip"].phi[:, :n] @ rest
    assert tip == pytest.approx(-(L**2) / 2 * induced.axes[0, 1 + direction], abs=1e-6 * L**2)
    EI = 70e9 * np.pi / 4 * (0.05**4 - 0.049**4)
    assert induced.stiffness[3, 1:] == pytest.approx([EI, EI], rel=1e-9)
    if strain == "nonlinear":
        stretch = -np.linalg.lstsq(body.strain.V1, induced.f0[:, 0].sum(axis=0), rcond=None)[0]
        assert body.markers["tip"].phi[:, :n] @ stretch == pytest.approx([L, 0, 0], rel=1e-6, abs=1e-6)
        bends = np.ix_(range(4), range(4))  # the stretch of what holds it adds what the strain takes away
        held = induced.V1[:, 0].sum(axis=0)[bends]
        stiffening = (body.strain.tangent(stretch / 1e6) - body.strain.tangent(-stretch / 1e6))[bends] * 1e6 / 2
        assert np.abs(held + stiffening).max() < 1e-3 * np.abs(held).max()
    else:
        assert not induced.V1[:, 0].any()


@pytest.mark.parametrize("strain", ["linear", "condensed"])
def test_beam_between_walls_buckles_at_the_euler_strain(strain):
    """4 pi^2 I / (A L^2) of expansion, for a beam clamped at both ends; admissible functions and a mesh."""
    I, A = np.pi / 4 * (0.05**4 - 0.049**4), np.pi * (0.05**2 - 0.049**2)
    beam = UniformBeam(L, 70e9 * A, 70e9 * I, 70e9 * I, 5e4, 2700 * A, ry=0.035, rz=0.035)
    functions = BeamFunctions(y=8, z=8, axial=2, ends="clamped-clamped")
    bodies = [
        meshed_boom(strain, ("start", "end"), 10, []),
        beam_body(beam, functions, strain=strain, patches=["all"], induced=["all"]),
    ]
    for body in bodies:
        (induced,) = body.induced.values()
        assert buckling_strain(body, induced) == pytest.approx(4 * np.pi**2 * I / (A * L**2), rel=5e-3)


def buckling_strain(body, induced):
    ratios = np.linalg.eigvals(np.linalg.solve(body.strain.V1, induced.V1[:, 0].sum(axis=0))).real
    return -1.0 / ratios.min()


FAMILIES = {"plate_bfs": ("quad", 2e-4), "plate": ("triangle", 2e-2), "shell": ("quad9", 5e-3)}


@pytest.mark.parametrize("family", FAMILIES)
def test_heated_plate_buckles_between_its_edges(family):
    """N = E h e / (1 - nu) from all sides; a simply supported square buckles at 2 pi^2 D / b^2 (Timoshenko)."""
    cell, error = FAMILIES[family]
    structure = build_structure(rectangle(1.0, 1.0, 8, 8, cell), [Member("surface", family, isotropic(H, METAL))])
    edges = {edge: Support(("x", "y", "z")) for edge in ("left", "right", "top", "bottom")}
    modes = cantilever_modes(structure, edges, 4)
    body = reduce_structure(structure, modes, {}, None, "linear", None, ["surface"], None, ["surface"])
    expected = np.pi**2 / 6 * H**2 / (1 + 0.3)
    assert buckling_strain(body, body.induced["surface"]) == pytest.approx(expected, rel=error)
    D = METAL.E * H**3 / 12 / (1 - 0.3**2)
    pair = [2 * METAL.E * H / (1 - 0.3), 2 * D * (1 + 0.3)]
    assert body.induced["surface"].stiffness[0] == pytest.approx(pair, rel=1e-6)
