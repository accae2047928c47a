"""Watching the tension of tethers and membranes along a run: where and when they would go slack or wrinkle.

The tension of an element is a linear function of displacement: sigma = sigma_0 + c.x + C eps(y) with x what loads bring
about beyond the body's coordinates y. By reciprocity c.x = theta.F with K theta = c, less its part in the coordinates
(but those that only follow bending, derivatives: of them and of the squares of bending little is left);
theta is a displacement whose work is taken as that of a foreshortening (`femflex.advice.stiffening`): on the inertia of
spin, on weight and gravity gradient, on loads and on what is attached. The initial tension goes with the loads f0 of
the preload. Angular accelerations, and the vibration of other bodies, have no part in it.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from femflex.advice.bodies import KnownBodies
from femflex.advice.stiffening import OmittedStiffness
from femflex.arrays import Array, BoolArray, IntArray
from femflex.body import FlexibleBody, Foreshortening
from femflex.dynamics import Model
from femflex.fem.structure import Structure
from femflex.fem.tables import rows_of_elements
from femflex.fem.tension.strain import PRINCIPAL, UNITS, TensionStrain, lowest_principal
from femflex.reduction.boundary.markers import marker_rows
from femflex.reduction.boundary.supported import supported
from femflex.reduction.inertia.accelerations import work_of_accelerations
from femflex.reduction.modes.modeset import ModeSet
from femflex.reduction.origin import Meshed
from femflex.system import System
from femflex.warning import PhysicsWarning

WATCHED = 9  # elements of a member that are watched, from its first to its last
SLACK = 1e-3  # of the largest initial tension: compression up to which it is rounding and what is left out here


@dataclass(frozen=True, eq=False)
class Watched:
    """Elements of one member of a body.

    places (k, 3)   theirs [m]
    rest (k, s)     stress without loads, and with the body's coordinates at zero
    stiffnesses     (k s,), one for each stress: what takes off it along a run
    part            number of the member's part of the body's strain field
    """

    body: str
    block: TensionStrain
    part: int
    elements: IntArray
    places: Array
    rest: Array
    stiffnesses: tuple[OmittedStiffness, ...]


@dataclass(frozen=True)
class Slack:
    """Lowest tension that was seen of a member: its value, time, place and part of the watched elements."""

    value: float
    time: float
    place: tuple[float, float, float]


class TensionWatch:
    """Watches the tension of tethers and membranes, row by row, and warns where it falls below zero."""

    def __init__(self, model: Model, known: KnownBodies | None = None) -> None:
        self._system = model.system
        self._watched = [one for name in model.system.order for one in _of_body(model.system, name, known or {})]
        self._least: dict[int, Slack] = {}

    def watch(self, times: Array, channels: Mapping[str, Array]) -> None:
        """Take note of a block of rows (n_t, ...)."""
        for number, one in enumerate(self._watched):
            tension = self.tension(one, channels)
            row, element = np.unravel_index(int(np.argmin(tension)), tension.shape)
            x, y, z = (float(c) for c in one.places[element])
            seen = Slack(float(tension[row, element]), float(times[row]), (x, y, z))
            if number not in self._least or seen.value < self._least[number].value:
                self._least[number] = seen

    def tension(self, one: Watched, channels: Mapping[str, Array]) -> Array:
        """Tension [N], or lowest principal stress resultant [N/m], of watched elements along rows: (t, k)."""
        body = self._system.bodies[one.body]
        stress = np.stack([-each.gains(channels)[one.body] for each in one.stiffnesses], axis=1)
        stress = one.rest + stress.reshape(len(stress), *one.rest.shape)
        delta = channels.get(f"bodies/{one.body}/delta")
        if delta is not None and body.n_modes:
            stress = stress + _of_coordinates(body, one, delta[:, : body.n_modes])
        return lowest_principal(stress)

    def lowest(self) -> dict[tuple[str, str], Slack]:
        """Lowest tension that was seen, by body and group of the member."""
        return {(self._watched[k].body, self._watched[k].block.group): seen for k, seen in self._least.items()}

    def warn(self) -> None:
        """Warn of members whose tension fell below zero: when, where and how far."""
        for number, seen in self._least.items():
            one = self._watched[number]
            s = len(one.block.linear_map)
            if seen.value < -SLACK * float(np.abs(one.block.stress).max()):
                what = "slack" if s == 1 else "wrinkled"
                place = ", ".join(f"{c:.4g}" for c in seen.place)
                warnings.warn(
                    f"body {one.body!r}: its {one.block.family} on group {one.block.group!r} went {what} at t = "
                    f"{seen.time:.6g} s near ({place}): its {PRINCIPAL[s]} falls to {seen.value:.4g} {UNITS[s]}, below "
                    "zero, and the model carries that compression. Raise the tension, or lower the load against it",
                    PhysicsWarning,
                    stacklevel=2,
                )


def _of_body(system: System, name: str, known: Mapping[str, object]) -> list[Watched]:
    """The watched members of a body whose structure is known."""
    origin = getattr(known.get(name), "origin", None)
    if origin is None or not isinstance(origin.source, Meshed):
        return []
    source: Meshed = origin.source
    found, part = [], -1
    for block, place in zip(source.structure.strain, source.structure.places, strict=True):
        part += place is not None
        if isinstance(block, TensionStrain):
            found.append(_watched(system, name, source, block, part))
    return found


def _watched(system: System, name: str, source: Meshed, block: TensionStrain, part: int) -> Watched:
    structure, modes = source.structure, source.modes
    e, s = len(block.dofs), len(block.linear_map)
    elements = np.unique(np.linspace(0, e - 1, WATCHED).round().astype(int))
    c = _functionals(structure, block, elements)  # (n_dof, k s)
    theta = supported(structure, modes.held).answers(np.where(_free(structure, modes)[:, None], c, 0.0))
    theta = theta - _inside(structure, modes, system.bodies[name], theta)
    mean = _means(block, elements)
    stress = np.broadcast_to(block.stress, (*block.weight.shape, s))[elements]
    rest = np.einsum("kq,kqs->ks", mean, stress) - (theta.T @ structure.f0).reshape(len(elements), s)
    work = work_of_accelerations(structure, theta)
    at = {marker: marker_rows(structure, group).translation @ theta for marker, group in source.places.items()}
    stiffnesses = tuple(
        OmittedStiffness(system, {name: Foreshortening(work[:, :, j], {key: rows[:, j] for key, rows in at.items()})})
        for j in range(theta.shape[1])
    )
    places = np.einsum("kq,kqa->ka", mean, np.broadcast_to(block.places, (*block.weight.shape, 3))[elements])
    return Watched(name, block, part, elements, places, rest, stiffnesses)


def _free(structure: Structure, modes: ModeSet) -> BoolArray:
    free = np.ones(structure.n_dof, bool)
    free[modes.held] = False
    return free


def _means(block: TensionStrain, elements: IntArray) -> Array:
    """Weights (k, q) of the points of elements in their means."""
    weight = block.weight[elements]
    return np.asarray(weight / weight.sum(axis=1, keepdims=True))


def _functionals(structure: Structure, block: TensionStrain, elements: IntArray) -> Array:
    """Rows (n_dof, k s) of the mean stresses of elements on the dofs: C L G, meaned."""
    mean, s = _means(block, elements), len(block.linear_map)
    raw = np.zeros((structure.T.shape[0], len(elements) * s))
    for k, element in enumerate(elements):
        own = slice(element, element + 1)
        C = np.broadcast_to(rows_of_elements(block.elastic, own), (1, block.weight.shape[1], s, s))[0]
        G = np.broadcast_to(rows_of_elements(block.G, own), (1, block.weight.shape[1], *block.G.shape[2:]))[0]
        rows = np.einsum("q,qst,tg,qgl->sl", mean[k], C, block.linear_map, G)
        np.add.at(raw, (block.dofs[element][:, None], k * s + np.arange(s)), rows.T)
    return np.asarray(structure.T.T @ raw)


def _inside(structure: Structure, modes: ModeSet, body: FlexibleBody, theta: Array) -> Array:
    """The part of displacements (n_dof, n) in the coordinates of a body, in the sense of its strain energy."""
    follow = body.strain_form != "linear"
    columns = [k for k, kind in enumerate(modes.kinds) if not (follow and kind == "derivative")]
    phi = modes.phi[:, columns]
    if not phi.shape[1]:
        return np.zeros_like(theta)
    K = structure.K @ phi
    return np.asarray(phi @ np.linalg.lstsq(phi.T @ K, K.T @ theta, rcond=None)[0])


def _of_coordinates(body: FlexibleBody, one: Watched, delta: Array) -> Array:
    """Stress (t, k, s) of watched elements by the linear strain of a body's coordinates delta (t, n)."""
    part = body.strain_field[one.part]
    points = (one.elements[:, None] * part.per + np.arange(part.per)).ravel()
    n = body.n_modes
    follows = [body.strain_form != "linear" and kind == "derivative" for kind in body.kinds[:n]]
    y = np.where(follows, 0.0, delta)
    rows = np.einsum("sg,pgn->psn", part.linear, part.rows[points][:, :, :n])
    elastic = part.elastic if len(part.elastic) == 1 else part.elastic[points]
    weight = part.weight[points].reshape(len(one.elements), part.per)
    stress = np.matmul(elastic, rows).reshape(*weight.shape, -1, n)
    share = weight / weight.sum(axis=1, keepdims=True)
    return np.asarray(np.einsum("kp,kpsn,tn->tks", share, stress, y, optimize=True))
