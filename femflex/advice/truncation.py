"""Residual vectors of joints, chosen by the craft's modes, and the truncation error of a basis.

Vibration modes are those of a body that carries nothing and whose root is at rest. With a joint or loop that loads it,
or a light parent that lets its root move, a few modes are inaccurate: two booms welded in line with four modes each
have an error of 3 % in the first frequency. The static shapes of the joint's forces and moments, and of accelerations
of the root, make the set exact in statics. The modes of the craft in richer sets (`EnrichedBody`) show which of them
are needed; in these sets every joint has all its static shapes and their inertia corrections. A direction is retained
where the body's other shapes lack more than ENERGY_SHARE of the strain energy of one of the LOWEST_MODES elastic modes,
or of a mode below the `band` of the run; without it, that frequency would rise by half the share. An axial force on a
slender boom stores no energy and would add the craft's one stiff coordinate: it is left out. A root that cannot move
needs no static shapes.
"""

from __future__ import annotations

import logging
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from femflex.advice.advice import Advice, doubt
from femflex.advice.bodies import BodyOrigins
from femflex.advice.enriched_bodies import DEPENDENT_KINDS, EnrichedBody, Place
from femflex.advice.limits import (
    ENERGY_SHARE,
    EXCITATION_SHARE,
    EXCITATION_WARNED,
    FREQUENCY_ERROR,
    LOWEST_MODES,
    MANY_RICHER,
    ROUNDING,
)
from femflex.advice.motion_estimate import SINGULAR, RigidEstimate, estimate_motion
from femflex.arrays import Array, IntArray
from femflex.dynamics.equilibria.elastic_response import ElasticResponse
from femflex.dynamics.equilibria.rest_modes import RestModes, rest_modes, truncation
from femflex.reading import error_text
from femflex.reduction.boundary.rigid import DIRECTIONS
from femflex.system import System
from femflex.system.connections import tie_markers
from femflex.warning import TruncationWarning

log = logging.getLogger(__name__)

NOT_ASSESSED = "the truncation error of the craft's frequencies is not estimated for it"


@dataclass(frozen=True, eq=False)
class RicherCraft:
    """A craft in richer sets, or the reason why there is none.

    bodies and markers (of joints) by name; fixed_roots: names of bodies whose root stays at rest
    response: to the loads, commands and initial state of the run; None where it is not estimated
    """

    bodies: Mapping[str, EnrichedBody]
    modes: RestModes | None = None
    markers: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    fixed_roots: frozenset[str] = frozenset()
    reason: str = ""
    response: ElasticResponse | None = None

    def excited_modes(self, name: str, share: float, swinging: bool = False) -> IntArray:
        """Numbers of the response's modes that matter for a body.

        In these the body is displaced by more than a share of its largest amplitude (by the root of its strain energy
        over the frequency), or it has more than that share of the energy of a mode that rotates a joint by more.
        swinging: by the oscillating part alone, without a slow static part.
        """
        if self.response is None or name not in self.response.shapes:
            return np.zeros(0, np.int64)
        V1, shapes = self.bodies[name].body.strain.V1, self.response.shapes[name]
        energy = np.maximum(np.einsum("ik,ij,jk->k", shapes, V1, shapes), 0.0)
        amplitude = self.response.swing if swinging else self.response.peak
        size = amplitude * np.sqrt(energy) / self.response.omega
        turning = (self.response.recoil > share) & (energy > share * self.response.omega**2)
        return np.flatnonzero((size > share * size.max(initial=0.0)) | turning)

    def excited_motions(self, name: str) -> Array:
        """Elastic coordinates (n, k) [kg^1/2 m] of a body in these modes, of strain energy 1/2 of the whole craft."""
        if self.response is None or name not in self.response.shapes:
            return np.zeros((len(self.bodies[name].retained), 0))
        numbers = self.excited_modes(name, EXCITATION_SHARE)
        return self.response.shapes[name][:, numbers] / self.response.omega[numbers]

    @property
    def excited(self) -> Array:
        """Frequencies (k,) of the modes that the run excites in any body [rad/s]."""
        if self.response is None:
            return np.zeros(0)
        numbers = {int(k) for name in self.bodies for k in self.excited_modes(name, EXCITATION_WARNED, swinging=True)}
        return self.response.omega[sorted(numbers)]


def with_response(richer: RicherCraft, system: System, end: float) -> tuple[RicherCraft, RigidEstimate | None]:
    """The craft in richer sets with its response in a run up to a time [s], and its estimated rigid-body motion.

    Members that deploy keep their own functions in the response.
    """
    if richer.modes is None:
        return richer, None
    bodies = {name: rich for name, rich in richer.bodies.items() if name not in system.varying}
    rich_system = replace(
        system,
        bodies={**system.bodies, **{name: rich.body for name, rich in bodies.items()}},
        delta0={**system.delta0, **_in_richer_sets(system, bodies, system.delta0)},
        ddelta0={**system.ddelta0, **_in_richer_sets(system, bodies, system.ddelta0)},
    )
    estimate = estimate_motion(rich_system, end)
    response = estimate.response
    if response is not None:
        response = replace(response, shapes={name: response.shapes[name] for name in bodies})
    return replace(richer, response=response), estimate.rigid


