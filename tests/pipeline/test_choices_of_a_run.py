"""The integrator of a run with its tolerances, advice written into cases, and advice on motion that ran away."""

from __future__ import annotations

import tomllib
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from femflex.advice.advice import Advice
from femflex.body import rigid_body
from femflex.case import CaseError, parse_case, read_case
from femflex.dynamics import compile_system
from femflex.integrate import Block
from femflex.integrate import resume as head
from femflex.pipeline.advised_case import advised_text, changed_keys
from femflex.pipeline.decisions import build_system
from femflex.pipeline.guard import MotionGuard, Singularities
from femflex.pipeline.integrator import chosen_integrator
from femflex.reduction import BeamFunctions, UniformBeam, beam_body
from femflex.system import Joint, System, revolute
from femflex.warning import PhysicsWarning

# the integrator

TIMES = np.linspace(0.5, 30.5, 301)
HZ = 37.0


@pytest.fixture(scope="module")
def wheel() -> Any:
    """A wheel of 0.5 kg m^2 on a spring with a natural frequency of 37 Hz."""
    stiffness = 0.5 * (2 * np.pi * HZ) ** 2
    joint = revolute("wheel", name="axle", stiffness=np.array([stiffness]), u0=[0.1])
    return compile_system(System({"wheel": rigid_body(2.0, 0.5 * np.eye(3))}, (joint,)))


def settings(wheel: Any, more: str = "", begun: str = "") -> tuple[Any, str]:
    text = f"[run]\nduration = 30\n{more}\n[bodies.wheel]\nkind = 'rigid'\nmass = 2\ninertia = [0.5, 0.5, 0.5]\n"
    return chosen_integrator(parse_case(text), wheel, TIMES, begun)


@pytest.mark.parametrize(
    ("more", "rtol"),
    [("", 1e-11), ("rtol = 3e-7", 3e-7), ("integrator = 'esdirk4'", 1e-9), ("integrator = 'generalized_alpha'", 1e-6)],
)
def test_the_absolute_tolerance_follows_the_relative_one_and_the_size_of_states(wheel: Any, more: str, rtol: float):
    """A tenth of the relative tolerance times the size: 1 rad, and 2 pi over the 30 s of the run for the rate."""
    found, _ = settings(wheel, more)
    assert found.rtol == rtol and found.max_step == np.inf
    np.testing.assert_allclose(found.atol, 0.1 * rtol * np.array([1.0, 2 * np.pi / 30.0]), rtol=1e-12)


def test_settings_are_handed_to_the_method(wheel: Any):
    found, _ = settings(wheel, "rtol = 1e-5\natol = 2e-6\nmax_step = 0.02")
    assert (found.name, found.rtol, found.atol, found.max_step) == ("dop853", 1e-5, 2e-6, 0.02)
    found, why = settings(wheel, "integrator = 'generalized_alpha'\nstep = 0.01\nrho = 0.3")
    assert (found.name, found.step, found.rho) == ("generalized_alpha", 0.01, 0.3)
    assert why.startswith("generalized_alpha (requested)")


@pytest.mark.parametrize(
    ("more", "method", "key", "value"),
    [("rho = 0.25", "dop853", "rho", "0.25"), ("integrator = 'dop853'\nstep = 0.125", "dop853", "step", "0.125")],
)
def test_a_setting_that_the_method_does_not_have_is_refused(wheel: Any, more: str, method: str, key: str, value: str):
    with pytest.raises(CaseError) as caught:
        settings(wheel, more)
    (problem,) = caught.value.problems
    assert problem.where == f"run.{key}"
    assert problem.text == f"found {value}, but {method} has no {key}; leave it out, or select another integrator"


def test_a_run_goes_on_with_the_method_that_began_it(wheel: Any):
    found, why = settings(wheel, "integrator = 'dop853'", begun="esdirk4")
    assert found.name == "esdirk4" and why.startswith("esdirk4 (of the run so far)")


