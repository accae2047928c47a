"""Colours of every family and form of strain against closed forms: cantilevers, stretched sheets, and the ledger."""

from __future__ import annotations

import numpy as np
import pytest
from support.nonlinear_models import bent_beam, folded_plate, plate, solid, tapered_beam

from femflex import System, compile_system, rigid_body, system
from femflex.fem import Material, Member, build_structure
from femflex.fem.sections import Rectangle
from femflex.mesh import box, line, rectangle
from femflex.reduction import (
    BeamFunctions,
    UniformBeam,
    beam_body,
    cantilever_modes,
    reduce_structure,
    with_attachment,
    with_derivatives,
)
from femflex.reduction.beams import strain_points
from femflex.view.paint import BodyPaint, chosen

L, B, H, E = 1.0, 0.1, 0.01, 70e9  # m, m, m, Pa; without Poisson's ratio strips bend as beams do
EI, EA = E * B * H**3 / 12, E * B * H
STUFF = Material(E, 0.0, 2700.0)
FORMS = ("linear", "nonlinear", "condensed")
STRIPS = {
    "beam": lambda: (
        line([[0, 0, 0], [L, 0, 0]], 8),
        Member("line", "beam", Rectangle(B, H), STUFF, {"orientation": (0, 1, 0)}),
        ("start", "end"),
    ),
    "plate": lambda: (rectangle(L, B, 20, 2), Member("surface", "plate", H, STUFF), ("left", "right")),
    "bfs": lambda: (rectangle(L, B, 10, 2, "quad"), Member("surface", "plate_bfs", H, STUFF), ("left", "right")),
    "solid": lambda: (
        box(L, B, H, 20, 2, 1, "hexahedron27"),
        Member("volume", "solid", None, STUFF),
        ("left", "right"),
    ),
}


def under_load(family: str, strain: str, direction: str, force: float):
    """A cantilever under a small force at its end along x, y or z, and its coordinates."""
    mesh, member, (root, end) = STRIPS[family]()
    structure = build_structure(mesh, [member])
    modes = with_attachment(structure, cantilever_modes(structure, [root], 1), [], {end: [direction]})
    if strain != "linear":
        modes = with_derivatives(structure, modes)
    body = reduce_structure(structure, modes, {"tip": end}, strain=strain)
    load = body.markers["tip"].phi[:, : body.n_modes]["xyz".index(direction)] * force
    return body, np.linalg.solve(body.strain.V1, load)


def painted(body, colour: str, delta):
    """Values at the points of the skin."""
    quantity = chosen(colour, list(body.strain_field), "the body")
    return BodyPaint.of(quantity, body.strain_field, body.skin).values(body.amplitudes(delta))


@pytest.mark.sampled(4)
@pytest.mark.parametrize("strain", FORMS)
@pytest.mark.parametrize("family", STRIPS)
def test_the_bending_strain_of_a_cantilever_is_that_of_its_moment(family: str, strain: str):
    """kappa = F (L - x) / EI; in a solid the strain of its surface is kappa h / 2, though no point of it lies there."""
    F = 0.01  # so little that bending stretches nothing
    body, delta = under_load(family, strain, "z", F)
    x, z = body.skin.points[:, 0], body.skin.points[:, 2]
    if family == "solid":
        outside = np.minimum(np.abs(z), np.abs(z - H)) < 1e-9
        x = x[outside]
        found = painted(body, "strain:xx", delta)[outside] / (H / 2 - z[outside])
        wanted = F * (L - x) / EI
    else:
        wanted = F * (L - x) / EI
        name = {"beam": "curvature_y", "plate": "curvature_xx", "bfs": "curvature_xx"}[family]
        found = painted(body, f"strain:{name}", delta)
        found = found * np.sign(np.sum(found * wanted))  # of a section's and of a normal's turn
    off = {"solid": 0.026, "plate": 0.012}.get(
        family, 2e-3
    )  # what elements lose at an end: of solids half of one of 20
    assert found == pytest.approx(wanted, abs=off * F * L / EI)
    assert found[np.abs(x) < 1e-9].mean() == pytest.approx(F * L / EI, rel=0.026 if family == "solid" else 2.5e-3)


