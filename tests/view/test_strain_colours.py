"""Pictures coloured by strain and energy density: what is painted, the bar, and names that are not known."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from PIL import Image
from support.made_runs import craft

import femflex.view.scene
from femflex import System, compile_system, rigid_body, system
from femflex.body.strain_field import StrainPart
from femflex.fem import Material, Member, build_structure
from femflex.fem.sections import Tube
from femflex.mesh import Mesh, line, rectangle
from femflex.reduction import (
    BeamFunctions,
    UniformBeam,
    beam_body,
    cantilever_modes,
    load_body,
    reduce_structure,
    save_body,
    with_attachment,
)
from femflex.results import RunWriter, open_run
from femflex.view import mode_montage, render_movie, render_picture
from femflex.view.look import Look
from femflex.view.paint import BodyPaint, chosen
from femflex.view.plan import planned
from femflex.view.units import strain_bar

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
    whole = Mesh(points, cells, groups, {"root": np.flatnonzero(points[:, 0] == 0)})
    members = [Member("triangle", "plate", 0.004, METAL), Member("line", "beam", Tube(0.02, 0.002), METAL)]
    structure = build_structure(whole, members)
    return reduce_structure(structure, cantilever_modes(structure, "root", 3))


def write(path, body, delta, without_field=False):
    """A run of a body held at its root at those elastic coordinates (t, n), and what it reports."""
    bodies = {"hub": rigid_body(50.0, np.eye(3) * 20.0), "boom": body}
    held = (system.weld("hub"), system.weld("boom", "hub", child_marker="root"))
    model = compile_system(System(bodies, held))
    times = np.arange(float(len(delta)))
    seen = model.observe(times, np.hstack([delta, np.zeros_like(delta)]))
    with RunWriter(path, model.channels, bodies, {"title": "held"}) as writer:
        writer.write_block(times, seen)
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


def test_the_bar_holds_the_whole_run(swinging):
    (part,) = swinging.bodies()["boom"].strain_field
    y = swinging["bodies/boom/delta"]
    energy = planned(swinging, Look(colour="energy"), 1.0)
    assert not energy.bar.signed and energy.bar.title == "strain\nenergy" and energy.bar.unit == "J/m"
    assert part.energy(y).max() <= energy.bar.top / energy.bar.factor <= 1.3 * part.energy(y).max()
    bent = planned(swinging, Look(colour="strain:curvature_z"), 1.0)
    assert bent.bar.limits == (-bent.bar.top, bent.bar.top)
    assert bent.bar.top >= np.abs(part.strains(y)[:, :, 1]).max() * bent.bar.factor


def test_the_bar_holds_the_body_that_bends_most_whatever_their_order(tmp_path):
    body, delta = beam_on_functions(), np.array([[0.3, 0.05, 0.1], [-0.2, 0.1, 0.0]])
    for order in ((1.0, 0.1), (0.1, 1.0)):
        bodies = {"hub": rigid_body(50.0, np.eye(3)), "first": body, "second": body}
        held = [system.weld(name, "hub", child_marker="root") for name in ("first", "second")]
        model = compile_system(System(bodies, (system.weld("hub"), *held)))
        q = np.hstack([part * delta for part in order])
        path = tmp_path / f"{order[0]}.h5"
        with RunWriter(path, model.channels, bodies, {"title": "two"}) as writer:
            writer.write_block(np.arange(2.0), model.observe(np.arange(2.0), np.hstack([q, 0.0 * q])))
            writer.finish(complete=True)
        with open_run(path) as run:
            bar, y = (
                planned(run, Look(colour="energy"), 1.0).bar,
                [run[f"bodies/{name}/delta"] for name in bodies if name != "hub"],
            )
            largest = max(body.strain_field[0].energy(one).max() for one in y)
            assert largest <= bar.top / bar.factor <= 1.3 * largest


@pytest.mark.parametrize("sign", [1, -1], ids=["stretched", "pressed"])
def test_the_bar_of_a_field_of_one_sign_holds_it(sign, tmp_path):
    """A plate pulled or pressed along itself: strains of one sign but for a fiftieth, and energy of a prestress."""
    mesh = rectangle(1.0, 0.5, 4, 2, "triangle")
    structure = build_structure(mesh, [Member("surface", "plate", 0.004, METAL)])
    modes = with_attachment(structure, cantilever_modes(structure, "left", 1), [], {"right": ["x"]})
    body = reduce_structure(structure, modes, {"root": "left"})
    pull = np.zeros(body.n_modes)
    pull[-1] = sign * np.sign(body.strain_field[0].strains(np.eye(body.n_modes)[-1:])[0, :, 0].sum())
    path = write(tmp_path / "pulled.h5", body, np.outer([0.0, 1.0, 0.5], pull))
    with open_run(path) as run:
        (part,) = run.bodies()["boom"].strain_field
        strains = part.strains(run["bodies/boom/delta"])[:, :, 0]
        assert (sign * strains).max() > 20 * -(sign * strains).min()  # nearly all of one sign
        bar = planned(run, Look(colour="strain:membrane_xx"), 1.0).bar
        assert bar.signed and bar.limits == (-bar.top, bar.top)
        assert np.abs(strains).max() <= bar.top / bar.factor <= 1.3 * np.abs(strains).max()


def test_the_bar_of_an_energy_that_is_mainly_negative_holds_it(swinging, monkeypatch):
    """An energy density below zero, as a prestress gives where it is let go: a bar with two signs."""
    (part,) = swinging.bodies()["boom"].strain_field
    largest = part.energy(swinging["bodies/boom/delta"]).max()
    real = StrainPart.energy
    monkeypatch.setattr(StrainPart, "energy", lambda self, y: -real(self, y))
    bar = planned(swinging, Look(colour="energy"), 1.0).bar
    assert bar.signed and largest <= bar.top / bar.factor <= 1.3 * largest


@pytest.mark.parametrize(("part", "signed"), [(0.1, True), (1e-2, True), (1e-4, False)])
def test_an_energy_has_a_bar_with_two_signs_from_a_thousandth_below_zero_on(swinging, monkeypatch, part, signed):
    real = StrainPart.energy
    monkeypatch.setattr(StrainPart, "energy", lambda self, y: real(self, y) * np.where(y[:, :1] > 0.35, 1.0, -part))
    (field,) = swinging.bodies()["boom"].strain_field
    largest = field.energy(swinging["bodies/boom/delta"])
    assert planned(swinging, Look(colour="energy"), 1.0).bar.signed == signed
    assert (largest.min() < -1e-3 * largest.max()) == signed


def test_a_picture_says_that_its_bar_is_that_of_the_whole_run(swinging, tmp_path, monkeypatch):
    said = []
    real = femflex.view.scene.add_text
    monkeypatch.setattr(
        femflex.view.scene, "add_text", lambda r, text, *a, **k: said.append(text) or real(r, text, *a, **k)
    )
    for colour in ("energy", "displacement"):
        said.clear()
        render_picture(swinging, tmp_path / f"{colour}.png", time=1.0, colour=colour, size=(640, 360))
        assert "scale of the whole run" in said


def test_curvature_is_painted_where_it_is(swinging):
    paint, skin = planned(swinging, Look(colour="strain:curvature_z")).paints["boom"], swinging.bodies()["boom"].skin
    (part,), y = swinging.bodies()["boom"].strain_field, swinging["bodies/boom/delta"][0]
    order = np.argsort(part.places[:, 0])
    exact = np.interp(skin.points[:, 0], part.places[order, 0], part.strains(y)[0, order, 1])
    assert np.abs(paint.values(y) - exact).max() < 0.04 * np.abs(exact).max()


def test_constant_strain_is_painted_constant():
    body = plate_and_beam()
    plate = body.strain_field[0]
    rows = np.zeros_like(plate.rows)
    rows[:, 0, 0] = 2e-4
    same = type(plate)(**{**vars(plate), "rows": rows})
    field = (same, body.strain_field[1])
    paint = BodyPaint.of(chosen("strain:membrane_xx", list(field), "b"), field, body.skin)
    found = paint.values(np.array([1.0, 0.0, 0.0]))
    on_plate = body.skin.points[:, 1] > -0.25
    assert found[on_plate] == pytest.approx(2e-4, rel=1e-6) and np.isnan(found[~on_plate]).all()


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
        np.asarray(Image.open(mode_montage(body, tmp_path / f"{k}.png", [1, 2], colour=colour, tile=(200, 150))), int)
        for k, colour in enumerate(["displacement", "energy:plate", "strain:curvature_xx"])
    ]
    assert all(np.abs(a - b).max() > 80 for a, b in pairwise(images))
    paint = BodyPaint.of(chosen("energy:plate", list(body.strain_field), "b"), body.strain_field, body.skin)
    assert np.nanmax(paint.values(np.array([1.0, 0.0, 0.0]))) > 0


def test_a_name_that_is_not_known_meets_those_that_are(swinging):
    known = "displacement, energy, strain:axial, strain:curvature_z, strain:curvature_y, strain:twist, "
    known += "stress:axial_force, stress:moment_z, stress:moment_y, stress:torque"
    with pytest.raises(ValueError, match=f"'strain:kink' is not known for beam.h5; known are {known}[.]"):
        planned(swinging, Look(colour="strain:kink"))
    parts = list(plate_and_beam().strain_field)
    with pytest.raises(ValueError, match=r"'heat' is not known for b; .*energy, energy:line, energy:plate"):
        chosen("heat", parts, "b")


def test_bodies_are_coloured_by_stress_and_a_member_that_touches_another_keeps_its_own():
    body = plate_and_beam()
    quantity = chosen("stress:von_mises", list(body.strain_field), "b")
    paint = BodyPaint.of(quantity, body.strain_field, body.skin)
    values = paint.values(np.array([1.0, 0.0, 0.0]))
    assert quantity.unit == "Pa" and not paint.bare.any() and (values >= 0).all()  # round beams have it too
    paint = BodyPaint.of(chosen("stress:moment_xx", list(body.strain_field), "b"), body.strain_field, body.skin)
    assert np.isnan(paint.values(np.array([1.0, 0.0, 0.0]))[paint.bare]).all()
    moments = chosen("stress:moment_y", list(body.strain_field), "b")
    other = BodyPaint.of(moments, body.strain_field, body.skin)
    assert (other.bare == ~paint.bare).all()  # a point is of one member


def test_energy_of_several_kinds_is_in_per_cent_of_the_largest_of_each():
    body = plate_and_beam()
    paint = BodyPaint.of(chosen("energy", list(body.strain_field), "b"), body.strain_field, body.skin)
    assert paint.quantity.unit == "%" and not paint.bare.any() and len(paint.parts) == 2
    y = np.array([1.0, 0.4, -0.3])
    largest = {part.kind: part.energy(y[None]).max() for part, _ in paint.parts}
    assert set(largest) == {"line", "plate"}
    values = replace(paint, quantity=replace(paint.quantity, largest=largest)).values(y)
    for part, rows in paint.parts:
        assert values[rows] == pytest.approx(100 * part.energy(y[None])[0] / largest[part.kind], rel=1e-5)


def test_a_run_without_strain_says_what_to_do(run):
    with pytest.raises(ValueError, match=r"tumbling.h5 holds none: .* Make it again with `femflex run`"):
        planned(run, Look(colour="energy"))
    with pytest.raises(ValueError, match=r"the body holds none"):
        mode_montage(craft()["boom"], "never.png", colour="energy")


def test_the_command_line_refuses_with_2_and_draws(swinging, tmp_path, femflex):
    code, _, err = femflex("render", swinging.path, "--colour", "strain:xx", "-o", tmp_path / "a.png")
    assert code == 2 and "known are displacement, energy, strain:axial" in err and not list(tmp_path.iterdir())
    body = save_body(tmp_path / "body.h5", plate_and_beam())
    assert len(load_body(body).strain_field) == 2
    assert femflex("render", body, "--colour", "energy:line", "-o", tmp_path / "m.png")[0] == 0
    assert femflex("render", body, "--colour", "energy", "-o", tmp_path / "both.png")[0] == 0


def test_bars_of_strain_have_sensible_units():
    assert (strain_bar(3e3, "J/m²", False, "").unit, strain_bar(2e-5, "J/m", False, "").unit) == ("kJ/m²", "µJ/m")
    assert (strain_bar(2e-3, "1/m", True, "").unit, strain_bar(0.2, "1/m", True, "").unit) == ("1/km", "1/m")
    assert strain_bar(3.5e-4, "1", True, "").labels[::4] == ["-400", "0", "400"]
    assert max(map(len, strain_bar(1e-18, "1", True, "").labels)) < 9
