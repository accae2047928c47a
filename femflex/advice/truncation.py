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
    FREQUENCY_ERROR,
    HISTORY_ERROR,
    LOWEST_MODES,
    MANY_RICHER,
    ROUNDING,
)
from femflex.advice.motion_estimate import SINGULAR, RigidEstimate, estimate_motion
from femflex.arrays import Array
from femflex.dynamics.equilibria.elastic_response import ElasticResponse
from femflex.dynamics.equilibria.rest_modes import CLOSE, RestModes, rest_modes
from femflex.reading import error_text
from femflex.reduction.boundary.rigid import DIRECTIONS
from femflex.system import System
from femflex.system.connections import tie_markers
from femflex.warning import TruncationWarning

log = logging.getLogger(__name__)

NOT_ASSESSED = "its truncation error is not estimated"


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

    def excited_motions(self, name: str) -> Array:
        """Elastic coordinates (n, k) [kg^1/2 m] of a body in the modes that the run excites in it.

        A mode counts if it displaces the body by more than EXCITATION_SHARE of the body's largest amplitude (measured
        by the root of the strain energy over the frequency). It also counts if it rotates a joint by more than this
        share, and the body has more than this share of its energy. The strain energy of the whole craft is 1/2 in each
        motion, times a weight above 1 where the phase matters more: without a share e of its energy a mode is out of
        phase by omega t e / 2 at the end, and this error counts by the vibration in this mode over the body's
        displacement.
        """
        if self.response is None or name not in self.response.shapes:
            return np.zeros((len(self.bodies[name].retained), 0))
        response, shapes, V1 = self.response, self.response.shapes[name], self.bodies[name].body.strain.V1
        omega = response.omega
        energy = np.maximum((shapes * (V1 @ shapes)).sum(axis=0), 0.0)
        size = response.peak * np.sqrt(energy) / omega
        turning = (response.recoil > EXCITATION_SHARE) & (energy > EXCITATION_SHARE * omega**2)
        numbers = np.flatnonzero((size > EXCITATION_SHARE * size.max(initial=0.0)) | turning)
        share = np.maximum(response.shares[name], response.recoil)
        phase = share * omega * response.ringing * ENERGY_SHARE / HISTORY_ERROR
        return np.asarray(shapes[:, numbers] / omega[numbers] * np.sqrt(np.maximum(phase[numbers], 1.0)))


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
        shapes, shares = ({name: of[name] for name in bodies} for of in (response.shapes, response.shares))
        response = replace(response, shapes=shapes, shares=shares)
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
    """A warning if richer sets would change the elastic motion of the run, or elastic frequencies of the craft.

    The limits are HISTORY_ERROR of the motion's peak, and FREQUENCY_ERROR of each frequency below the band [Hz] and of
    the LOWEST_MODES; the latter do not count if loads and commands alone excite the craft.

    t: time at which the lengths of deploying members are taken [s].
    """
    if richer.modes is None:
        return []
    try:
        kept = rest_modes(system).omega
        motion, mode = _history_error(kept, richer)
        forced = richer.response is not None and any(share.any() for share in richer.response.shares.values())
        lowest = 0 if forced and not system.delta0 else LOWEST_MODES
        change = _frequency_change(kept, richer.modes, lowest, band)
    except (ValueError, np.linalg.LinAlgError) as error:
        log.info(f"the truncation error of the craft is not estimated: {error_text(error, SINGULAR)}")
        return []
    wrong = [int(k) for k in np.flatnonzero(change > FREQUENCY_ERROR)]
    if motion > HISTORY_ERROR:
        text = (
            f"richer sets of shapes may change the elastic motion of this run by {motion:.0%} of its peak (limit "
            f"{HISTORY_ERROR:.0%}): {_change_text(kept, richer.modes, mode)}"
        )
        value, limit, wrong = motion, HISTORY_ERROR, [mode]
    elif wrong:
        each = ", ".join(_change_text(kept, richer.modes, k) for k in wrong)
        below = " and ".join([f"among the first {lowest}"] * (lowest > 0) + [f"below {band:g} Hz"] * (band > 0.0))
        text = (
            f"richer sets of shapes change elastic frequencies of the craft {below} (at rest, with linear strain"
            + f", lengths of t = {t:.6g} s" * bool(t)
            + f") by more than {FREQUENCY_ERROR:.0%}: {each}"
        )
        value, limit = float(change.max()), FREQUENCY_ERROR
    else:
        return []
    text += (
        f". Raise the number of modes of {_bodies_to_refine(richer, max(wrong))}, or give the body more static "
        "shapes (`joints`); femflex converge --over modes shows how much it matters"
    )
    return [replace(doubt("", "truncation", text, value, limit), category=TruncationWarning)]