@pytest.mark.sampled(4)
@pytest.mark.parametrize("strain", FORMS)
@pytest.mark.parametrize("family", STRIPS)
def test_a_pull_stretches_all_of_it_alike(family: str, strain: str):
    F = 1e3
    body, delta = under_load(family, strain, "x", F)
    name = {"beam": "axial", "solid": "xx"}.get(family, "membrane_xx")
    inside = np.abs(body.skin.points[:, 0] - L / 2) < L / 4  # the pull is not spread evenly over the end itself
    assert painted(body, f"strain:{name}", delta)[inside] == pytest.approx(F / EA, rel=2e-3)
    measure = {"beam": 1.0, "solid": B * H}.get(family, B)
    assert painted(body, "energy", delta)[inside] == pytest.approx(F**2 / EA / 2 / measure, rel=4e-3)


MODELS = {
    "beam": bent_beam,
    "tapered": tapered_beam,
    "plate": plate,
    "shell": folded_plate,
    "bfs": lambda: build_structure(
        rectangle(1.2, 0.9, 6, 6, "quad"), [Member("surface", "plate_bfs", 0.01, Material(E, 0.3, 2700.0))]
    ),
    "solid": solid,
}
LARGE = {"linear": 0.03, "nonlinear": 0.03, "condensed": 0.0075}  # of the size: condensed energy lacks the fifth order


def ledger(body, delta):
    """Strain energy of a body at its coordinates, as runs report it."""
    held = (system.weld("hub"), system.weld("body", "hub"))
    model = compile_system(System({"hub": rigid_body(1.0, np.eye(3)), "body": body}, held))
    return float(model.observe(np.zeros(1), np.concatenate([delta, 0 * delta])[None])["monitors/elastic"][0])


@pytest.mark.sampled(6)
@pytest.mark.parametrize("strain", FORMS)
@pytest.mark.parametrize("family", MODELS)
def test_energy_density_integrates_to_the_energy_of_the_ledger(family: str, strain: str):
    structure = MODELS[family]()
    clamp = next(name for name in ("start", "left", "root") if name in structure.mesh.groups)
    modes = cantilever_modes(structure, [clamp], 3)
    if strain != "linear":
        modes = with_derivatives(structure, modes)
    body = reduce_structure(structure, modes, strain=strain)
    first = np.linalg.norm((structure.translation @ modes.phi[:, 0]).reshape(-1, 3), axis=1).max()
    size = float(np.linalg.norm(np.ptp(structure.mesh.points, axis=0)))
    delta = np.zeros(body.n_modes)
    delta[:3] = LARGE[strain] * size / first * np.array([1.0, 0.2, -0.1])
    y = body.amplitudes(delta)
    found = sum(float(part.energy(y)[0] @ part.weight) for part in body.strain_field)
    assert found == pytest.approx(ledger(body, delta), rel=2e-3)


@pytest.mark.parametrize("strain", FORMS)
def test_energy_density_of_functions_integrates_to_the_energy_of_the_ledger(strain: str):
    functions = BeamFunctions(y=3, z=2, axial=0 if strain == "condensed" else 6)
    body = beam_body(UniformBeam(1.0, EA, EI, 2 * EI, EI, 1.2), functions, strain=strain)
    delta = np.zeros(body.n_modes)
    delta[:2] = 0.05, 0.02
    found = sum(float(part.energy(body.amplitudes(delta))[0] @ part.weight) for part in body.strain_field)
    assert found == pytest.approx(ledger(body, delta), rel=1e-5)


@pytest.mark.parametrize("strain", FORMS)
def test_a_large_single_layer_of_solids_keeps_its_bending(monkeypatch, strain: str):
    """With too many points to keep each, a mean over elements would lose all bending of a single layer."""
    monkeypatch.setattr(strain_points, "MOST_POINTS", 10)
    body, delta = under_load("solid", strain, "z", 1.0)
    (part,) = body.strain_field
    assert part.per == 2 and len(part.places) == 80
    found = float(part.energy(body.amplitudes(delta))[0] @ part.weight)
    assert found == pytest.approx(body.strain.energy(delta), rel=0.01)
    x, z = body.skin.points[:, 0], body.skin.points[:, 2]
    top = np.abs(z - H) < 1e-9
    values = painted(body, "strain:xx", delta)[top]
    assert values == pytest.approx(-(L - x[top]) / EI * H / 2, abs=0.06 * L / EI * H / 2)  # half an element off