def _in_richer_sets(
    system: System, bodies: Mapping[str, EnrichedBody], coordinates: Mapping[str, Array]
) -> dict[str, Array]:
    """Elastic coordinates of bodies in their richer sets, without those of dependent shapes."""
    out = {}
    for name, rich in bodies.items():
        if name in coordinates:
            kinds = system.bodies[name].kinds
            first = [k for k in range(len(coordinates[name])) if k >= len(kinds) or kinds[k] not in DEPENDENT_KINDS]
            out[name] = rich.retained @ np.asarray(coordinates[name])[first]
    return out


def richer_craft(system: System, origins: BodyOrigins) -> RicherCraft:
    """The craft with every body of known origin in a richer set."""
    markers = {name: tuple(sorted(names)) for name, names in joint_markers(system).items()}
    try:
        bodies = _enriched(system, origins, markers)
        count = sum((bodies[name].body if name in bodies else body).n_modes for name, body in system.bodies.items())
        if not bodies or count > MANY_RICHER:
            return RicherCraft({}, reason=f"{count} coordinates with richer sets, over {MANY_RICHER}" if bodies else "")
        modes = rest_modes(system, {name: rich.body for name, rich in bodies.items()})
    except (ValueError, RuntimeError, np.linalg.LinAlgError) as error:
        return RicherCraft({}, reason=error_text(error, SINGULAR))
    return RicherCraft(bodies, modes, markers, frozenset(name for name in bodies if _has_fixed_root(system, name)))


def _enriched(system: System, origins: BodyOrigins, markers: Mapping[str, tuple[str, ...]]) -> dict[str, EnrichedBody]:
    """The bodies whose origins are known in richer sets; bodies alike are enriched once."""
    bodies = dict[str, EnrichedBody]()
    by_origin: dict[tuple[int, tuple[str, ...]], EnrichedBody | None] = {}
    for name, body in system.bodies.items():
        if name in origins and body.n_modes:
            key = (id(origins[name]), markers.get(name, ()))
            if key not in by_origin:
                by_origin[key] = origins[name].enriched(body, key[1])
            if (enriched := by_origin[key]) is not None:
                bodies[name] = enriched
    return bodies


def _has_fixed_root(system: System, name: str) -> bool:
    """Whether the root of a body is fixed: it and all rigid bodies that carry it are at rest in the base frame."""
    joint = system.joint_of(name)
    moving = any(profile.moves for profile in joint.prescribed.values())
    if joint.n_u > len(joint.prescribed) or moving or system.orbit is not None:
        return False
    return joint.parent is None or (not system.bodies[joint.parent].n_modes and _has_fixed_root(system, joint.parent))


def joint_markers(system: System) -> dict[str, set[str]]:
    """Names of the markers of each body at joints, loops, constraints and springs."""
    markers: dict[str, set[str]] = {}
    for joint in system.joints:
        markers.setdefault(joint.child, set()).add(joint.child_marker)
        if joint.parent is not None:
            markers.setdefault(joint.parent, set()).add(joint.parent_marker)
    for _, body, marker in tie_markers(system.loops, system.constraints, system.springs):
        markers.setdefault(body, set()).add(marker)
    return markers


def joint_advice(
    crafts: Iterable[RicherCraft], origins: BodyOrigins, alike: Mapping[str, str], band: float
) -> dict[str, Advice]:
    """Static shapes of joints for each body that leaves them open: {group: directions}, or ends of a beam.

    crafts: the craft in richer sets, at each of the lengths at which its members are assessed.
    alike: text of the table of each of these bodies; bodies with equal tables and joints get the same shapes.
    """
    chosen: dict[str, set[Place]] = {}
    keys = dict(alike)
    for richer in crafts:
        for name, table in alike.items() if richer.modes is not None else ():
            if name in richer.bodies:
                keys[name] = f"{table} {richer.markers.get(name)}"
                chosen.setdefault(keys[name], set()).update(_shapes_for_craft(richer, origins, name, band))
    return {name: _joint_choice(name, chosen.get(keys[name], set())) for name in alike}


def _shapes_for_craft(richer: RicherCraft, origins: BodyOrigins, name: str, band: float) -> list[Place]:
    """The static shapes that a body leaves open and that the lowest modes of the craft need."""
    assert richer.modes is not None
    enriched, lowest = richer.bodies[name], richer.modes.relevant(LOWEST_MODES, band)
    choices = {place: x for place, x in enriched.choices.items() if _is_open(origins, name, place, richer.fixed_roots)}
    motions = [richer.modes.shapes[name][:, lowest] / richer.modes.omega[lowest], richer.excited_motions(name)]
    return selected_shapes(enriched, choices, np.column_stack(motions))


def _joint_choice(name: str, chosen: set[Place]) -> Advice:
    groups = sorted({group for group, _ in chosen})
    directions = {group: [way for way in DIRECTIONS if (group, way) in chosen] for group in groups}
    text = ", ".join(" ".join([group, *names]) for group, names in directions.items()) or "none"
    return Advice(
        name,
        "joints",
        directions,
        f"static shapes of its joints that the modes of the craft need: {text}",
        None,
        ENERGY_SHARE,
    )


