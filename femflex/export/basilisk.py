"""Craft for Basilisk: a rigid hub with modal oscillators, each a LinearSpringMassDamper.

Basilisk's wheel has no constructor of StateEffector for Python, so that no state effector of M, D, K and coupling can
be derived there. Every mode with the hub fixed is a point mass m that slides along a unit vector e at r: the hub feels

    m e = sqrt(m) p,    m r x e = sqrt(m) h_n,    m = |p|^2,    r = p x h / |p|^2

with the participation p of its translation and h of its rotation (kg^1/2, kg^1/2 m). The part of h along p, a screw, is
not represented: it is the error of the mode. The hub is what remains of the craft's mass and inertia, which are thus
exact. A point mass at r counts about all axes, a mode about one, so that the inertia of the hub alone need not be
positive. Basilisk checks it when a simulation is initialised, and it is set behind that.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.linalg import eigh

from femflex.arrays import Array
from femflex.export.multibody.lumped import skew
from femflex.extras import require
from femflex.studies.linear import linear_model
from femflex.summary import Rows, Summarised
from femflex.system import System

RIGID = 6  # coordinates of the hub
LEAST = 1e-7  # of the craft's inertia, below which the effective inertia of a mode is left out
FARTHEST = 1e3  # radii of gyration of the craft, at most, at which an oscillator without translation stands


@dataclass(frozen=True, eq=False)
class Oscillator:
    """A point mass [kg] at a position (3,) [m] that slides along a direction (3,).

    stiffness [N/m], damping [N s/m]
    frequency [Hz] with the hub fixed;  error  part of its participation in rotation that it does not have
    """

    mass: float
    position: Array
    direction: Array
    stiffness: float
    damping: float
    frequency: float
    error: float


@dataclass(frozen=True, eq=False, repr=False)
class OscillatorCraft(Summarised):
    """A hub with modal oscillators, in axes of the root body, from its origin.

    mass [kg], center_of_mass (3,) [m], inertia (3, 3) about it [kg m^2]  of the hub alone
    left_out  frequencies [Hz] of modes that the hub does not feel
    damping_error  largest damping between two modes, over that of the modes
    """

    mass: float
    center_of_mass: Array
    inertia: Array
    oscillators: Sequence[Oscillator]
    left_out: Sequence[float]
    damping_error: float

    def summary(self) -> tuple[str, Rows]:
        """Hub, oscillators and their errors."""
        rows = [("hub", f"{self.mass:.6g} kg, {len(self.left_out)} modes left out")]
        rows += [(f"{one.frequency:.5g} Hz", f"{one.mass:.5g} kg, error {one.error:.1e}") for one in self.oscillators]
        return "Hub with modal oscillators", rows

    def to_basilisk(self, tag: str = "craft") -> tuple[Any, list[Any]]:
        """A Basilisk Spacecraft, and its effectors, which are attached to it.

        Add both to a task, the effectors first. Raises MissingExtra without Basilisk.
        """
        require("bsk", "craft of Basilisk")
        from Basilisk.simulation import linearSpringMassDamper, spacecraft

        craft, effectors = spacecraft.Spacecraft(), []
        craft.ModelTag = tag
        craft.hub.mHub, craft.hub.r_BcB_B = self.mass, self.center_of_mass[:, None].tolist()
        craft.hub.IHubPntBc_B = np.eye(3).tolist()
        for k, one in enumerate(self.oscillators):
            effector = linearSpringMassDamper.LinearSpringMassDamper()
            effector.ModelTag = f"{tag}-mode{k + 1}"
            effector.k, effector.c, effector.massInit = one.stiffness, one.damping, one.mass
            effector.r_PB_B, effector.pHat_B = one.position[:, None].tolist(), one.direction[:, None].tolist()
            effector.rhoInit = effector.rhoDotInit = 0.0
            craft.addStateEffector(effector)
            effectors.append(effector)
        return craft, effectors

    def set_inertia(self, craft: Any) -> None:
        """Set the inertia of the hub of a Basilisk Spacecraft, after InitializeSimulation."""
        craft.hub.IHubPntBc_B = self.inertia.tolist()


def oscillator_craft(system: System) -> OscillatorCraft:
    """The modal oscillators of a craft that is free to move, about rest without loads.

    Raises ValueError for a craft whose hub is not free, with effectors that have states, or whose oscillators are
    heavier than it; and as `linear_model`.
    """
    root = system.joint_of(system.root)
    if root.kind != "free":
        raise ValueError(f"the root body {system.root!r} is not free to move; a spacecraft of Basilisk is")
    model = linear_model(replace(system, loads=()), inputs=[], outputs=[])
    n = len(model.mass)
    skewed = np.abs(model.damping - model.damping.T).max()
    if len(model.A) != 2 * n or skewed > 1e-9 * max(1.0, np.abs(model.damping).max()):
        raise ValueError("the craft has effectors with states, or spins; a hub with oscillators has neither")
    M = model.mass
    omega2, Phi = eigh(model.stiffness[RIGID:, RIGID:], M[RIGID:, RIGID:])
    if not (omega2 > 0.0).all():
        raise ValueError("a joint of the craft has no stiffness, so that a mode has no frequency; lock it")
    participation, D = M[:RIGID, RIGID:] @ Phi, Phi.T @ model.damping[RIGID:, RIGID:] @ Phi
    mass, first, J = M[0, 0], _axis(M[3:6, :3]), M[3:6, 3:6]
    gyration = float(np.sqrt(np.trace(J) / mass / 2.0))
    scale = np.array([1.0, 1.0, 1.0, *[1.0 / gyration] * 3])
    oscillators, left_out = list[Oscillator](), list[float]()
    for k, w2 in enumerate(omega2):
        p, h, frequency = participation[:3, k], participation[3:, k], float(np.sqrt(w2) / (2.0 * np.pi))
        size = float(np.linalg.norm(scale * participation[:, k]))
        if size**2 < LEAST * mass:
            left_out.append(frequency)
            continue
        p, missing = _with_translation(p, h, size / FARTHEST)
        m = float(p @ p)
        lost = np.append(missing, float(h @ p) / np.sqrt(m) / gyration)
        position = np.cross(p, h) / m
        error, stiffness = float(np.linalg.norm(lost) / size), m * float(w2)
        oscillators.append(Oscillator(m, position, p / np.sqrt(m), stiffness, m * float(D[k, k]), frequency, error))
    masses = np.array([one.mass for one in oscillators])
    places = np.array([one.position for one in oscillators]).reshape(-1, 3)
    hub = float(mass - masses.sum())
    if not hub > 0.0:
        raise ValueError(
            f"the oscillators have {masses.sum():.4g} kg together and the craft {mass:.4g} kg; keep fewer modes, or "
            "modes of fewer bodies"
        )
    centre = (first - masses @ places) / hub
    inertia = J - _about_origin(masses, places) - _about_origin(np.array([hub]), centre[None])
    off = np.abs(D - np.diag(np.diag(D))).max(initial=0.0) / max(np.abs(np.diag(D)).max(initial=0.0), 1e-300)
    return OscillatorCraft(hub, centre, inertia, oscillators, left_out, float(off))


def _with_translation(p: Array, h: Array, least: float) -> tuple[Array, float]:
    """p with at least this size, across h where it has to be added, and the size of what was added."""
    if np.linalg.norm(p) >= least:
        return p, 0.0
    across = np.cross(h, np.eye(3)[int(np.argmin(np.abs(h)))])
    direction = p if np.linalg.norm(p) > 1e-3 * least else across
    longer = direction / np.linalg.norm(direction) * least
    return longer, float(np.linalg.norm(longer - p))


def _axis(product: Array) -> Array:
    """The first moment s (3,) of the block s~ of a mass matrix."""
    return np.array([product[2, 1] - product[1, 2], product[0, 2] - product[2, 0], product[1, 0] - product[0, 1]]) / 2.0


def _about_origin(masses: Array, places: Array) -> Array:
    """Inertia (3, 3) of point masses about the origin [kg m^2]."""
    tilde = skew(places)
    return np.asarray(np.einsum("p,pab,pcb->ac", masses, tilde, tilde))
