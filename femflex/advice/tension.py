"""Tension of tethers and membranes along a run: where and when they would go slack or wrinkle.

The tension of an element is a linear function of displacement: sigma = sigma_0 + c.x + C eps(y), with x the static
response to loads beyond the body's coordinates y. By reciprocity c.x = theta.F with K theta = c, where theta excludes
its part in the coordinates. Derivatives, which depend on bending, do not count as coordinates here, since they nearly
cancel with the squares of bending. The work of the displacement theta is computed as that of a foreshortening
(`femflex.advice.stiffening`): on the inertia of spin, weight, gravity gradient, loads and attached bodies. The initial
tension belongs to the loads f0 of the preload. Angular accelerations, and the vibration of other bodies, are neglected.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from femflex.advice.advice import Advice, WorstRow, doubt
from femflex.advice.bodies import BodyOrigins
from femflex.advice.limits import SLACK, WATCHED_ELEMENTS
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
from femflex.reduction.modes.vibration import ModeSet
from femflex.reduction.origin import Meshed
from femflex.system import System


@dataclass(frozen=True, eq=False)
class WatchedMember:
    """Watched elements of one member of a body.

    places (k, 3)   positions of the elements [m]
    rest (k, s)     stress without loads, with the body's coordinates at zero
    stiffnesses     (k s,) reduction of each stress along a run
    part            number of the member's part of the body's strain field
    """

    body: str
    block: TensionStrain
    part: int
    elements: IntArray
    places: Array
    rest: Array
    stiffnesses: tuple[OmittedStiffness, ...]


class TensionWatch:
    """Watches the tension of tethers and membranes, row by row, and warns where it falls below zero."""

    def __init__(self, model: Model, origins: BodyOrigins) -> None:
        self._system = model.system
        self._members = [
            member for name in model.system.order for member in _watched_members(model.system, name, origins)
        ]
        self._least = [WorstRow() for _ in self._members]

    def watch(self, times: Array, states: Array, channels: Mapping[str, Array]) -> None:
        """Record the lowest tension over a block of rows (n_t, ...)."""
        for member, least in zip(self._members, self._least, strict=True):
            tension = self.tension(member, channels)
            least.record(-tension.min(axis=1), time=times, position=member.places[tension.argmin(axis=1)])

    def tension(self, member: WatchedMember, channels: Mapping[str, Array]) -> Array:
        """Tension [N], or lowest principal stress resultant [N/m], of watched elements along rows: (t, k)."""
        body = self._system.bodies[member.body]
        stress = np.stack([-omitted.gains(channels)[member.body] for omitted in member.stiffnesses], axis=1)
        stress = member.rest + stress.reshape(len(stress), *member.rest.shape)
        delta = channels.get(f"bodies/{member.body}/delta")
        if delta is not None and body.n_modes:
            stress = stress + _stress_of_coordinates(body, member, delta[:, : body.n_modes])
        return lowest_principal(stress)

    def doubts(self) -> Iterator[Advice]:
        """Warnings of members whose tension fell below zero, with time, position and value."""
        for member, lowest in zip(self._members, self._least, strict=True):
            s, limit = len(member.block.linear_map), SLACK * float(np.abs(member.block.stress).max())
            if lowest.measure > limit:
                time, state = lowest.values["time"], "slack" if s == 1 else "wrinkled"
                position = ", ".join(f"{c:.4g}" for c in lowest.values["position"])
                text = (
                    f"body {member.body!r}: its {member.block.family} on group {member.block.group!r} went {state} at "
                    f"t = {time:.6g} s near ({position}): its {PRINCIPAL[s]} falls to {-lowest.measure:.4g} "
                    f"{UNITS[s]}, below zero, and the model carries that compression. Raise the tension, or lower the "
                    "load against it"
                )
                yield doubt(member.body, "compression", text, -lowest.measure, limit)


def _watched_members(system: System, name: str, origins: BodyOrigins) -> list[WatchedMember]:
    """The watched members of a body; none of a body without a mesh."""
    source = origins[name].origin.source if name in origins else None
    if not isinstance(source, Meshed):
        return []
    members, part = [], -1
    for block, place in zip(source.structure.strain, source.structure.places, strict=True):
        part += place is not None
        if isinstance(block, TensionStrain):
            members.append(_watched_member(system, name, source, block, part))
    return members


def _watched_member(system: System, name: str, source: Meshed, block: TensionStrain, part: int) -> WatchedMember:
    structure, modes = source.structure, source.modes
    e, s = len(block.dofs), len(block.linear_map)
    elements = np.unique(np.linspace(0, e - 1, WATCHED_ELEMENTS).round().astype(int))
    c = _stress_functionals(structure, block, elements)  # (n_dof, k s)
    theta = supported(structure, modes.held).answers(np.where(_free_dofs(structure, modes)[:, None], c, 0.0))
    theta = theta - _part_in_coordinates(structure, modes, system.bodies[name], theta)
    mean = _mean_weights(block, elements)
    stress = np.broadcast_to(block.stress, (*block.weight.shape, s))[elements]
    rest = np.einsum("kq,kqs->ks", mean, stress) - (theta.T @ structure.f0).reshape(len(elements), s)
    work = work_of_accelerations(structure, theta)
    at = {marker: marker_rows(structure, group).translation @ theta for marker, group in source.places.items()}
    stiffnesses = tuple(
        OmittedStiffness(system, {name: Foreshortening(work[:, :, j], {key: rows[:, j] for key, rows in at.items()})})
        for j in range(theta.shape[1])
    )
    places = np.einsum("kq,kqa->ka", mean, np.broadcast_to(block.places, (*block.weight.shape, 3))[elements])
    return WatchedMember(name, block, part, elements, places, rest, stiffnesses)


def _free_dofs(structure: Structure, modes: ModeSet) -> BoolArray:
    free = np.ones(structure.n_dof, bool)
    free[modes.held] = False
    return free


def _mean_weights(block: TensionStrain, elements: IntArray) -> Array:
    """Weights (k, q) of the quadrature points in the mean over each element; each row sums to 1."""
    weight = block.weight[elements]
    return np.asarray(weight / weight.sum(axis=1, keepdims=True))


def _stress_functionals(structure: Structure, block: TensionStrain, elements: IntArray) -> Array:
    """Matrix (n_dof, k s) whose columns give the mean stresses of elements from the dofs: the means of C L G."""
    mean, s = _mean_weights(block, elements), len(block.linear_map)
    raw = np.zeros((structure.T.shape[0], len(elements) * s))
    for k, element in enumerate(elements):
        selection = slice(element, element + 1)
        C = np.broadcast_to(rows_of_elements(block.elastic, selection), (1, block.weight.shape[1], s, s))[0]
        G = np.broadcast_to(rows_of_elements(block.G, selection), (1, block.weight.shape[1], *block.G.shape[2:]))[0]
        rows = np.einsum("q,qst,tg,qgl->sl", mean[k], C, block.linear_map, G)
        np.add.at(raw, (block.dofs[element][:, None], k * s + np.arange(s)), rows.T)
    return np.asarray(structure.T.T @ raw)


def _part_in_coordinates(structure: Structure, modes: ModeSet, body: FlexibleBody, theta: Array) -> Array:
    """The projection of displacements (n_dof, n) on the coordinates of a body, by its strain energy."""
    follow = body.strain_form != "linear"
    columns = [k for k, kind in enumerate(modes.kinds) if not (follow and kind == "derivative")]
    phi = modes.phi[:, columns]
    if not phi.shape[1]:
        return np.zeros_like(theta)
    K = structure.K @ phi
    return np.asarray(phi @ np.linalg.lstsq(phi.T @ K, K.T @ theta, rcond=None)[0])


def _stress_of_coordinates(body: FlexibleBody, member: WatchedMember, delta: Array) -> Array:
    """Stress (t, k, s) of watched elements by the linear strain of a body's coordinates delta (t, n)."""
    part = body.strain_field[member.part]
    points = (member.elements[:, None] * part.per + np.arange(part.per)).ravel()
    n = body.n_modes
    follows = [body.strain_form != "linear" and kind == "derivative" for kind in body.kinds[:n]]
    y = np.where(follows, 0.0, delta)
    rows = np.einsum("sg,pgn->psn", part.linear, part.rows[points][:, :, :n])
    elastic = part.elastic if len(part.elastic) == 1 else part.elastic[points]
    weight = part.weight[points].reshape(len(member.elements), part.per)
    stress = np.matmul(elastic, rows).reshape(*weight.shape, -1, n)
    share = weight / weight.sum(axis=1, keepdims=True)
    return np.asarray(np.einsum("kp,kpsn,tn->tks", share, stress, y, optimize=True))
