"""How near the loads of a system are to what buckles its bodies, and what their strain does not know of that."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from femflex.case.builders.load_buckling import NEAR
from femflex.dynamics import compile_system
from femflex.system import Load, System
from femflex.warning import PhysicsWarning

Array = NDArray[np.float64]

BOWED = 0.9  # of what buckles a body: condensed strain, which shortens to second order, bends 1.5 % too little at 0.95


@dataclass(frozen=True)
class Nearness:
    """A load at its largest, and the part that it is of the same load at which its body buckles."""

    load: str
    size: str
    part: float

    def __str__(self) -> str:
        return f"load {self.load!r} ({self.size}) is {self.part:.3g} of what buckles the body"


def nearest(system: System) -> dict[str, Nearness]:
    """Of each body that buckles under a load of its own at NEAR times it or before, the load that is nearest to it.

    A load is taken at its largest, as it points in the axes of its body where that starts.
    """
    loads = [load for load in system.loads if load.frame != "marker" and system.bodies[load.body].buckling is not None]
    if not loads:
        return {}
    found: dict[str, Nearness] = {}
    for load, force, torque in at_largest(system, loads):
        buckling = system.bodies[load.body].buckling
        assert buckling is not None
        part = 1.0 / buckling(load.marker, force, torque)
        if part >= 1.0 / NEAR and (load.body not in found or part > found[load.body].part):
            found[load.body] = Nearness(load.name, _size(force, torque), part)
    return found


def at_largest(system: System, loads: Sequence[Load]) -> list[tuple[Load, Array, Array]]:
    """Loads with force and torque (3,) where they are largest, as they point in axes of their bodies at the start."""
    held = tuple(_largest(load) for load in loads)
    model = compile_system(replace(system, loads=held, reactions=False, sights=()))
    seen = model.observe(np.zeros(1), model.x0[None])
    values = [[np.asarray(seen[f"loads/{load.name}/{what}"][0]) for what in ("force", "torque")] for load in loads]
    return [(load, force, torque) for load, (force, torque) in zip(loads, values, strict=True)]


def too_stiff(near: Nearness) -> str:
    """What condensed strain lacks under that load; nothing where it is far enough from buckling."""
    if near.part < BOWED:
        return ""
    return (
        f"{near}: above {BOWED:g} of it condensed strain bends too little, for it shortens by no more than the second "
        "order; nonlinear strain or segments are right there"
    )


def warn_of_buckling(system: System, near: dict[str, Nearness]) -> None:
    """Warn of bodies whose strain, linear or condensed, does not know what such a load does to them."""
    for name, found in near.items():
        form = system.bodies[name].strain_form
        text = too_stiff(found) if form == "condensed" else f"{found}; linear strain does not know"
        if form != "nonlinear" and text:
            warnings.warn(f"bodies.{name}: {text}", PhysicsWarning, stacklevel=3)


def _largest(load: Load) -> Load:
    """The load held where it is largest."""
    if load.times is None:
        return load
    row = int(np.argmax(np.linalg.norm(load.force, axis=1) + np.linalg.norm(load.torque, axis=1)))
    return replace(load, times=None, force=load.force[row], torque=load.torque[row])


def _size(force: np.ndarray, torque: np.ndarray) -> str:
    sizes = ((float(np.linalg.norm(force)), "N"), (float(np.linalg.norm(torque)), "N m"))
    return " and ".join(f"{size:.4g} {unit}" for size, unit in sizes if size > 0.0) or "0 N"
