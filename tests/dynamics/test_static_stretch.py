"""Static stretch of condensed bodies at markers: by spin, by an accelerated base, by weight."""

from __future__ import annotations

import numpy as np
import pytest
from support.spin_up import KANE

from femflex import equilibrium, fem
from femflex.body import Marker, rigid_body
from femflex.dynamics import compile_system
from femflex.dynamics.reports.static_stretch import body_fields
from femflex.fem.sections import StiffnessSection
from femflex.integrate import Dop853
from femflex.mesh import line
from femflex.reduction import (
    BeamFunctions,
    UniformBeam,
    beam_body,
    cantilever_modes,
    load_body,
    reduce_structure,
    save_body,
    with_derivatives,
)
from femflex.reduction.strain.static_stretch import stretching_answers
from femflex.system import Environment, Load, Profile, System, free, prismatic, revolute, weld

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


def seen(system, key, t=0.0):
    model = compile_system(system)
    return model.observe(np.array([t]), model.x0[None])[f"markers/beam.tip/{key}"][0]


@pytest.mark.parametrize("strain", ["meshed", "one"])
def test_a_beam_spun_up_keeps_its_steady_stretch_without_a_coordinate_for_it(strain):
    times = np.linspace(0.0, 18.0, 181)
    tip = KANE.meshed("condensed", 2, times=times) if strain == "meshed" else KANE.one("condensed", times, y=2)
    assert tip[times > 15.5, 0].mean() == pytest.approx(KANE.stretch, rel=3e-3)


@pytest.mark.parametrize("name", BODIES)
def test_a_beam_that_spins_on_a_hub_is_stretched_by_the_hubs_radius_too(name):
    """m Om^2 (L^3 / 3 + R L^2 / 2) / EA."""
    body = BODIES[name]()
    hub = rigid_body(10.0, np.eye(3), markers={"rim": body.marker("origin").rigid(np.array([RADIUS, 0, 0]))})
    turn = revolute("hub", axis=(0, 0, 1), motion=(Profile(np.zeros(1), np.array([[0.0, SPEED]])),))
    system = System({"hub": hub, "beam": body}, (turn, weld("beam", "hub", parent_marker="rim", child_marker="root")))
    L = KANE.length
    exact = KANE.mass * SPEED**2 * (L**3 / 3 + RADIUS * L**2 / 2) / KANE.EA
    assert seen(system, "deflection")[0] == pytest.approx(exact, rel=2e-3)


@pytest.mark.parametrize("direction", [(0, 0, -1.0), (0, 0.6, -0.8)])
def test_a_beam_hangs_longer_by_its_weight_in_any_axes(direction):
    """m g L^2 / 2 EA along the beam, of the part of gravity along it; also read back from a file."""
    d = np.asarray(direction)
    system = System({"beam": meshed(d)}, (weld("beam", child_marker="root"),), environment=Environment((0, 0, -G)))
    assert seen(system, "deflection") @ d == pytest.approx(
        -d[2] * KANE.mass * G * KANE.length**2 / 2 / KANE.EA, rel=1e-3
    )


def test_in_equilibrium_it_is_reported_and_the_coordinates_know_nothing_of_it(tmp_path):
    body = load_body(save_body(tmp_path / "beam.h5", meshed((0, 0, -1.0))))
    system = System({"beam": body}, (weld("beam", child_marker="root"),), environment=Environment((0, 0, -G)))
    state, model = equilibrium(system), compile_system(system)
    out = model.observe(np.zeros(1), np.concatenate([state.q, np.zeros(model.n_u)])[None])
    stretch = KANE.mass * G * KANE.length**2 / 2 / KANE.EA
    assert np.abs(state.q).max() < 1e-9
    assert out["markers/beam.tip/deflection"][0] == pytest.approx([0, 0, -stretch], abs=1e-3 * stretch)
    assert out["markers/beam.tip/position"][0] == pytest.approx([0, 0, -KANE.length - stretch], abs=1e-3 * stretch)


def test_where_a_load_acts_the_marker_stays_where_the_equations_see_it():
    push = Load("push", "beam", "tip", force=np.zeros(3))
    gravity = Environment((0, 0, -G))
    system = System({"beam": meshed((0, 0, -1.0))}, (weld("beam", child_marker="root"),), (push,), environment=gravity)
    assert np.array_equal(seen(system, "deflection"), np.zeros(3))