def _frequency_errors(kept: Array, modes: RestModes) -> Array:
    """Relative error (n,) by which the kept frequencies [rad/s] exceed those of richer sets; 1 of modes beyond them.

    The k-th frequencies of two sets are compared, which Rayleigh and Ritz justify where one set contains the other.
    """
    errors = np.where(modes.omega > 0.0, 1.0, 0.0)
    n = min(len(kept), len(errors))
    errors[:n] = np.where(kept[:n] > 0.0, 1.0 - modes.omega[:n] / np.where(kept[:n] > 0.0, kept[:n], 1.0), 0.0)
    return np.maximum(errors, 0.0)


def _history_error(kept: Array, richer: RicherCraft) -> tuple[float, int]:
    """Error of the elastic motion of a body, or of the rate of a joint, over its peak, and the mode that matters most.

    A mode with an error of frequency is out of phase by this error times omega t; at 1 rad it counts as lost.
    """
    response, modes = richer.response, richer.modes
    assert modes is not None
    if response is None or not response.omega.size:
        return 0.0, 0
    number = np.abs(modes.omega[:, None] - response.omega).argmin(axis=0)
    near = np.abs(modes.omega[number] - response.omega) <= CLOSE * response.omega
    errors = np.where(near, _frequency_errors(kept, modes)[number], 0.0)
    lost = np.minimum(1.0, errors * response.omega * response.ringing)
    parts = np.array([*response.shares.values(), response.recoil]) * lost
    worst = parts[int(np.argmax((parts**2).sum(axis=1)))]
    return min(float(np.linalg.norm(worst)), 1.0), int(number[np.argmax(worst)])


def _frequency_change(kept: Array, modes: RestModes, count: int, band: float) -> Array:
    """`_frequency_errors` of the lowest elastic modes and those below a band [Hz]; 0 of others."""
    errors, numbers = _frequency_errors(kept, modes), modes.relevant(count, band)
    return np.where(np.isin(np.arange(len(errors)), numbers[numbers < len(kept)]), errors, 0.0)


def _change_text(kept: Array, modes: RestModes, k: int) -> str:
    rich = modes.omega[k] / (2.0 * np.pi)
    if k >= len(kept):
        return f"a mode at {rich:.4g} Hz is missing"
    frequency = float(kept[k]) / (2.0 * np.pi)
    if f"{frequency:.4g}" == f"{rich:.4g}":
        return f"the mode of {rich:.4g} Hz would take another share of it"
    return f"{frequency:.4g} Hz would be {rich:.4g} Hz"


def _bodies_to_refine(richer: RicherCraft, k: int) -> str:
    """Names of the bodies with the most strain energy in mode k, and of those with at least half as much."""
    assert richer.modes is not None
    energy = {}
    for name, rich in richer.bodies.items():
        x = richer.modes.shapes[name][:, k]
        energy[name] = float(x @ rich.body.strain.V1 @ x)
    return ", ".join(repr(name) for name, value in energy.items() if value >= max(energy.values()) / 2)


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
