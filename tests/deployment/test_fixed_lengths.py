"""Deploying members at one instant: their body there, modes, equilibria and what is said of lengths that move."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from support.members import UNIT, solved, wall_beam

from femflex.advice.deployed import SlackWatch
from femflex.body.skin import Skin
from femflex.case import parse_case
from femflex.deployment import DeployingLine, Reel, deploying_line
from femflex.dynamics import compile_system
from femflex.dynamics.equilibria.equilibrium import equilibrium
from femflex.dynamics.equilibria.system_modes import system_modes
from femflex.pipeline import prepare
from femflex.pipeline.balanced import case_modes
from femflex.reduction import BeamFunctions
from femflex.system import Profile, System, weld
from femflex.system.fixed_length import body_at_length, with_fixed_lengths
from femflex.warning import PhysicsWarning

CLAMPED = 1.8751040687119611  # root of cos x cosh x = -1


def test_a_body_at_a_fixed_length_is_that_which_is_made_at_this_length():
    """Moments, stiffness, markers and skin from the table, against the series of the member."""
    length = Profile.smooth_step(0.0, 2.0, 1.0, 2.3)
    line = DeployingLine(mass_per_length=1.3, EIy=2.0, EIz=3.0, EA=50.0, GJ=1.0, ry=0.02, rz=0.03, root=(0.1, 0.2, 0.3))
    made = deploying_line(line, BeamFunctions(y=2, z=1, axial=1, torsion=1), length, until=2.0, stock=3.0)
    system = System({"boom": made.body}, (weld("boom"),), varying={"boom": made.variation})
    found, L = with_fixed_lengths(system, 1.3), float(length(1.3)[0])
    exact, body = made.parts.body(L), found.bodies["boom"]
    assert 1.3 < L < 2.3
    for key in ("mass", "first", "second"):
        assert getattr(body.moments, key) == pytest.approx(getattr(exact.moments, key), rel=1e-12, abs=1e-13)
    assert body.strain.V1 == pytest.approx(exact.strain.V1, rel=1e-12)
    assert body.omega[:2] == pytest.approx(exact.omega[:2], rel=1e-12)
    for name, marker in exact.markers.items():
        assert body.markers[name].position == pytest.approx(marker.position, abs=1e-14)
        assert body.markers[name].phi == pytest.approx(marker.phi, abs=1e-13)
        assert body.markers[name].psi == pytest.approx(marker.psi, abs=1e-13)
    assert body.skin.points[:, 0].max() == pytest.approx(0.1 + L, abs=1e-12)
    seen = compile_system(found).observe(np.array([7.0]), compile_system(found).x0[None])
    assert seen["bodies/boom/length"][0] == pytest.approx(L)
    assert seen["bodies/boom/length_rate"][0] == 0.0


@pytest.mark.parametrize("field", ["y", "torsion", "axial"])
def test_the_damping_ratio_of_a_shape_stays_as_its_member_grows(field):
    """D = 2 ratio sqrt(V1 Me) on the diagonal: bending slows by the square of the length, torsion by the length."""
    length = Profile.smooth_step(0.0, 2.0, 1.0, 2.6)
    line = DeployingLine(mass_per_length=1.3, EIy=2.0, EIz=3.0, EA=50.0, GJ=1.0, ry=0.02, rz=0.03)
    made = deploying_line(line, BeamFunctions(**{field: 2}), length, until=2.0, stock=3.0, damping=[0.01, 0.03])
    system = System({"boom": made.body}, (weld("boom"),), varying={"boom": made.variation})
    for t in (0.0, 1.0, 1.4, 2.0):
        body = with_fixed_lengths(system, t).bodies["boom"]
        critical = 2.0 * np.sqrt(np.diag(body.strain.V1) * np.diag(body.moments.elastic_mass())[:2])
        assert np.diag(body.damping) / critical == pytest.approx([0.01, 0.03], rel=1e-10)


def test_modes_at_a_time_are_those_of_the_length_then():
    """f = (1.8751 / L)^2 / (2 pi) of a unit cantilever; without a time its first length stays."""
    system = wall_beam(Profile.smooth_step(0.0, 2.0, 1.0, 2.0), 6)
    for at, L in ((None, 1.0), (0.0, 1.0), (1.0, 1.5), (9.0, 2.0)):
        found = system_modes(system, at)
        assert found.frequencies[0] == pytest.approx((CLAMPED / L) ** 2 / (2 * np.pi), rel=1e-6)
    assert system_modes(system).left_out == ("length of 'beam'",)


def test_an_equilibrium_needs_a_length_that_stays():
    system = wall_beam(Profile.smooth_step(0.0, 2.0, 1.0, 2.0), 2)
    with pytest.raises(ValueError, match=r"the length of body 'beam' changes over time.*say at which time.*--at"):
        equilibrium(system)
    assert equilibrium(system, 1.0).stable
    made = deploying_line(UNIT, None, reel := Reel("reel", 1.0), stock=2.0)
    free = System({"beam": made.body}, (weld("beam"),), varying={"beam": made.variation}, effectors=(reel.effector(),))
    with pytest.raises(ValueError, match=r"the length of body 'beam' is free \(state 'reel\.length'\)"):
        equilibrium(free, 1.0)


CASE = """
title = "boom on its base"
source = "closed form"
[run]
duration = "0.2 s"
output_step = "0.1 s"
[bodies.boom]
kind = "deploying"
family = "beam"
length = 2
stock = 3
mass_per_length = 0.5
EIy = 20
EIz = 20
strain = "linear"
functions = { y = 2, z = 2 }
[[joints]]
kind = "weld"
child = "boom"
"""
PUSH = '[[loads]]\nname = "push"\nbody = "boom"\nmarker = "tip"\nframe = "body"\nforce = [-8, 0, 0]\n'


def test_a_load_along_a_linear_member_is_said_in_runs_and_modes(tmp_path):
    """8 N at the tip of a cantilever that buckles at pi^2 EI / (4 L^2) = 12.3 N: sqrt(1 - 8/12.3) of its frequency."""
    from femflex import run

    case = parse_case(CASE + PUSH, Path("boom.toml"))
    text = r"body 'boom' carries -8 N along its axis.* lowers its first frequency by 41%.*linear strain leaves this out"
    with pytest.warns(PhysicsWarning, match=text):
        case_modes(case)
    with pytest.warns(PhysicsWarning, match=text):
        run(case, tmp_path / "boom.h5").close()
    with (
        pytest.warns(PhysicsWarning, match=r"body 'boom' is compressed by the preliminary .*: 8 N.*65% of its"),
        pytest.warns(PhysicsWarning, match=r"body 'boom' is compressed by 8 N along its axis.*65% of its buckling"),
    ):
        run(parse_case((CASE + PUSH).replace('"linear"', '"condensed"'), Path("boom.toml")), tmp_path / "c.h5").close()


THRUSTER = """
[environment]
gravity = [-9.81, 0, 0]
[bodies.pay]
kind = "rigid"
mass = 1
inertia = [1, 1, 1]
[[joints]]
kind = "weld"
child = "pay"
parent = "boom"
parent_marker = "tip"
[thrusters.t]
body = "pay"
axis = [-1, 0, 0]
thrust = 50
profile = { times = [0], levels = [1] }
"""


def test_a_craft_without_degrees_of_freedom_runs_with_a_thruster():
    """The drum carries thrust and weight: 50 N + 9.81 (m' L + 1 kg) + m' U^2."""
    text = CASE.replace("length = 2\n", 'length = { kind = "polynomial", coefficients = [1, 0.1] }\n')
    text = text.replace('strain = "linear"\nfunctions = { y = 2, z = 2 }\n', "")
    prepared = prepare(parse_case(text + THRUSTER, Path("boom.toml")))
    assert not SlackWatch(prepared.model).lowest  # a straight beam carries compression by request
    assert prepared.model.n_u == 0
    seen = prepared.model.observe(np.array([1.0]), prepared.model.x0[None])
    assert seen["bodies/boom/drum_force"][0] == pytest.approx(50 + 9.81 * (0.5 * 1.1 + 1) + 0.5 * 0.01, rel=1e-12)
    assert prepared.model.max_frequency == 0.0


def test_drum_force_of_a_member_at_rest_is_its_tension():
    """What the tension says with a load at the tip: constant along the member, minus the drum's force."""
    system = prepare(parse_case(CASE.replace('"linear"', '"condensed"') + PUSH.replace("-8", "3"))).system
    seen = solved(system, np.linspace(0, 1, 3))[2]
    assert seen["bodies/boom/tension"] == pytest.approx(3.0, abs=1e-9)
    assert seen["bodies/boom/drum_force"] == pytest.approx(-3.0, abs=1e-9)


def test_amplitudes_of_dependent_shapes_are_the_same_to_the_bit_alone_and_together():
    """However a run is cut into blocks: each state by itself, and in stacks of any size."""
    body = wall_beam(Profile.constant(2.0), 5).bodies["beam"]
    delta = np.random.default_rng(3).normal(size=(37, body.n_modes)) * 1e-3
    whole = body.amplitudes(delta)
    assert len(body.slaves) and whole.shape == (37, body.n_shapes)
    assert np.array_equal(whole, np.array([body.amplitudes(one) for one in delta]))
    assert np.array_equal(whole, np.concatenate([body.amplitudes(part) for part in (delta[:8], delta[8:9], delta[9:])]))
    exact = np.einsum("sij,ti,tj->ts", body.slaves, delta, delta) / 2
    assert whole[:, body.n_modes :] == pytest.approx(exact, rel=1e-12, abs=1e-20)


def test_skin_and_frequencies_at_a_length_follow_its_ratio_to_the_first_one():
    """Points go on by their growth, shapes that draw the member in by the inverse, frequencies by V1 and mass."""
    line = DeployingLine(mass_per_length=1.3, EIy=2.0, EIz=3.0, EA=50.0, GJ=1.0, ry=0.02, rz=0.03)
    length = Profile.spline([0.0, 1.0, 1.5, 2.0], [1.25, 1.6, 2.1, 2.5])
    made = deploying_line(line, BeamFunctions(y=2, z=1, axial=0, torsion=1), length, until=2.0, stock=3.0)
    rng, n = np.random.default_rng(3), made.body.n_shapes
    kinds = tuple("derivative" if k % 2 else "vibration" for k in range(n))
    skin = Skin(rng.normal(size=(7, 3)), {}, rng.normal(size=(n, 7, 3)), rng.normal(size=(7, 3)))
    body = body_at_length(replace(made.body, skin=skin, kinds=kinds), made.variation, 2.0)
    grown, first = body.skin, 1.25
    np.testing.assert_allclose(grown.points, skin.points + (2.0 / first - 1.0) * skin.growth)
    np.testing.assert_allclose(grown.growth, 2.0 / first * skin.growth)
    for k, kind in enumerate(kinds):
        ratio = first / 2.0 if kind == "derivative" else 1.0
        np.testing.assert_allclose(grown.shapes[k], ratio * skin.shapes[k])
    squares = np.diag(body.strain.V1) / np.diag(body.moments.elastic_mass())[: body.n_modes]
    np.testing.assert_allclose(body.omega[: body.n_modes], np.sqrt(squares), rtol=1e-12)
    plain = replace(skin, growth=None)
    assert body_at_length(replace(made.body, skin=plain), made.variation, 2.0).skin is plain