def test_the_choice_is_reported_with_its_frequencies(wheel: Any):
    """The highest in the output is half of 10 rows a second; a band is in Hz."""
    for more, told in (("", "in the output 5 Hz"), ("band = 40", "wanted 40 Hz"), ("band = 36", "wanted 36 Hz")):
        assert f"the highest natural frequency is 37 Hz, the highest {told}" in settings(wheel, more)[1]


def test_a_free_length_is_solved_by_the_explicit_method_unless_another_is_requested():
    text = (
        "[run]\nduration = 3\nsamples = 4\n[bodies.rope]\nkind = 'deploying'\nfamily = 'tether'\nstock = 9\n"
        "mass_per_length = 0.4\nreel = { length = 2, tension = 3 }\n[[joints]]\nkind = 'weld'\nchild = 'rope'\n"
    )
    model = compile_system(build_system(parse_case(text)))
    for more, begun, told in (
        ("", "", "dop853 (the length of rope is free)"),
        ("integrator = 'esdirk4'\n", "", "esdirk4 (requested)"),
        ("", "esdirk4", "esdirk4 (of the run so far)"),
    ):
        case = parse_case(text.replace("samples = 4\n", "samples = 4\n" + more))
        found, why = chosen_integrator(case, model, np.linspace(0, 3, 4), begun)
        assert why.startswith(told) and found.name == told.split()[0]


# advice written into a case


def decided(case: Any, changes: dict[str, dict[str, Any]], advice: list[Advice]) -> Any:
    """What was decided of a case: keys of the reductions (or of the table) of its bodies."""
    bodies = dict(case.bodies)
    for name, keys in changes.items():
        own = {key: value for key, value in keys.items() if key == "strain"}
        inner = {key: value for key, value in keys.items() if key not in own}
        bodies[name] = bodies[name].model_copy(
            update=own | {"reduction": bodies[name].reduction.model_copy(update=inner)}
        )
    return SimpleNamespace(case=case.model_copy(update={"bodies": bodies}), advice=advice)


CHANGES = {"boom": {"strain": "nonlinear", "derivatives": 5, "joints": {"TIP": ["z", "ry"]}}}
ADVICE = [
    Advice("mast", "strain", "condensed", "it is the mast's"),
    Advice("boom", "strain", "nonlinear", "it bends by 12 %"),
    Advice("boom", "joints", {}, "two of them"),
]


def test_all_that_was_decided_is_written_with_its_reason(write_case: Any, craft: str):
    table = '[bodies.boom.reduction]\nmethod = "cantilever"\nclamp = "ROOT"\nmodes = 4\n'
    start, end = craft.index("reduction ="), craft.index("damping =")
    text = craft[:start] + craft[end:].replace("[[joints]]", table + "[[joints]]")
    case = read_case(write_case(text))
    found = decided(case, CHANGES, ADVICE)
    assert set(map(str, changed_keys(case, found.case))) == {
        "('boom', '', 'strain', 'nonlinear')",
        "('boom', 'reduction', 'derivatives', 5)",
        "('boom', 'reduction', 'joints', {'TIP': ['z', 'ry']})",
    }
    new = advised_text(case, found)
    assert 'strain = "nonlinear" # it bends by 12 %\n' in new and "derivatives = 5\n" in new
    assert 'joints = { TIP = ["z", "ry"] } # two of them\n' in new
    was, now = tomllib.loads(text), tomllib.loads(new)
    was["bodies"]["boom"]["strain"] = "nonlinear"
    was["bodies"]["boom"]["reduction"] |= {"derivatives": 5, "joints": {"TIP": ["z", "ry"]}}
    assert now == was
    assert advised_text(case, SimpleNamespace(case=case, advice=ADVICE)) == text  # type: ignore[arg-type]


