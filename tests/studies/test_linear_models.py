"""Linear models: poles, zeros and responses against exact frequencies, simulated motion and differences."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import eigh, expm
from scipy.optimize import brentq
from support.hub_beam import exact_frequencies
from support.mechanisms import four_bar

from femflex.body import Marker, rigid_body
from femflex.dynamics import compile_system
from femflex.reduction import BeamFunctions, ModalDamping, UniformBeam, beam_body
from femflex.studies.linear import (
    StateSpace,
    balanced_truncation,
    linear_model,
    modal_truncation,
    poles_of,
    save_model,
    transmission_zeros,
)
from femflex.studies.linear.grid import response_grid
from femflex.system import (
    Controller,
    Effector,
    Environment,
    Frame,
    Load,
    Profile,
    System,
    free,
    prismatic,
    revolute,
    weld,
)

BEAM = UniformBeam(1.0, EA=1e4, EIy=10.0, EIz=1.0, GJ=10.0, mass_per_length=1.0, rotary_inertia=False)
CLAMPED = np.array([brentq(lambda b: np.cos(b) * np.cosh(b) + 1, *ends) for ends in ((1, 3), (4, 5), (7, 8))]) ** 2


def hub_and_beam(damping: float = 0.0, **more) -> System:
    """A hub on an axle at its centre with a unit beam 0.1 from it; damping: of the axle."""
    hub = rigid_body(0.5, 0.1 * np.eye(3), markers={"rim": Marker.rigid([0.1, 0.0, 0.0])})
    beam = beam_body(BEAM, BeamFunctions(y=8, z=0, axial=0, torsion=0))
    axle = revolute("hub", name="axle", damping=np.array([damping]))
    return System(
        {"hub": hub, "beam": beam}, (axle, weld("beam", "hub", parent_marker="rim", child_marker="root")), **more
    )


def test_poles_of_a_hub_with_a_beam_are_its_exact_frequencies():
    model = linear_model(hub_and_beam(), ["joints/axle.angle/effort"], ["bodies/hub/rate:z"])
    poles = poles_of(model)
    assert [pole.name for pole in poles[:3]] == ["rotation z", "rotation z", "bending 1"]
    assert [pole.rigid for pole in poles[:3]] == [True, True, False] and not any(pole.value for pole in poles[:2])
    found = [pole.value.imag for pole in poles[2:5]]
    assert found == pytest.approx(exact_frequencies(0.1, 0.1, 0.5, True), rel=1e-6)
    assert all(sum(pole.participation.values()) <= 1.0 + 1e-12 for pole in poles)


def test_participation_is_that_of_kinetic_energy_and_of_the_motion_where_it_is_rigid():
    """Without damping coordinate k of mode phi has |phi_k (M phi)_k|, one half for it and one for its rate."""
    model = linear_model(hub_and_beam(), ["joints/axle.angle/effort"], ["bodies/hub/rate:z"])
    names, n = [name for name, _ in model.states], len(model.mass)
    squares, phi = eigh(model.stiffness, model.mass)
    poles = poles_of(model)
    assert [pole.participation for pole in poles[:2]] == [{names[0]: 1.0}] * 2
    for pole, k in zip(poles[2:], np.flatnonzero(squares > 1.0), strict=True):
        share = np.abs(phi[:, k] * (model.mass @ phi[:, k]))
        for name, part in zip(names[:n], share / share.sum(), strict=True):
            assert pole.participation.get(name, 0.0) == pytest.approx(part / 2 if part > 0.04 else 0.0, abs=1e-6)


def test_zeros_from_the_axle_to_the_hub_are_the_frequencies_of_the_clamped_beam():
    model = linear_model(hub_and_beam(), ["joints/axle.angle/effort"], ["attitude/angles:z"])
    zeros = transmission_zeros(model)
    assert np.abs(zeros[:6:2]) == pytest.approx(CLAMPED, rel=1e-5)
    assert np.abs(zeros.real).max() < 1e-6 * np.abs(zeros).max()
    with pytest.raises(ValueError, match="as many inputs as outputs; found 1 and 0"):
        transmission_zeros(model.selected(outputs=[]))


def swinging(strength: float = 0.0) -> System:
    """A hinged arm with a beam under gravity, off its lowest place by a torque, and damped; the hinge rides a slide."""
    arm = rigid_body(1.0, np.diag([0.1, 0.2, 0.2]), [0.3, 0, 0], {"end": Marker.rigid([0.6, 0.0, 0.0])})
    beam = beam_body(BEAM, BeamFunctions(y=2, z=0, axial=0, torsion=0), damping=ModalDamping(0.02))
    return System(
        {"base": rigid_body(1.0, np.eye(3)), "arm": arm, "beam": beam},
        (
            prismatic("base", axis=[0, 1, 0], motion=(strength,), name="ride"),
            revolute("arm", "base", name="hinge", q0=[-1.2], damping=np.array([0.8])),
            weld("beam", "arm", parent_marker="end", child_marker="root"),
        ),
        environment=Environment(gravity=np.array([0.0, -9.81, 0.0])),
        loads=(Load("motor", "arm", torque=np.array([0.0, 0.0, 3.0])),),
    )


INPUTS = ("loads/motor/torque:z", "markers/beam.tip/force:y", "motions/ride.slide")
OUTPUTS = ("q", "bodies/arm/rate:z", "markers/beam.tip/position", "markers/beam.tip/velocity:y")


@pytest.fixture(scope="module")
def arm():
    return linear_model(swinging(), INPUTS, OUTPUTS)


def test_inputs_and_outputs_are_derivatives_of_the_motion(arm):
    """Differences of the compiled rate and channels, of another formulation and step, to 1e-7 of the largest entry."""
    names = [name for name, _ in arm.states]
    n = len(arm.mass)
    for k, (quantity, body, marker) in enumerate((("torque", "arm", "origin"), ("force", "beam", "tip"))):
        axis = 2 if quantity == "torque" else 1
        rates = []
        for sign in (1.0, -1.0):
            push = Load("x", body, marker, "marker", **{quantity: 0.5 * sign * np.eye(3)[axis]})
            system = arm.model.system
            model = compile_system(type(system)(**{**vars_of(system), "loads": (*system.loads, push)}))
            rates.append(model.parts(model.state_rate(0.0, arm.x))[1])
        wanted = rates[0] - rates[1]
        free = [i for i, (name, _) in enumerate(arm.model.system.velocity_names()) if name in names[n : 2 * n]]
        assert arm.B[n : 2 * n, k] == pytest.approx(wanted[free], rel=0, abs=1e-7 * np.abs(wanted).max())
    step = 3e-5
    place = names.index("hinge.angle")
    q = [name for name, _ in arm.model.system.coordinate_names()].index("hinge.angle")
    seen = [arm.model.observe(np.zeros(1), (arm.x + s * step * np.eye(arm.model.n_x)[q])[None]) for s in (1, -1)]
    tip = [one["markers/beam.tip/position"][0] for one in seen]
    first = [name for name, _ in arm.outputs].index("markers/beam.tip/position:x")
    wanted = (tip[0] - tip[1]) / (2 * step)
    assert arm.C[first : first + 3, place] == pytest.approx(wanted, abs=1e-7 * np.abs(wanted).max())


def vars_of(system: System) -> dict:
    """The fields of a system."""
    return {key: getattr(system, key) for key in system.__dataclass_fields__}


def with_motor(system: System, torque: float) -> System:
    """The system with so much more torque."""
    motor = Load("motor", "arm", torque=np.array([0.0, 0.0, 3.0 + torque]))
    return type(system)(**{**vars_of(system), "loads": (motor,)})


def test_linear_and_nonlinear_response_differ_at_second_order(arm):
    """A step of torque for half a second: an error that falls four times when the step is halved."""
    steps, errors, end = (0.4, 0.2, 0.1), [], 0.5
    row = [name for name, _ in arm.outputs].index("bodies/arm/rate:z")
    wide = np.zeros((len(arm.A) + 1,) * 2)
    wide[:-1, :-1], wide[:-1, -1] = arm.A, arm.B[:, 0]
    linear = arm.C[row] @ expm(wide * end)[:-1, -1]
    for step in steps:
        model = compile_system(with_motor(arm.model.system, step))
        full = solve_ivp(model.state_rate, (0, end), arm.x, rtol=1e-11, atol=1e-13, method="DOP853").y[:, -1]
        seen = model.observe(np.array([end]), full[None])["bodies/arm/rate"][0, 2]
        errors.append(abs(seen - linear * step))
    slope = np.polyfit(np.log(steps), np.log(errors), 1)[0]
    assert slope == pytest.approx(2.0, abs=0.1) and errors[-1] < 0.05 * abs(linear * steps[-1])


def test_the_response_to_a_ridden_slide_is_that_of_a_simulated_sweep(arm):
    """Small sines of the slide's place below, near and beyond resonances; a period, begun in the steady answer."""
    row = [name for name, _ in arm.outputs].index("bodies/arm/rate:z")
    n, free = len(arm.mass), np.array([1, 2, 3])  # the slide stands first
    for omega in (2.0, 4.5, 9.0, 25.0):
        size = 1e-4 / omega
        sway = -(omega**2) * np.linalg.solve(1j * omega * np.eye(len(arm.A)) - arm.A, arm.B[:, 2])
        x = arm.x.copy()
        x[free] += size * sway[:n].imag
        x[arm.model.n_q + free] += size * sway[n : 2 * n].imag
        shaken = swinging(Profile(np.zeros(1), np.zeros((1, 1)), np.array([[size, omega, 0.0]])))
        model = compile_system(shaken)
        times = 2 * np.pi / omega * np.linspace(0, 1, 33)[:-1]
        found = solve_ivp(model.state_rate, (0, times[-1]), x, t_eval=times, rtol=1e-9, atol=1e-13, method="DOP853")
        rate = model.observe(times, found.y.T)["bodies/arm/rate"][:, 2]
        phasor = 2j * np.mean(rate * np.exp(-1j * omega * times)) / size  # of size sin(omega t)
        wanted = -(omega**2) * arm.frequency_response(np.array([omega]))[0, row, 2]
        assert phasor == pytest.approx(wanted, abs=3e-4 * abs(wanted))


