"""Effectors at one marker: their forces are added up and their motion is found once, with the same answers."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from support.random_systems import random_body

from femflex.dynamics import compile_system
from femflex.dynamics.effectors.acting import Given, given_size
from femflex.dynamics.effectors.lowering import grouped
from femflex.integrate import Esdirk4
from femflex.system import Effector, System, free, reaction_wheel, thruster

AXES = np.random.default_rng(4).normal(size=(6, 3))
PLACES = tuple(f"place{k}" for k in range(6))


def follower(seen, out):
    """A state that follows an input at a rate given by it, and pushes along x."""
    out.zdot[0] = seen.input[0] * (1.0 - seen.z[0])
    out.force[0, 0] = seen.z[0]


def constant(seen, out):
    """A state that stays."""


def craft(places):
    """A free flexible body with wheels, thrusters and states that take inputs, each at its own marker of `places`."""
    body = random_body(np.random.default_rng(3), n=4)[0]
    marker = next(iter(body.markers.values()))
    body = replace(body, markers={**body.markers, **dict.fromkeys(PLACES, marker)})
    wheels = [
        reaction_wheel(f"w{k}", "b", 1e-3, marker=places[k], axis=AXES[k], torque=1e-3, initial_speed=10.0 + k)
        for k in range(2)
    ]
    jets = [
        thruster(f"t{k}", "b", 0.1 * (k + 1), marker=places[2 + k], axis=AXES[2 + k], profile=([0.0], [1.0]))
        for k in range(2)
    ]
    rates = {"slow": 0.5, "fast": 300.0}
    sources = [Effector(f"source_{name}", constant, states={"z": "1"}) for name in rates]
    lags = [
        Effector(name, follower, markers=(("b", places[4 + k]),), states={"z": "1"}, inputs=(f"source_{name}.z",))
        for k, name in enumerate(rates)
    ]
    z0 = {f"source_{name}.z": rate for name, rate in rates.items()}
    return compile_system(System({"b": body}, (free("b"),), effectors=(*wheels, *jets, *sources, *lags), z0=z0))


def rate(model, t, x):
    """Rates of a state."""
    dx = np.empty_like(x)
    model.rate(t, x, dx, model.table, model.pool, model.work)
    return dx


TOGETHER, APART = (PLACES[0],) * 6, PLACES


def test_rates_are_those_of_effectors_at_markers_of_their_own():
    together, apart = craft(TOGETHER), craft(APART)
    x = together.x0 + np.random.default_rng(1).normal(size=together.x0.size) * 0.1
    a, b = (rate(model, 0.3, x) for model in (together, apart))
    assert a == pytest.approx(b, rel=1e-12, abs=1e-12 * np.abs(b).max())
    assert np.abs(a[together.n_q : together.n_q + together.n_u]).max() > 0.01


def test_the_force_of_each_stands_in_the_ledger_as_at_markers_of_their_own():
    together, apart = craft(TOGETHER), craft(APART)
    x = np.stack([together.x0, together.x0 + 0.1])
    ours, theirs = (model.terms(np.array([0.0, 0.5]), x) for model in (together, apart))
    assert ours.keys() == theirs.keys()
    for name, row in ours.items():
        assert row == pytest.approx(theirs[name], rel=1e-11, abs=1e-11 * np.abs(row).max()), name


def test_implicit_steps_use_the_input_of_each_in_its_own_jacobian():
    """The Jacobian of the stiff state depends on its input; with that of another Newton takes more steps."""
    counts = []
    for places in (TOGETHER, APART, (*TOGETHER[:4], PLACES[5], PLACES[4])):
        model = craft(places)
        found = Esdirk4(rtol=1e-6, atol=1e-8).solve(model, np.linspace(0.0, 1.0, 3), model.x0)
        counts.append(found.steps.evaluations)
        names = [name for name, _ in model.system.state_names()]
        z = found.states[-1, model.n_q + model.n_u :]
        assert z[names.index("slow.z")] == pytest.approx(1.0 - np.exp(-0.5), abs=1e-4)
        assert z[names.index("fast.z")] == pytest.approx(1.0, abs=1e-4)
    assert counts[0] <= 1.02 * min(counts[1:])


def test_what_an_effector_writes_has_its_place_and_no_more():
    """Wrenches at markers, forces of freedoms, zdot, channels and the four accounts, one after another."""
    shapes = {"force": 2 * 3, "torque": 2 * 3, "effort": 5, "zdot": 4, "channel": 7}
    assert given_size(2, 5, 4, 7) == sum(shapes.values()) + len(Given._fields) - len(shapes)


def test_effectors_of_one_marker_and_no_freedom_are_grouped_by_it():
    given = [
        SimpleNamespace(markers=markers, freedoms=freedoms)
        for markers, freedoms in (
            (["b.tip"], []), (["a.tip"], []), (["b.tip"], ["hinge"]),
            (["b.tip", "a.tip"], []), ([], []), (["b.tip"], []),
        )
    ]  # fmt: skip
    assert grouped(given) == [[0, 5], [1]]