def test_a_fall_leaves_it_unstretched():
    slide = prismatic("beam", axis=(0, 0, 1), child_marker="root")
    system = System({"beam": meshed((0, 0, -1.0))}, (slide,), environment=Environment((0, 0, -G)))
    assert np.abs(seen(system, "deflection")).max() < 1e-10


def test_the_channel_says_whether_the_static_stretch_is_in_it():
    body = meshed()
    told = compile_system(System({"beam": body}, (weld("beam", child_marker="root"),))).channels
    assert "static stretch included" in told["markers/beam.tip/deflection"].description
    assert "static stretch" not in told["markers/beam.root/deflection"].description


def test_the_field_that_stretches_is_the_acceleration_of_every_place_less_gravity():
    """Second differences of markers of a body that tumbles under a torque and its weight."""
    places = np.array([[0.0, 0, 0], [1.0, 0, 0], [0, 1.0, 0], [0, 0, 1.0]])
    markers = {f"p{k}": Marker.rigid(place) for k, place in enumerate(places)}
    body = rigid_body(2.0, np.diag([1.0, 2.0, 2.5]), [0.1, 0.2, -0.1], markers)
    torque = Load("twist", "b", torque=np.array([[3.0, -2.0, 4.0]] * 2), times=np.array([0.0, 1.0]))
    joint = free("b", u0=np.array([0.3, 0, 0, 1.0, -2.0, 0.5]))
    system = System({"b": body}, (joint,), environment=Environment(np.array([0, 0, -G])), loads=(torque,))
    model, h = compile_system(system), 1e-3
    times = 0.4 + h * np.array([-1.0, 0.0, 1.0])
    states = Dop853(rtol=1e-13, atol=1e-14).solve(model, np.array([0.0, *times]), model.x0).states[1:]
    moved = model.observe(times, states)
    fields, turns = body_fields(model, times[1:2], states[1:2], [1])
    for k, place in enumerate(places):
        r = moved[f"markers/b.p{k}/position"]
        wanted = turns[0, 0] @ ((r[0] - 2 * r[1] + r[2]) / h**2 + [0, 0, G])
        assert fields[0, 0, 0] + place @ fields[0, 0, 1:] == pytest.approx(wanted, abs=1e-4)


@pytest.mark.parametrize("weight", [1.0, 1e-6, 1e6])
def test_a_field_stretches_a_light_soft_beam_as_one_of_the_same_frequencies(weight):
    """At the tip, of a uniform field and one that grows as x; what the shapes hold leaves no answer, however light."""
    L, EA, m, EI, GJ = 2.0, 1e6 * weight, 0.5 * weight, 40.0 * weight, 25.0 * weight
    section = StiffnessSection(EA=EA, EIy=EI, EIz=EI, GJ=GJ, mass_per_length=m, ry=0.01, rz=0.01)
    structure = fem.build_structure(line([[0, 0, 0], [L, 0, 0]], 8), [fem.Member("line", "beam", section)])
    shapes = cantilever_modes(structure, "start", 4)
    tip = structure.translation.toarray()[-3:]
    all_of_it = tip @ stretching_answers(structure, shapes, shapes.phi[:, :0])
    assert all_of_it[0, [0, 3]] == pytest.approx([m * L**2 / (2 * EA), m * L**3 / (3 * EA)], rel=5e-3)
    assert all_of_it[[1, 2], [1, 2]] == pytest.approx(m * L**4 / (8 * EI), rel=5e-3)
    answers = stretching_answers(structure, shapes, shapes.phi)
    assert (tip @ answers)[0, [0, 3]] == pytest.approx([m * L**2 / (2 * EA), m * L**3 / (3 * EA)], rel=5e-3)
    held = stretching_answers(structure, shapes, np.column_stack([shapes.phi, answers[:, [1, 2]]]))
    assert not held[:, [1, 2]].any() and held[:, 0] == pytest.approx(answers[:, 0], rel=1e-9)
    assert np.abs(answers[:, [6, 8, 9, 10]]).max(axis=0).all()  # small beside the others, yet not held