def test_a_steady_spin_has_the_poles_of_its_modes():
    beam = beam_body(BEAM, BeamFunctions(y=2, z=2, axial=0, torsion=0), strain="condensed")
    spun = System({"beam": beam}, (weld("beam", child_marker="root"),), frame=Frame("spinning", np.array([0, 0, 3.0])))
    model = linear_model(spun, ["markers/beam.tip/force"], ["markers/beam.tip/deflection"])
    assert model.inputs[2] == ("markers/beam.tip/force:z", "N") and len(model.outputs) == 3
    assert model.modes is not None
    assert sorted(p.value.imag for p in poles_of(model)) == pytest.approx(
        sorted(model.modes.eigenvalues.imag), rel=1e-7
    )
    assert {p.name for p in poles_of(model)} == set(model.modes.names)
    gyroscopic = model.damping - model.damping.T
    assert np.abs(gyroscopic + gyroscopic.T).max() < 1e-9


def test_an_instant_of_a_motion_has_the_derivative_of_the_rate():
    system = swinging()
    model = compile_system(system)
    x = model.x0 + 0.3 * np.sin(np.arange(model.n_x))
    x[0] = x[model.n_q] = 0.0  # the slide is held
    found = linear_model(system, ["loads/motor/torque:z"], ["q"], at=1.5, state=x)
    assert found.about is None and found.t == 1.5
    free = [k for k in range(model.n_x) if k not in (0, model.n_q)]
    steps = 1e-6 * np.eye(model.n_x)[free]
    wanted = np.column_stack(
        [(model.state_rate(1.5, x + e) - model.state_rate(1.5, x - e))[free] / 2e-6 for e in steps]
    )
    assert pytest.approx(wanted, abs=1e-6 * np.abs(wanted).max()) == found.A


