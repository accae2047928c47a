"""Modal oscillators for Basilisk: against the mass matrix of the craft, and the slew of a case in Basilisk itself."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import eigh

import femflex
from femflex.export.basilisk import oscillator_craft
from femflex.studies.linear import linear_model


def test_oscillators_have_mass_inertia_and_frequencies_of_the_craft(slewed):
    """The mass matrix of hub and oscillators, from the velocities of each, and the frequencies of the free craft."""
    craft, model = oscillator_craft(slewed), linear_model(slewed, [], [])
    rows, weights = [], []
    n = len(craft.oscillators)
    for k, one in enumerate([None, *craft.oscillators]):
        place, mass = (craft.center_of_mass, craft.mass) if one is None else (one.position, one.mass)
        x, y, z = place
        turn = np.array([[0, z, -y], [-z, 0, x], [y, -x, 0]])  # velocity of the place by omega
        slide = np.zeros((3, n))
        if one is not None:
            slide[:, k - 1] = one.direction
        rows.append(np.hstack([np.eye(3), turn, slide]))
        weights.append(mass)
    M = sum(weight * row.T @ row for weight, row in zip(weights, rows, strict=True))
    M[3:6, 3:6] += craft.inertia
    assert M[:6, :6] == pytest.approx(model.mass[:6, :6], abs=1e-9 * model.mass[4, 4])
    K = np.diag([0.0] * 6 + [one.stiffness for one in craft.oscillators])
    found, expected = (
        np.sqrt(np.abs(eigh(*pair, eigvals_only=True))) for pair in ((K, M), (model.stiffness, model.mass))
    )
    assert found[6:] == pytest.approx(expected[6:], rel=2e-5)
    assert max(one.error for one in craft.oscillators) < 1.1e-3 and not craft.left_out


def test_slew_in_basilisk_is_that_of_femflex(slewed, tmp_path):
    """The torque of the case for 12 s, in steps of 2.5 ms of its own integrator."""
    pytest.importorskip("Basilisk")
    from Basilisk.simulation import extForceTorque
    from Basilisk.utilities import SimulationBaseClass, macros

    oscillators = oscillator_craft(slewed)
    simulation = SimulationBaseClass.SimBaseClass()
    simulation.CreateNewProcess("process").addTask(simulation.CreateNewTask("task", macros.sec2nano(0.0025)))
    craft, effectors = oscillators.to_basilisk()
    torque = extForceTorque.ExtForceTorque()
    craft.addDynamicEffector(torque)
    record = craft.scStateOutMsg.recorder(macros.sec2nano(0.05))
    for item in (*effectors, craft, torque, record):
        simulation.AddModelToTask("task", item)
    simulation.InitializeSimulation()
    oscillators.set_inertia(craft)
    for end, about_y in ((5.0, 40.0), (10.0, -40.0), (12.0, 0.0)):
        torque.extTorquePntB_B = [[0.0], [about_y], [0.0]]
        simulation.ConfigureStopTime(macros.sec2nano(end))
        simulation.ExecuteSimulation()
    with femflex.run("cases/panel_slew.toml", tmp_path / "run.h5") as run:
        rate = np.array(record.omega_BN_B)[:, 1]
        expected = np.interp(np.array(record.times()) * 1e-9, run.time, run["bodies/hub/rate"][:, 1])
        assert rate == pytest.approx(expected, abs=3e-6 * np.abs(expected).max())
