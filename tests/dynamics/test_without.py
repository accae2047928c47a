"""A model with something switched off is the model of a system in which it is not there."""

from dataclasses import replace

import numpy as np
import pytest
from support.random_systems import random_tree
from support.spin_up import KANE
from test_terms import one, random_model

from femflex.body import StrainTensors
from femflex.dynamics import compile_system
from femflex.integrate import integrator
from femflex.reduction import UniformBeam, beam_body
from femflex.reduction.admissible import BeamFunctions
from femflex.system import Frame, Load, Orbit, System, free, revolute, weld

SWITCHED = ("coriolis_centrifugal", "gyroscopic", "specified_motion", "gravity_gradient")


def accelerations(model, x):
    return model.state_rate(0.2, x)[model.n_q :]


def rebuilt(model, name):
    """The system of the model, put together anew without the thing."""
    system = model.system
    bodies = dict(system.bodies)
    if name in ("elastic", "prestress"):
        kept = (lambda s: (0 * s.V1, s.f0)) if name == "elastic" else (lambda s: (s.V1, 0 * s.f0))
        bodies = {key: replace(body, strain=StrainTensors(*kept(body.strain))) for key, body in bodies.items()}
    elif name == "damping":
        bodies = {key: replace(body, damping=np.zeros_like(body.damping)) for key, body in bodies.items()}
    key = {"joint_springs": "stiffness", "joint_dampers": "damping"}.get(name)
    joints = tuple(replace(j, **{key: np.zeros(j.n_u)}) if key else j for j in system.joints)
    loads = tuple(load for load in system.loads if load.name != name)
    return compile_system(replace(system, bodies=bodies, joints=joints, loads=loads))


@pytest.mark.parametrize("name", ["elastic", "prestress", "damping", "joint_springs", "joint_dampers", "push"])
def test_a_part_switched_off_is_a_system_without_it(name):
    model, x = random_model(1, "specified orbit")
    less, theirs = model.without(name), rebuilt(model, name)
    assert not np.allclose(accelerations(less, x), accelerations(model, x))
    assert np.array_equal(accelerations(less, x), accelerations(theirs, x))
    assert less.channels == theirs.channels
    assert {name, f"loads/{name}"} & set(less.omitted) and not set(less.omitted) & set(one(less, x))


CHOICES = [
    (kind, names)
    for kind, own in (
        ("inertial", SWITCHED[:1]),
        ("spinning", SWITCHED[:3]),
        ("specified orbit", SWITCHED),
        ("free orbit", SWITCHED),
    )
    for names in (*((name,) for name in own), own)
]


@pytest.mark.parametrize(
    ("kind", "names"), CHOICES, ids=lambda value: value if isinstance(value, str) else "+".join(value)
)
def test_the_other_terms_balance_without_a_term_of_the_equations(kind, names):
    model, x = random_model(2, kind)
    less, full = model.without(*names), one(model, x)
    rest = sum(row for name, row in full.items() if name not in (*names, "inertia"))
    assert accelerations(less, x) == pytest.approx(
        np.linalg.solve(model.mass_matrix(0.2, x), -shifted(model, x, names)), rel=1e-8, abs=1e-8
    )
    assert one(less, x)["inertia"] == pytest.approx(-rest, abs=1e-10 * np.abs(rest).max())
    udot = np.linspace(-1, 1, model.n_u)
    M = model.mass_matrix(0.2, x)
    expected = M @ udot + shifted(model, x, names)
    assert less.residual(0.2, x, udot) == pytest.approx(expected, abs=1e-10 * np.abs(expected).max())


def shifted(model, x, names):
    """h - Q at t = 0.2 without the terms."""
    found = one(model, x, t=0.2)
    return sum(row for name, row in found.items() if name not in (*names, "inertia"))


def test_without_all_that_the_turning_frame_does_it_is_a_frame_at_rest():
    system, _, (q, u) = random_tree(3, frame=Frame("spinning", np.array([0.3, -0.5, 0.7])))
    x = np.concatenate([q, u])
    still = compile_system(replace(system, frame=Frame()))
    less = compile_system(system).without("gyroscopic", "specified_motion")
    assert accelerations(less, x) == pytest.approx(accelerations(still, x), rel=1e-9, abs=1e-9)


def boom_craft(**more):
    beam = UniformBeam(length=12.0, EA=1e6, EIy=900.0, EIz=900.0, GJ=700.0, mass_per_length=0.5)
    boom = beam_body(beam, BeamFunctions(y=2, z=2))
    from femflex.body import rigid_body

    hub = rigid_body(60.0, np.diag([30.0, 40.0, 50.0]))
    joints = (free("hub", u0=[0, 0, 0, 0.1, 0.3, -0.2]), revolute("boom", "hub", stiffness=40.0))
    return System({"hub": hub, "boom": boom}, joints, delta0={"boom": np.array([0.3, 0, 0.1, 0])}, **more)


