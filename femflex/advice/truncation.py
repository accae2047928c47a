"""Static shapes for what joints transmit to bodies, chosen from their craft's modes; and what sets leave out of these.

Vibration modes are those of a body that carries nothing, on a root that stands still. Where a joint or a loop pulls at
it, or a light parent lets its root move, a few of them are far off: two booms welded in line, four modes each, 3 % in
the first frequency. The static shapes of the joint's forces and moments, and of the accelerations of the root, make the
set exact there in statics. Which of them a craft needs its modes show: those in a richer set (`Enriched`), in which
every joint has all its static shapes and what inertia adds to these. A direction is kept where it stores more than
SHARE of the strain energy of one of the LOWEST elastic modes, or of one below the `band` of the run, that the body's
other shapes do not hold; dropping it would raise that frequency by half the share. A pull along a slender boom stores
nothing and would be the craft's one stiff coordinate: it is left out. A root that cannot move needs no static shapes.
"""

from __future__ import annotations

import logging
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from femflex.advice.advice import Advice, doubt
from femflex.advice.bodies import KnownBodies
from femflex.advice.enriched_bodies import FOLLOWERS, EnrichedBody, Place
from femflex.advice.limits import DOUBTFUL, EXCITED, LOWEST, MANY_RICHER, ROUNDING, SERVED, SHARE
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

NOT_JUDGED = "the truncation error of the craft's frequencies is not estimated for it"


@dataclass(frozen=True, eq=False)
class RicherCraft:
    """A craft in richer sets, or why there is none.

    bodies and markers (of joints) by name; still: names of bodies whose root stays at rest
    response: what the loads, commands and starts of the run excite of it; None where that is not estimated
    """

    bodies: Mapping[str, EnrichedBody]
    modes: RestModes | None = None
    markers: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    still: frozenset[str] = frozenset()
    lack: str = ""
    response: ElasticResponse | None = None

    def excited_modes(self, name: str, share: float, swinging: bool = False) -> IntArray:
        """Numbers of the response's modes that count for a body.

        In them it is displaced by more than a share of its largest amplitude (by the root of its strain energy over the
        frequency), or it holds more than that share of the energy of a mode that turns a joint by more than it.
        swinging: by what swings alone, without a slow static part.
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
        """Elastic coordinates (n, k) of a body in these modes, of strain energy 1/2 of the whole craft."""
        if self.response is None or name not in self.response.shapes:
            return np.zeros((len(self.bodies[name].kept), 0))
        numbers = self.excited_modes(name, SERVED)
        return self.response.shapes[name][:, numbers] / self.response.omega[numbers]

    @property
    def excited(self) -> Array:
        """Frequencies (k,) of the modes that swing in any body [rad/s]."""
        if self.response is None:
            return np.zeros(0)
        numbers = {int(k) for name in self.bodies for k in self.excited_modes(name, EXCITED, swinging=True)}
        return self.response.omega[sorted(numbers)]


def with_response(richer: RicherCraft, system: System, until: float) -> tuple[RicherCraft, RigidEstimate | None]:
    """The craft in richer sets with what a run up to a time [s] excites of it, and its estimated rigid motion.

    Members that deploy keep their own functions in that.
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
    estimate = estimate_motion(rich_system, until)
    response = estimate.response
    if response is not None:
        response = replace(response, shapes={name: response.shapes[name] for name in bodies})
    return replace(richer, response=response), estimate.rigid


def _in_richer_sets(
    system: System, bodies: Mapping[str, EnrichedBody], coordinates: Mapping[str, Array]
) -> dict[str, Array]:
    """Elastic coordinates of bodies, without those of shapes that follow others, in their richer sets."""
    out = {}
    for name, rich in bodies.items():
        if name in coordinates:
            kinds = system.bodies[name].kinds
            first = [k for k in range(len(coordinates[name])) if k >= len(kinds) or kinds[k] not in FOLLOWERS]
            out[name] = rich.kept @ np.asarray(coordinates[name])[first]
    return out