def _is_open(origins: BodyOrigins, name: str, place: Place, fixed_roots: Iterable[str]) -> bool:
    """Whether a body may have the static shapes of a place; fixed_roots: bodies whose root cannot move."""
    choices = origins.open_choices(name)
    if place[0] in choices.roots:
        return choices.at_roots and name not in fixed_roots
    return choices.elsewhere


def selected_shapes(enriched: EnrichedBody, choices: Mapping[Place, Array], motions: Array) -> list[Place]:
    """The places of the choices (n, m) that motions (n, k) of strain energy 1 / 2 of the whole craft need, in order.

    Each time the choice with most of the remaining energy of a motion is taken, as long as that is over ENERGY_SHARE.
    """
    V1 = enriched.body.strain.V1
    energy, vectors = np.linalg.eigh((V1 + V1.T) / 2)
    root = np.sqrt(np.maximum(energy, 0.0))[:, None] * vectors.T
    Q = np.linalg.qr(root @ enriched.retained)[0]
    remaining = root @ motions
    places: list[Place] = []
    while True:
        remaining = remaining - Q @ (Q.T @ remaining)
        gains = {}
        for place, x in choices.items():
            if place not in places and (direction := _orthonormal_rest(Q, root @ x)).size:
                gains[place] = float(((direction.T @ remaining) ** 2).sum(axis=0).max(initial=0.0)), direction
        best = max(gains, key=lambda place: gains[place][0], default=None)
        if best is None or gains[best][0] < ENERGY_SHARE:
            return places
        places.append(best)
        Q = np.column_stack([Q, gains[best][1]])


def _orthonormal_rest(Q: Array, x: Array) -> Array:
    """Orthonormal basis (n, m) of the part of columns x outside the orthonormal Q; empty where that is rounding."""
    size = np.linalg.norm(x, axis=0)
    for _ in range(2):
        x = x - Q @ (Q.T @ x)
    x = x[:, np.linalg.norm(x, axis=0) > ROUNDING * size]
    return np.linalg.qr(x)[0] if x.size else x[:, :0]


def truncation_warnings(system: System, richer: RicherCraft, band: float, t: float = 0.0) -> list[Advice]:
    """A warning if richer sets would lower one of the craft's lowest elastic frequencies by more than FREQUENCY_ERROR.

    t: time of the lengths of its members that deploy [s].
    """
    if richer.modes is None:
        return []
    try:
        change = truncation(system, richer.modes, LOWEST_MODES, band, richer.excited)
    except (ValueError, np.linalg.LinAlgError) as error:
        log.info(f"the truncation error of the craft's frequencies is not estimated: {error_text(error, SINGULAR)}")
        return []
    high = np.flatnonzero(change.errors > FREQUENCY_ERROR)
    if not high.size:
        return []
    each = ", ".join(
        f"{k + 1} at {change.kept[k]:.4g} Hz would be at {change.richer[k]:.4g} Hz ({-change.errors[k]:.1%})"
        for k in high
    )
    assessed = f"the first {LOWEST_MODES} and those that the run excites" + (
        f" and those below {band:g} Hz" if band else ""
    )
    assessed += f", lengths of t = {t:.6g} s" * bool(t)
    text = (
        f"the craft's elastic frequencies ({assessed}, at rest, with linear strain) change by more than "
        f"{FREQUENCY_ERROR:.0%} "
        f"with richer sets of shapes: {each}. Raise the number of modes of {_bodies_to_refine(system, richer)}, or "
        "give the body "
        "more static shapes (`joints`). The richer sets contain all static shapes of the joints and their dynamic "
        "(inertia) corrections"
    )
    return [
        replace(doubt("", "truncation", text, float(change.errors.max()), FREQUENCY_ERROR), category=TruncationWarning)
    ]


def _bodies_to_refine(system: System, richer: RicherCraft) -> str:
    """Names of the bodies that contribute most: with their own sets the change would be less than half as large."""
    assert richer.modes is not None
    total = truncation(system, richer.modes, LOWEST_MODES, 0.0, richer.excited).errors.max()
    blamed = []
    for name in richer.bodies:
        others = {key: rich.body for key, rich in richer.bodies.items() if key != name}
        if (
            truncation(system, rest_modes(system, others), LOWEST_MODES, 0.0, richer.excited).errors.max(initial=0.0)
            < total / 2
        ):
            blamed.append(name)
    return ", ".join(map(repr, blamed or richer.bodies))


def unassessed_truncation(system: System, origins: BodyOrigins, richer: RicherCraft) -> list[Advice]:
    """A note on each body whose set is not assessed."""
    notes = []
    for name, body in system.bodies.items():
        if not body.n_modes or name not in origins:
            continue
        reason = "its file has no elements" if origins[name].origin.source is None else richer.reason
        if origins[name].is_preloaded:
            reason = "its modes are computed about its preload"
        if reason:
            notes.append(Advice(name, "truncation", None, f"{NOT_ASSESSED} ({reason})"))
    return notes
