"""Colours of strain and energy: cantilevers and stretched sheets in closed form, and energies by integration."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from PIL import Image
from support.nonlinear_models import bent_beam, folded_plate, plate, solid, tapered_beam

from femflex import System, compile_system, rigid_body, system
from femflex.body.strain_field import NAMES, StrainPart
from femflex.fem import Material, Member, build_structure
from femflex.fem.sections import Rectangle, Tube
from femflex.mesh import Mesh, box, line, rectangle
from femflex.reduction import (
    BeamFunctions,
    UniformBeam,
    beam_body,
    cantilever_modes,
    reduce_structure,
    with_attachment,
    with_derivatives,
)
from femflex.results import RunWriter, open_run
from femflex.view import mode_montage, render_movie, render_picture
from femflex.view.look import Look
from femflex.view.paint import BodyPaint, quantity_of_colour
from femflex.view.plan import plan_scene

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
    quantity = quantity_of_colour(colour, list(body.strain_field), "the body")
    return BodyPaint.from_field(quantity, body.strain_field, body.skin).values(body.amplitudes(delta))


@pytest.mark.sampled(3)
@pytest.mark.parametrize("strain", FORMS)
@pytest.mark.parametrize("family", STRIPS)
def test_bending_strain_of_a_cantilever(family: str, strain: str):
    """kappa = F (L - x) / EI; in a solid the strain of its surface is kappa h / 2, though no point of it lies there."""
    F = 0.01  # so little that bending stretches nothing
    body, delta = under_load(family, strain, "z", F)
    x, z = body.skin.points[:, 0], body.skin.points[:, 2]
    if family == "solid":
        outside = np.minimum(np.abs(z), np.abs(z - H)) < 1e-9
        x = x[outside]
        curvature = painted(body, "strain:xx", delta)[outside] / (H / 2 - z[outside])
        expected = F * (L - x) / EI
    else:
        expected = F * (L - x) / EI
        name = {"beam": "curvature_y", "plate": "curvature_xx", "bfs": "curvature_xx"}[family]
        curvature = painted(body, f"strain:{name}", delta)
        curvature = curvature * np.sign(np.sum(curvature * expected))  # of a section's and of a normal's turn
    tolerance = {"solid": 0.026, "plate": 0.012}.get(
        family, 2e-3
    )  # what elements lose at an end: of solids half of one of 20
    assert curvature == pytest.approx(expected, abs=tolerance * F * L / EI)
    assert curvature[np.abs(x) < 1e-9].mean() == pytest.approx(F * L / EI, rel=0.026 if family == "solid" else 2.5e-3)


@pytest.mark.sampled(3)
@pytest.mark.parametrize("strain", FORMS)
@pytest.mark.parametrize("family", STRIPS)
def test_axial_strain_and_energy_of_a_stretched_strip(family: str, strain: str):
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


def elastic_energy(body, delta):
    """Strain energy of a body at its coordinates, as runs report it."""
    joints = (system.weld("hub"), system.weld("body", "hub"))
    model = compile_system(System({"hub": rigid_body(1.0, np.eye(3)), "body": body}, joints))
    return float(model.observe(np.zeros(1), np.concatenate([delta, 0 * delta])[None])["monitors/elastic"][0])


@pytest.mark.sampled(3)
@pytest.mark.parametrize("strain", FORMS)
@pytest.mark.parametrize("family", MODELS)
def test_energy_density_integrates_to_the_elastic_energy(family: str, strain: str):
    structure = MODELS[family]()
    clamp = next(name for name in ("start", "left", "root") if name in structure.mesh.groups)
    modes = cantilever_modes(structure, [clamp], 3)
    if strain != "linear":
        modes = with_derivatives(structure, modes)
    body = reduce_structure(structure, modes, strain=strain)
    first_amplitude = np.linalg.norm((structure.translation @ modes.phi[:, 0]).reshape(-1, 3), axis=1).max()
    size = float(np.linalg.norm(np.ptp(structure.mesh.points, axis=0)))
    delta = np.zeros(body.n_modes)
    delta[:3] = LARGE[strain] * size / first_amplitude * np.array([1.0, 0.2, -0.1])
    y = body.amplitudes(delta)
    energy = sum(float(part.energy(y)[0] @ part.weight) for part in body.strain_field)
    assert energy == pytest.approx(elastic_energy(body, delta), rel=2e-3)


@pytest.mark.parametrize("strain", FORMS)
def test_energy_density_of_functions_integrates_to_the_elastic_energy(strain: str):
    functions = BeamFunctions(y=3, z=2, axial=0 if strain == "condensed" else 6)
    body = beam_body(UniformBeam(1.0, EA, EI, 2 * EI, EI, 1.2), functions, strain=strain)
    delta = np.zeros(body.n_modes)
    delta[:2] = 0.05, 0.02
    energy = sum(float(part.energy(body.amplitudes(delta))[0] @ part.weight) for part in body.strain_field)
    assert energy == pytest.approx(elastic_energy(body, delta), rel=1e-5)


METAL = Material(7e10, 0.3, 2700.0)
SMALL = {"size": (320, 180), "samples": 1}


def beam_on_functions():
    beam = UniformBeam(4.0, 7e6, 400.0, 400.0, 300.0, 1.2, ry=0.01, rz=0.01, radius=0.05)
    return beam_body(beam, BeamFunctions(y=2, z=1), strain="condensed")


def plate_and_beam():
    """Two kinds of members on one body: a plate, and a tube half a metre beside it."""
    plate, tube = rectangle(1.0, 0.5, 4, 2, "triangle"), line([[0, -0.5, 0], [1.0, -0.5, 0]], 4)
    points = np.concatenate([plate.points, tube.points])
    cells = {"triangle": plate.cells["triangle"], "line": tube.cells["line"] + len(plate.points)}
    groups = {kind: {kind: np.arange(len(rows))} for kind, rows in cells.items()}
    mesh = Mesh(points, cells, groups, {"root": np.flatnonzero(points[:, 0] == 0)})
    members = [Member("triangle", "plate", 0.004, METAL), Member("line", "beam", Tube(0.02, 0.002), METAL)]
    structure = build_structure(mesh, members)
    return reduce_structure(structure, cantilever_modes(structure, "root", 3))


def write(path, body, delta, without_field=False):
    """A run of a body held at its root at those elastic coordinates (t, n), and what it reports."""
    bodies = {"hub": rigid_body(50.0, np.eye(3) * 20.0), "boom": body}
    joints = (system.weld("hub"), system.weld("boom", "hub", child_marker="root"))
    model = compile_system(System(bodies, joints))
    times = np.arange(float(len(delta)))
    channels = model.observe(times, np.hstack([delta, np.zeros_like(delta)]))
    with RunWriter(path, model.channels, bodies, {"title": "held"}) as writer:
        writer.write_block(times, channels)
        writer.finish(complete=True)
    return path


@pytest.fixture(scope="module")
def swinging(tmp_path_factory):
    delta = np.array([[0.3, 0.05, 0.1], [-0.2, 0.1, 0.0], [0.0, 0.0, 0.0], [0.4, 0.0, 0.3]])
    path = write(tmp_path_factory.mktemp("runs") / "beam.h5", beam_on_functions(), delta)
    with open_run(path) as run:
        yield run


def test_painted_energy_integrates_to_the_monitor(swinging):
    (part,) = swinging.bodies()["boom"].strain_field
    elastic = swinging["monitors/elastic"]
    assert elastic.max() > 1.0 and part.energy(swinging["bodies/boom/delta"]) @ part.weight == pytest.approx(
        elastic, rel=1e-6, abs=1e-9
    )


def test_curvature_is_coloured_at_its_place(swinging):
    paint, skin = plan_scene(swinging, Look(colour="strain:curvature_z")).paints["boom"], swinging.bodies()["boom"].skin
    (part,), y = swinging.bodies()["boom"].strain_field, swinging["bodies/boom/delta"][0]
    order = np.argsort(part.places[:, 0])
    exact = np.interp(skin.points[:, 0], part.places[order, 0], part.strains(y)[0, order, 1])
    assert np.abs(paint.values(y) - exact).max() < 0.04 * np.abs(exact).max()


def test_constant_strain_has_one_colour():
    body = plate_and_beam()
    plate = body.strain_field[0]
    rows = np.zeros_like(plate.rows)
    rows[:, 0, 0] = 2e-4
    uniform_part = type(plate)(**{**vars(plate), "rows": rows})
    field = (uniform_part, body.strain_field[1])
    paint = BodyPaint.from_field(quantity_of_colour("strain:membrane_xx", list(field), "b"), field, body.skin)
    colours = paint.values(np.array([1.0, 0.0, 0.0]))
    on_plate = body.skin.points[:, 1] > -0.25
    assert colours[on_plate] == pytest.approx(2e-4, rel=1e-6) and np.isnan(colours[~on_plate]).all()


@pytest.mark.sampled(1)
@pytest.mark.parametrize("colour", ["energy", "strain:axial"])
def test_pictures_and_movies_are_drawn(swinging, tmp_path, colour):
    picture = np.asarray(Image.open(render_picture(swinging, tmp_path / "a.png", 0.0, colour=colour, **SMALL)), int)
    plain = np.asarray(Image.open(render_picture(swinging, tmp_path / "b.png", 0.0, **SMALL)), int)
    assert np.ptp(picture, axis=2).max() > 80 and np.abs(picture - plain).max() > 80
    frames = render_movie(swinging, tmp_path / "frames", fps=1.0, speed=1.0, colour=colour, **SMALL)
    images = [np.asarray(Image.open(frame), int) for frame in sorted(frames.iterdir())]
    assert len(images) == 4 and all(np.abs(a - b).max() > 50 for a, b in pairwise(images))


def test_modes_are_coloured_by_strain(tmp_path):
    body = plate_and_beam()
    images = [
        np.asarray(Image.open(mode_montage(body, tmp_path / f"{k}.png", [1, 2], colour=colour, size=(200, 150))), int)
        for k, colour in enumerate(["displacement", "energy:plate", "strain:curvature_xx"])
    ]
    assert all(np.abs(a - b).max() > 80 for a, b in pairwise(images))
    paint = BodyPaint.from_field(
        quantity_of_colour("energy:plate", list(body.strain_field), "b"), body.strain_field, body.skin
    )
    assert np.nanmax(paint.values(np.array([1.0, 0.0, 0.0]))) > 0


def part_of(kind, points, per=1, n=2, stress=0.0, seed=0, **part_options):
    """A part whose gradients are linear in place: rows[p, g, k] = a[g, k] + b[g, k] . x."""
    rng = np.random.default_rng(seed)
    points = np.asarray(points, float)
    g = len(NAMES[kind])
    a, b = rng.normal(size=(g, n)), rng.normal(size=(g, n, 3))
    rows = a + np.einsum("gnx,px->pgn", b, points)
    C = rng.normal(size=(g, g))
    return StrainPart(
        kind, points, rng.uniform(0.5, 1.5, len(points)), rows.astype(np.float32), np.eye(g), np.zeros((g, g, g)),
        (C @ C.T)[None], np.full((1, g), stress), np.eye(n), False, per, **part_options,
    )  # fmt: skip


def exact(part, points, y, seed=0):
    """The strains of `part_of` at any places."""
    rng = np.random.default_rng(seed)
    g, n = len(NAMES[part.kind]), part.rows.shape[2]
    a, b = rng.normal(size=(g, n)), rng.normal(size=(g, n, 3))
    return (a + np.einsum("gnx,px->pgn", b, points)) @ y
