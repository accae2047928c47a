"""The state of rest about which a craft is linearised, and the system that is at rest there."""

from __future__ import annotations

from dataclasses import replace

from femflex.arrays import Array
from femflex.dynamics.linear.equilibrium import Equilibrium, EquilibriumError, equilibrium
from femflex.dynamics.linear.frozen import frozen_system
from femflex.dynamics.linear.states import resting_state
from femflex.dynamics.linear.system_modes import without_variation
from femflex.dynamics.model import Model
from femflex.system import System


def rest_equilibrium(system: System, at: float | None = None) -> tuple[Equilibrium, tuple[str, ...]]:
    """The equilibrium nearest to the initial coordinates, and the names of loads and motions that do not act in it.

    at: time [s] at which loads and prescribed motions are taken. Left out, loads given over time do not act, prescribed
    motions stay at their initial values, and where there is no equilibrium under the constant loads these do not act
    either. Raises as `femflex.equilibrium`.
    """
    if at is not None:
        return equilibrium(system, at), ()
    constant, left_out = without_variation(system)
    try:
        return equilibrium(constant), left_out
    except EquilibriumError:
        if not constant.loads:
            raise
    unloaded = tuple(f"load {load.name!r} (no equilibrium under it)" for load in constant.loads)
    return equilibrium(replace(constant, loads=())), left_out + unloaded


def rest_system(system: System, at: float | None, about: Equilibrium) -> System:
    """The system under the loads of the equilibrium; loads that do not act there are zero, rotors keep their motors."""
    if at is not None:
        return frozen_system(system, at)
    return frozen_system(with_loads_of(without_variation(system)[0], system, about))


def with_loads_of(still: System, system: System, about: Equilibrium) -> System:
    """The system `still` with the loads of the equilibrium, the other loads of the system at zero."""
    loads = {load.name: load for load in about.moving.loads}
    return replace(still, loads=tuple(loads.get(load.name, load.steady()) for load in system.loads))


def rest_state(about: Equilibrium, model: Model) -> Array:
    """The state (n_x,) [SI] of the model at the equilibrium, rotors as they start."""
    return resting_state(about.model, about.x, model)