def richer_craft(system: System, known: KnownBodies) -> RicherCraft:
    """A system with those of its bodies in richer sets whose origins are known."""
    markers = {name: tuple(sorted(found)) for name, found in joint_markers(system).items()}
    try:
        bodies = _enriched(system, known, markers)
        count = sum((bodies[name].body if name in bodies else body).n_modes for name, body in system.bodies.items())
        if not bodies or count > MANY_RICHER:
            return RicherCraft({}, lack=f"{count} coordinates with richer sets, over {MANY_RICHER}" if bodies else "")
        modes = rest_modes(system, {name: found.body for name, found in bodies.items()})
    except (ValueError, RuntimeError, np.linalg.LinAlgError) as error:
        return RicherCraft({}, lack=error_text(error, SINGULAR))
    return RicherCraft(bodies, modes, markers, frozenset(name for name in bodies if _stands(system, name)))


def _enriched(system: System, known: KnownBodies, markers: Mapping[str, tuple[str, ...]]) -> dict[str, EnrichedBody]:
    """The bodies whose origins are known in richer sets; bodies alike are enriched once."""
    bodies = dict[str, EnrichedBody]()
    made: dict[tuple[int, tuple[str, ...]], EnrichedBody | None] = {}
    for name, body in system.bodies.items():
        if name in known and body.n_modes:
            key = (id(known[name]), markers.get(name, ()))
            if key not in made:
                made[key] = known[name].enriched(body, key[1])
            if (found := made[key]) is not None:
                bodies[name] = found
    return bodies


def _stands(system: System, name: str) -> bool:
    """Whether the root of a body stays at rest: it and all rigid bodies that carry it are fixed in the base frame."""
    joint = system.joint_of(name)
    moving = any(profile.moves for profile in joint.prescribed.values())
    if joint.n_u > len(joint.prescribed) or moving or system.orbit is not None:
        return False
    return joint.parent is None or (not system.bodies[joint.parent].n_modes and _stands(system, joint.parent))


def joint_markers(system: System) -> dict[str, set[str]]:
    """Names of the markers of each body at which joints, loops, constraints and springs pull."""
    found: dict[str, set[str]] = {}
    for joint in system.joints:
        found.setdefault(joint.child, set()).add(joint.child_marker)
        if joint.parent is not None:
            found.setdefault(joint.parent, set()).add(joint.parent_marker)
    for _, body, marker in tie_markers(system.loops, system.constraints, system.springs):
        found.setdefault(body, set()).add(marker)
    return found


def joint_advice(
    crafts: Iterable[RicherCraft], known: KnownBodies, alike: Mapping[str, str], band: float
) -> dict[str, Advice]:
    """Static shapes of joints that each body wants which leaves them open: {group: directions}, or ends of a beam.

    crafts: the craft in richer sets, at each of the lengths at which its members are assessed.
    alike: of each of these bodies what its table says; those of which it is the same, joints too, keep the same.
    """
    chosen: dict[str, set[Place]] = {}
    keys = dict(alike)
    for richer in crafts:
        for name, said in alike.items() if richer.modes is not None else ():
            if name in richer.bodies:
                keys[name] = f"{said} {richer.markers.get(name)}"
                chosen.setdefault(keys[name], set()).update(_wanted(richer, known, name, band))
    return {name: _choice(name, chosen.get(keys[name], set())) for name in alike}


def _wanted(richer: RicherCraft, known: KnownBodies, name: str, band: float) -> list[Place]:
    """The static shapes that a body leaves open and that the lowest modes of a craft want."""
    assert richer.modes is not None
    found, lowest = richer.bodies[name], richer.modes.relevant(LOWEST, band)
    open_ = {place: x for place, x in found.choices.items() if _is_open(known, name, place, richer.still)}
    motions = [richer.modes.shapes[name][:, lowest] / richer.modes.omega[lowest], richer.excited_motions(name)]
    return selected_shapes(found, open_, np.column_stack(motions))


def _choice(name: str, chosen: set[Place]) -> Advice:
    groups = sorted({group for group, _ in chosen})
    ways = {group: [way for way in DIRECTIONS if (group, way) in chosen] for group in groups}
    text = ", ".join(" ".join([group, *found]) for group, found in ways.items()) or "none"
    return Advice(
        name, "joints", ways, f"static shapes of its joints that the modes of the craft need: {text}", None, SHARE
    )


def _is_open(known: KnownBodies, name: str, place: Place, still: Iterable[str]) -> bool:
    """Whether a body may have the static shapes of a place; still: bodies whose root cannot move."""
    open_ = known.open(name)
    if place[0] in open_.roots:
        return open_.at_roots and name not in still
    return open_.elsewhere


