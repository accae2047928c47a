"""Loads spread over lines, surfaces and masses, against closed forms, the elastica, and weight of the environment."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import cumulative_simpson, solve_ivp

from femflex import System, equilibrium, fem, rigid_body, simulate
from femflex.effectors import DistributedLoad, Signal
from femflex.mesh import Mesh, box, line, rectangle
from femflex.reduction import (
    BeamFunctions,
    UniformBeam,
    beam_body,
    cantilever_modes,
    free_free_modes,
    reduce_structure,
    with_derivatives,
)
from femflex.system import Environment, free, weld, with_effectors

L, B, H = 2.0, 0.1, 0.02  # m
SOFT = fem.Material(2e9, 0.0, 1000.0)
EI = SOFT.E * B * H**3 / 12
FAMILIES = {
    "beam": ("beam", "line", "line", fem.sections.Rectangle(B, H)),
    "plate": ("plate", "triangle", "surface", H),
    "shell": ("shell", "quad", "surface", H),
    "shell of second order": ("shell", "quad9", "surface", H),
    "solid": ("solid", "hexahedron20", "volume", None),
    "solid of tetrahedra": ("solid", "tetra10", "volume", None),
}


def strip(name: str, n: int = 16, modes: int = 6, strain: str = "linear"):
    """A cantilever along x; its load is spread over the whole, or over the upper face of solids."""
    family, cell, group, section = FAMILIES[name]
    if family == "solid":
        mesh, top = box(L, B, H, 2 * n, 1, 1, cell), "top"
    else:
        mesh, top = (line([[0, 0, 0], [L, 0, 0]], n), "all") if cell == "line" else (rectangle(L, B, n, 1, cell), "all")
    root, tip = ("start", "end") if cell == "line" else ("left", "right")
    structure = fem.build_structure(mesh, [fem.Member(group, family, section, SOFT)])
    shapes = cantilever_modes(structure, [root], modes)
    shapes = shapes if strain == "linear" else with_derivatives(structure, shapes)
    body = reduce_structure(structure, shapes, {"tip": tip, "root": root}, strain=strain, patches=[top])
    return body, {"group": top}


def analytic(modes: int = 6, strain: str = "linear"):
    beam = UniformBeam(L, SOFT.E * B * H, EI, 25 * EI, EI, SOFT.density * B * H)
    return beam_body(beam, BeamFunctions(z=modes), strain=strain, patches=["all"]), {"group": "all"}


def clamped(body, **loads) -> System:
    return with_effectors(System({"strip": body}, [weld("strip", child_marker="root")]), loads)


def tip_at_rest(system: System) -> np.ndarray:
    found = equilibrium(system)
    assert found.share == 1.0
    return found.model.observe(np.zeros(1), found.x[None])["markers/strip.tip/deflection"][0]


@pytest.mark.parametrize("name", [*FAMILIES, "analytic"])
def test_even_load_bends_a_cantilever_by_the_closed_form(name):
    """w = q L^4 / 8 EI, for a load that keeps its direction, and for one that follows."""
    body, where = analytic() if name == "analytic" else strip(name)
    q = 8 * EI * 0.01 * L / L**4  # 1 % of the length
    if name in ("beam", "analytic"):
        kinds = [{"force_per_length": (0, 0, q)}, {"force_per_length": (0, 0, q), "frame": "local"}]
    else:
        kinds = [{"force_per_area": (0, 0, q / B)}, {"pressure": -q / B if "solid" in name else q / B}]
    for kind in kinds:
        tip = tip_at_rest(clamped(body, q=DistributedLoad(body="strip", **where, **kind)))
        assert tip[2] == pytest.approx(0.01 * L, rel=8e-3 if "solid" in name else 2e-3)


def follower_elastica(load: float) -> np.ndarray:
    """Tip (x, z) / L of an inextensible cantilever under q normal to it everywhere, load = q L^3 / EI.

    From the tip, where moment, shear Q and normal force N vanish: theta' = kappa, kappa' = -Q, Q' = -N kappa - load,
    N' = Q kappa. The curve is turned afterwards such that its root lies along x.
    """

    def slope(_, y):
        theta, kappa, Q, N = y[:4]
        return [kappa, -Q, -N * kappa - load, Q * kappa, np.cos(theta), np.sin(theta)]

    root = solve_ivp(slope, (1, 0), np.zeros(6), rtol=1e-11, atol=1e-12).y[:, -1]
    c, s = np.cos(root[0]), np.sin(root[0])
    return np.array([[c, s], [-s, c]]) @ -root[4:]


@pytest.mark.parametrize("name", ["beam", "analytic", "shell of second order"])
def test_follower_pressure_matches_elastica(name):
    body, where = analytic(4, "condensed") if name == "analytic" else strip(name, 8, 4, "condensed")
    load = 1.2
    q = load * EI / L**3
    kind = {"force_per_length": (0, 0, q), "frame": "local"} if name in ("beam", "analytic") else {"pressure": q / B}
    tip = tip_at_rest(clamped(body, q=DistributedLoad(body="strip", **where, **kind)))
    x, z = follower_elastica(load)
    assert tip[2] / L == pytest.approx(z, rel=2e-3)  # 15 % of the length
    assert tip[0] / L == pytest.approx(x - 1, rel=0.015)  # of third order in the deflection, which strain leaves out


def test_force_per_mass_is_a_weight():
    """A boom on a free hub falls and swings as in the uniform gravity of its environment."""
    body, _ = strip("beam", 4, 4)
    hub = rigid_body(1.0, np.full(3, 0.1))
    joints = [free("hub", u0=[0, 0.3, 0, 0, 0, 0]), weld("strip", "hub", child_marker="root")]
    craft = System({"hub": hub, "strip": body}, joints)
    g = (0.0, -0.4, -1.2)
    pull = {"b": "strip", "h": "hub"}
    pulled = {key: DistributedLoad(body=name, force_per_mass=g, frame="inertial") for key, name in pull.items()}
    weighed, loaded = (
        simulate(system, 3.0, rtol=1e-10)
        for system in (replace(craft, environment=Environment(np.array(g))), with_effectors(craft, pulled))
    )
    np.testing.assert_allclose(loaded.motion.states, weighed.motion.states, rtol=1e-6, atol=1e-8)


@pytest.mark.parametrize("side", [None, (0.0, 0.0, 1.0)])
def test_pressure_pushes_a_free_plate(side):
    """A plate of mixed orders of nodes needs a side; its momentum is the impulse of the pressure."""
    mesh = rectangle(L, B, 4, 1, "quad")
    cells = mesh.cells["quad"].copy()
    if side:
        cells[::2] = cells[::2, ::-1]
    mesh = Mesh(mesh.points, {"quad": cells}, {"surface": {"quad": np.arange(4)}})
    structure = fem.build_structure(mesh, [fem.Member("surface", "shell", H, SOFT)])
    body = reduce_structure(structure, free_free_modes(structure, 3), patches=["surface"])
    load = DistributedLoad(body="plate", group="surface", pressure=3.0, side=side, level="ramp.value")
    ramp = Signal(times=(0.0, 2.0), values=(0.0, 1.0))
    run = simulate(with_effectors(System({"plate": body}, [free("plate")]), {"push": load, "ramp": ramp}), 2.0)
    assert run["effectors/push/force_z"][-1] == pytest.approx(3.0 * L * B)
    np.testing.assert_allclose(run["monitors/momentum"][-1], [0, 0, 3.0 * L * B], rtol=1e-6, atol=1e-9)


def test_pressure_on_all_faces_of_a_solid_has_no_resultant():
    mesh = box(L, B, H, 3, 2, 2, "tetra10")
    faces = np.concatenate([mesh.cell_groups[g]["triangle6"] for g in mesh.cell_groups if g != "volume"])
    mesh = mesh.with_groups(cells={"hull": {"triangle6": faces}})
    structure = fem.build_structure(mesh, [fem.Member("volume", "solid", None, SOFT)])
    body = reduce_structure(structure, cantilever_modes(structure, ["left"], 3), patches=["hull", "top"])
    hull, top = body.patches["hull"], body.patches["top"]
    np.testing.assert_allclose(hull.normal.sum(axis=0), 0.0, atol=1e-12)
    np.testing.assert_allclose(top.normal.sum(axis=0), [0, 0, L * B], atol=1e-12)
    assert hull.size.sum() == pytest.approx(2 * (L * B + L * H + B * H))
    volume = sum(body.markers[f".hull.{k}"].position @ normal for k, normal in enumerate(hull.normal)) / 3
    assert volume == pytest.approx(L * B * H, rel=1e-9)


def test_pressure_balances_the_energies():
    """Work of a follower against kinetic and elastic energy, of a strip that is pushed round."""
    body, where = strip("plate", 4, 4)
    joints = [free("strip", u0=[0, 0, 0, 0.2, 0.5, 0.1])]
    push = DistributedLoad(body="strip", **where, pressure=20.0)
    run = simulate(with_effectors(System({"strip": body}, joints), {"p": push}), 1.0, rtol=1e-10)
    work = cumulative_simpson(run["monitors/supplied"], x=run.times, initial=0.0)
    gained = run["monitors/energy"] - run["monitors/energy"][0]
    assert np.abs(work).max() > 0.04
    np.testing.assert_allclose(gained, work, atol=1e-6 * np.abs(work).max())