def test_a_closed_loop_is_linear_about_the_state_that_is_given_wherever_it_starts():
    away = compile_system(four_bar(speed=0.0, start=(1.6, 0.1, 1.9))).x0
    found, wanted, other = (
        linear_model(four_bar(speed=0.0, start=start), ["joints/drive.angle/effort"], ["bodies/rocker/rate:z"], at=0.0,
                     state=x)
        for start, x in (((0.3, 0.4, 1.6), away), ((1.6, 0.1, 1.9), away), ((0.3, 0.4, 1.6), None))
    )  # fmt: skip
    assert found.A == pytest.approx(wanted.A) and found.B == pytest.approx(wanted.B)
    assert found.C == pytest.approx(wanted.C) and found.D == pytest.approx(wanted.D)
    assert np.abs(found.C - other.C).max() > 0.1


@pytest.mark.slow
def test_commands_of_a_sampled_controller_are_inputs():
    law = Controller("law", lambda t, seen, memory: (np.zeros(1), memory), 0.1, (), {"torque": "N m"})

    def motor(seen, out):
        out.effort[0] = 2.0 * seen.input[0]

    effectors = (Effector("motor", motor, freedoms=("axle.angle",), inputs=("law.torque",)), law)
    model = linear_model(hub_and_beam(effectors=effectors))
    effort = linear_model(hub_and_beam(), ["joints/axle.angle/effort"], [])
    assert model.inputs == (("effectors/law/torque", "N m"),)
    assert 2.0 * effort.B == pytest.approx(model.B, rel=1e-8)