def test_what_cannot_be_written_is_reported_key_by_key(write_case: Any, craft: str):
    """A body in an inline table has no table of its own to write into."""
    start, end = craft.index("[bodies.boom]"), craft.index("[[joints]]")
    lines = [line for line in craft[start:end].splitlines()[1:] if line]
    case = read_case(write_case("bodies.boom = { " + ", ".join(lines) + " }\n" + craft[:start] + craft[end:]))
    with pytest.raises(ValueError) as caught:
        advised_text(case, decided(case, CHANGES, ADVICE))
    head_, keys = str(caught.value).split(" Add by hand: ")
    assert head_ == (
        "craft.toml: the advice cannot be written into this case, because a body has no table of its own or has the "
        "key already."
    )
    assert sorted(keys.split("; ")) == [
        "bodies.boom.reduction.derivatives = 5",
        'bodies.boom.reduction.joints = { TIP = ["z", "ry"] }',
        'bodies.boom.strain = "nonlinear"',
    ]


# motion that ran away


@pytest.mark.parametrize(
    ("shape", "rate", "advice"),
    [
        (1, 0.5, "Its shape 2 at {own:.4g} Hz, {ratio:.3g} times the first, is a stretching mode, which bending "
                 "excites. The body turns at 0.5 rad/s, below its first frequency of {first:.4g} rad/s, so spin is not "
                 "the cause. Remove that mode, or set strain = 'condensed'."),
        (1, 0.0, "It does not turn. Check for a load in a wrong unit, and for buckling or snap-through: strain = "
                 "'nonlinear' follows these (with `responses` in the reduction of a curved body)."),
        (0, 0.5, "Check for a spin above the lowest frequencies of the body, or an unstable attitude."),
        (1, 20.0, "Check for a spin above the lowest frequencies of the body, or an unstable attitude."),
    ],
)  # fmt: skip
def test_advice_on_a_body_that_was_carried_off_follows_from_its_spin_and_shape(shape: int, rate: float, advice: str):
    """A beam of 2 m, 1 MN and 30 N m^2 that bends and stretches: pi / (2 L) sqrt(EA / mu) of the second."""
    body = beam_body(UniformBeam(2.0, 1e6, 20.0, 30.0, 20.0, 0.5), BeamFunctions(y=1, axial=1))
    model = compile_system(System({"boom": body}, (revolute("boom", child_marker="root", axis=[0, 0, 1]),)))
    states = np.zeros((2, 6))
    states[1, 1 + shape], states[:, 3] = 1e6, rate
    resume = np.concatenate([np.zeros(head.HEAD), states[-1]])
    resume[head.T] = 3.0
    error = MotionGuard(model).divergence(Block(np.array([1.0, 3.0]), states, resume))
    assert error is not None and error.t == 3.0 and error.coordinate == 1 + shape
    first, own = 1.8751**2 * np.sqrt(30.0 / 0.5) / 4.0, np.pi / 4 * np.sqrt(1e6 / 0.5)
    told = str(error).split("size of 2 m. ")[1]
    assert told == advice.format(own=own / (2 * np.pi), ratio=own / first, first=first)


def test_gimbal_lock_is_reported_of_turns_and_the_closest_time_counts():
    """A joint of three turns reports the angle that is left to 90 deg of its middle one."""
    joint = Joint("a", rotations=np.eye(3), q0=np.array([0.3, 0.4, 0.2]), name="gimbals")
    model = compile_system(System({"a": rigid_body(1.0, np.eye(3))}, (joint,)))
    (path,) = [path for path in model.channels if path.endswith("/singularity")]
    seen = Singularities(model)
    for start, left in ((0.0, [0.9, 0.04, 0.2]), (3.0, [0.5, 0.031, 0.04]), (6.0, [0.035, 0.6, 0.7])):
        seen.watch(start + np.arange(3.0), {path: np.array(left)})
    with pytest.warns(PhysicsWarning) as caught:
        seen.warn()
    assert [str(one.message) for one in caught] == [
        "joint 'gimbals' came within 0.031 rad of gimbal lock of its free turns at t = 4 s (below 0.05 rad coordinates "
        "turn fast, and steps are short for them alone). Choose a sequence of turns that stays clear of it."
    ]
    still = Singularities(model)
    still.watch(np.arange(3.0), {path: np.full(3, 0.05)})
    still.warn()