def test_flexibility_off_is_the_rigid_craft_and_the_limit_of_stiff_ones():
    model = compile_system(boom_craft())
    rigid = model.without("flexibility")
    assert rigid.n_u == 7 and rigid.omitted == ("flexibility",) and model.n_u == 11
    assert [body.n_modes for body in rigid.system.bodies.values()] == [0, 0]
    moments = model.system.bodies["boom"].moments
    assert rigid.system.bodies["boom"].moments.inertia() == pytest.approx(moments.inertia(), rel=1e-15)
    differences = []
    for stiffer in (1e2, 1e4):  # started in the spinning boom's shape of rest, so that it hardly vibrates
        body = replace(
            model.system.bodies["boom"], strain=StrainTensors.linear(stiffer * model.system.bodies["boom"].strain.V1)
        )
        stiff = compile_system(replace(model.system, bodies={**model.system.bodies, "boom": body}, delta0={}))
        times = np.linspace(0, 2, 5)
        runs = [integrator("dop853", rtol=1e-9, atol=1e-10).solve(m, times, m.x0).states[-1] for m in (stiff, rigid)]
        differences.append(np.abs(runs[0][:8] - runs[1][:8]).max())
    assert differences[1] < 1e-3 and differences[0] / differences[1] > 30  # the compliance


def test_one_body_may_be_made_rigid_alone():
    boom = boom_craft().bodies["boom"]
    bodies = {**boom_craft().bodies, "other": boom}
    system = System(bodies, (*boom_craft().joints, weld("other", "hub")))
    less = compile_system(system).without("flexibility/other")
    assert [less.system.bodies[name].n_modes for name in ("hub", "boom", "other")] == [0, 4, 0]


def test_a_run_without_gravity_and_frame_tumbles_freely():
    """On an orbit, with gravity and the frame's rotation off, a craft at rest relative to it stays so."""
    orbit = Orbit(7e6)
    model = compile_system(boom_craft(orbit=replace(orbit, free=True), frame=Frame("orbital")))
    less = model.without("gravity_gradient", "gyroscopic", "specified_motion")
    times = np.linspace(0, 20, 11)
    for method in ("dop853", "esdirk4"):
        solution = integrator(method, rtol=1e-9, atol=1e-11).solve(less, times, less.x0)
        seen = compile_system(boom_craft()).observe(solution.times, solution.states)
        for path in ("monitors/energy", "monitors/momentum"):
            drift = np.abs(seen[path] - seen[path][0]).max()
            assert drift < 1e-5 * np.abs(seen["monitors/energy"]).max()


def test_names_that_cannot_be_switched_off_are_answered():
    model, _ = random_model(1, "specified orbit")
    sentence = (
        r"'gravity' cannot be switched off: this system has none; did you mean 'gravity_gradient'\? "
        r"Known here are coriolis_centrifugal, .*, loads/push, loads/pull, flexibility, .*\.$"
    )
    with pytest.raises(ValueError, match=sentence):
        model.without("gravity")
    flexible = next(name for name in model.system.order if model.system.bodies[name].n_modes)
    with pytest.raises(ValueError, match=rf"{flexible!r} is not something .*; did you mean 'flexibility/{flexible}'\?"):
        model.without(flexible)
    with pytest.raises(ValueError, match="'inertia' cannot be switched off: without it there is no motion"):
        model.without("inertia")
    with pytest.raises(ValueError, match="'damping' is switched off already"):
        model.without("damping").without("damping")
    rigid = model.without("flexibility")
    with pytest.raises(ValueError, match="'elastic' cannot be switched off: this system has none"):
        rigid.without("elastic")
    assert rigid.without("gravity_gradient").without("pull").omitted == (
        "flexibility",
        "gravity_gradient",
        "loads/pull",
    )


@pytest.mark.parametrize("strain", ["condensed", "nonlinear"])
def test_without_nonlinear_strain_a_beam_is_the_linear_one(strain):
    pull = Load("pull", "beam", "tip", frame="marker", force=[300.0, 20.0, 0.0], torque=[0.0, 0.0, 50.0])

    def model(which, **functions):  # a force that turns with the tip asks how far the tip is turned
        return compile_system(System({"beam": KANE.body(which, y=3, **functions)}, (KANE.joint(),), loads=(pull,)))

    axial = 3 if strain == "nonlinear" else 0
    curved, linear = model(strain, axial=axial), model("linear", axial=axial)
    less = curved.without("nonlinear_strain")
    x = np.random.default_rng(1).normal(size=linear.n_x) * 0.1
    assert less.omitted == ("nonlinear_strain",)
    assert accelerations(less, x) == pytest.approx(accelerations(linear, x), rel=1e-9)
    assert not np.allclose(accelerations(curved, x), accelerations(linear, x), rtol=1e-3)
    with pytest.raises(ValueError, match="'nonlinear_strain' cannot be switched off: this system has none"):
        linear.without("nonlinear_strain")