def test_a_balanced_truncation_keeps_its_bound_and_the_rigid_motion():
    system = hub_and_beam()
    damped = {
        **system.bodies,
        "beam": beam_body(BEAM, BeamFunctions(y=8, z=0, axial=0, torsion=0), damping=ModalDamping(0.01)),
    }
    model = linear_model(System(damped, system.joints), ["joints/axle.angle/effort"], ["bodies/hub/rate:z"])
    small = balanced_truncation(model, 4)
    omega = response_grid(model)
    error = np.abs(small.frequency_response(omega) - model.frequency_response(omega)).max()
    assert len(small.A) == 6 and 0 < error <= small.bound * (1 + 1e-6)
    assert small.bound < 0.2 * np.abs(model.frequency_response(np.array([18.0]))).max() * 100
    modal = modal_truncation(model, 100.0)
    low = omega[omega < 2.0]
    assert modal.frequency_response(low) == pytest.approx(model.frequency_response(low), rel=1e-4)
    with pytest.raises(ValueError, match=r"keeps none of the poles|keeps all of the poles"):
        modal_truncation(model, 1e9)
    with pytest.raises(ValueError, match=r"to 99 states was requested; .* Take a number from 1 to"):
        balanced_truncation(model, 99)


def test_an_undamped_model_is_not_balanced():
    model = linear_model(hub_and_beam(), ["joints/axle.angle/effort"], ["bodies/hub/rate:z"])
    with pytest.raises(ValueError, match=r"Hz is not damped. Give bodies and joints damping"):
        balanced_truncation(model, 4)


@pytest.mark.parametrize("kind", ["mat", "npz", "h5"])
def test_a_saved_model_is_read_back(arm, kind, tmp_path):
    path = save_model(arm, tmp_path / f"arm.{kind}")
    if kind == "mat":
        from scipy.io import loadmat

        read = loadmat(path, simplify_cells=True)
        names = list(read["inputs"])
    elif kind == "npz":
        read = np.load(path)
        names = [str(name) for name in read["inputs"]]
    else:
        import h5py

        read = h5py.File(path)
        names = [name.decode() for name in read["inputs"][:]]
    assert names == list(INPUTS)
    for key, value in {"A": arm.A, "B": arm.B, "C": arm.C, "D": arm.D, "M": arm.mass}.items():
        assert np.array_equal(np.asarray(read[key]), value)
    with pytest.raises(FileExistsError):
        save_model(arm, path)
    with pytest.raises(ValueError, match=r"written as \.mat, \.npz, \.h5; arm\.csv"):
        save_model(arm, tmp_path / "arm.csv")


def test_python_control_has_the_same_poles_or_is_missed(arm):
    try:
        import control  # noqa: F401
    except ImportError:
        with pytest.raises(ImportError, match="python-control is not installed; pip install control"):
            arm.to_control()
        return
    assert sorted(arm.to_control().poles().real) == pytest.approx(sorted(arm.eigenvalues().real))


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (
            {"inputs": ["loads/moter/torque:z"]},
            "has no input 'loads/moter/torque:z'; did you mean 'loads/motor/torque:z'?",
        ),
        ({"outputs": ["bodies/arm/rat"]}, "has no output 'bodies/arm/rat'; did you mean 'bodies/arm/rate'?"),
        ({"outputs": ["bodies/arm/rate:w"]}, "channel 'bodies/arm/rate' has no component 'w'; known are 'x', 'y', 'z'"),
        ({"state": np.zeros(3)}, r"the state has the shape \(3,\); expected"),
    ],
)
def test_mistakes_are_answered(words, sentence):
    with pytest.raises((KeyError, ValueError), match=sentence.replace("?", r"\?")):
        linear_model(swinging(), **words)


def test_a_response_is_refused_at_an_undamped_pole():
    model = StateSpace(
        np.array([[0.0, 2.0], [-2.0, 0.0]]), np.eye(2), np.eye(2), np.zeros((2, 2)), *[(("a", "1"), ("b", "1"))] * 3
    )
    with pytest.raises(ValueError, match="undamped pole at 2 rad/s"):
        model.frequency_response(np.array([2.0]))
    with pytest.raises(KeyError, match="has no output 'c'"):
        model.selected(outputs=["c"])


def test_poles_of_a_spun_body_are_named_one_by_one():
    """Its wobble in body axes is at Omega sqrt((C - A) (C - B) / A B), the axis of its spin tilts at Omega."""
    A, B, C, Omega = 1.0, 2.0, 2.5, 0.5
    body = rigid_body(2.0, np.diag([A, B, C]), [0.1, 0.2, -0.1])
    found = poles_of(linear_model(System({"b": body}, (free("b"),), frame=Frame("spinning", np.array([0, 0, Omega])))))
    named = sorted((one.name, one.rigid, round(one.value.imag, 6)) for one in found)
    assert named == [
        ("spin", True, 0.0),
        ("spin", True, 0.0),
        ("tilt of the spin axis", True, Omega),
        ("translation across the spin axis", True, Omega),
        ("translation across the spin axis", True, Omega),
        ("translation along the spin axis", True, 0.0),
        ("translation along the spin axis", True, 0.0),
        ("wobble", False, round(Omega * np.sqrt((C - A) * (C - B) / (A * B)), 6)),
    ]