def selected_shapes(found: EnrichedBody, choices: Mapping[Place, Array], motions: Array) -> list[Place]:
    """The places of those choices (n, m) that motions (n, k) of strain energy 1 / 2 of the whole craft want, in turn.

    That first which holds most of the energy that is left in one of them, as long as it holds SHARE.
    """
    V1 = found.body.strain.V1
    energy, ways = np.linalg.eigh((V1 + V1.T) / 2)
    root = np.sqrt(np.maximum(energy, 0.0))[:, None] * ways.T
    Q = np.linalg.qr(root @ found.kept)[0]
    left = root @ motions
    places: list[Place] = []
    while True:
        left = left - Q @ (Q.T @ left)
        gains = {}
        for place, x in choices.items():
            if place not in places and (direction := _outside(Q, root @ x)).size:
                gains[place] = float(((direction.T @ left) ** 2).sum(axis=0).max(initial=0.0)), direction
        best = max(gains, key=lambda place: gains[place][0], default=None)
        if best is None or gains[best][0] < SHARE:
            return places
        places.append(best)
        Q = np.column_stack([Q, gains[best][1]])


def _outside(Q: Array, x: Array) -> Array:
    """Orthonormal basis (n, m) of what columns x have outside the orthonormal Q; none where that is rounding."""
    size = np.linalg.norm(x, axis=0)
    for _ in range(2):
        x = x - Q @ (Q.T @ x)
    x = x[:, np.linalg.norm(x, axis=0) > ROUNDING * size]
    return np.linalg.qr(x)[0] if x.size else x[:, :0]


def truncation_warnings(system: System, richer: RicherCraft, band: float, t: float = 0.0) -> list[Advice]:
    """Whether richer sets would lower one of the craft's lowest elastic frequencies by more than DOUBTFUL.

    t: time of the lengths of its members that deploy [s].
    """
    if richer.modes is None:
        return []
    try:
        found = truncation(system, richer.modes, LOWEST, band, richer.excited)
    except (ValueError, np.linalg.LinAlgError) as error:
        log.info(f"the truncation error of the craft's frequencies is not estimated: {error_text(error, SINGULAR)}")
        return []
    high = np.flatnonzero(found.errors > DOUBTFUL)
    if not high.size:
        return []
    each = ", ".join(
        f"{k + 1} at {found.kept[k]:.4g} Hz would be at {found.richer[k]:.4g} Hz ({-found.errors[k]:.1%})" for k in high
    )
    judged = f"the first {LOWEST} and those that the run excites" + (f" and those below {band:g} Hz" if band else "")
    judged += f", lengths of t = {t:.6g} s" * bool(t)
    text = (
        f"the craft's elastic frequencies ({judged}, at rest, with linear strain) change by more than {DOUBTFUL:.0%} "
        f"with richer sets of shapes: {each}. Raise the number of modes of {_named(system, richer)}, or give the body "
        "more static shapes (`joints`). The richer sets contain all static shapes of the joints and their dynamic "
        "(inertia) corrections"
    )
    return [replace(doubt("", "truncation", text, float(found.errors.max()), DOUBTFUL), category=TruncationWarning)]


def _named(system: System, richer: RicherCraft) -> str:
    """The bodies that lack most: those without which the change would be less than half as large."""
    assert richer.modes is not None
    whole = truncation(system, richer.modes, LOWEST, 0.0, richer.excited).errors.max()
    blamed = []
    for name in richer.bodies:
        others = {key: found.body for key, found in richer.bodies.items() if key != name}
        if (
            truncation(system, rest_modes(system, others), LOWEST, 0.0, richer.excited).errors.max(initial=0.0)
            < whole / 2
        ):
            blamed.append(name)
    return ", ".join(map(repr, blamed or richer.bodies))


def unassessed_truncation(system: System, known: KnownBodies, richer: RicherCraft) -> list[Advice]:
    """A note on each body whose set is not assessed."""
    out = []
    for name, body in system.bodies.items():
        if not body.n_modes or name not in known:
            continue
        why = "its file has no elements" if known[name].origin.source is None else richer.lack
        if known[name].is_preloaded:
            why = "its modes are computed about its preload"
        if why:
            out.append(Advice(name, "truncation", None, f"{NOT_JUDGED} ({why})"))
    return out
