"""Static shapes of joints that a craft needs, and the truncation error of the sets of its bodies.

Vibration modes are those of a body that carries nothing and whose root is at rest. With a joint or loop that loads it,
or a light parent that lets its root move, a few modes are inaccurate: two booms welded in line with four modes each
have an error of 3 % in the first frequency. The static shapes of the joint's forces and moments, and of accelerations
of the root, make the set exact in statics. Bodies are first built with all of them. In the modes of that craft a
static shape counts by the strain energy that the other shapes of its body lack without it: it is dropped where this is
below ENERGY_SHARE of the energy of each of the LOWEST_MODES elastic modes, of each mode below the `band` of the run,
and of each mode that the run excites. Without it such a frequency rises by half that share. An axial force on a slender
boom stores no energy, and its static shape would be the craft's one stiff coordinate. A root that cannot move needs no
static shapes.

The truncation error of the craft is that of the same modes, from the residual of each body (`reduction.origin`).
"""

from __future__ import annotations

import logging
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from femflex.advice.advice import Advice, doubt
from femflex.advice.bodies import BodyOrigins
from femflex.advice.elastic_motion import CLOSE, ElasticResponse, RestModes, rest_modes
from femflex.advice.limits import (
    ENERGY_SHARE,
    EXCITATION_SHARE,
    FREQUENCY_ERROR,
    HISTORY_ERROR,
    LOWEST_MODES,
    MANY_SHAPES,
    ROUNDING,
)
from femflex.advice.motion_estimate import SINGULAR
from femflex.arrays import Array
from femflex.body import FlexibleBody
from femflex.linear.rigid_motions import BodyMotion
from femflex.reading import error_text
from femflex.reduction.boundary.rigid import DIRECTIONS
from femflex.reduction.modes.damping import is_added
from femflex.reduction.origin import Deployed, Meshed
from femflex.system import System
from femflex.system.connections import tie_markers
from femflex.warning import TruncationWarning

log = logging.getLogger(__name__)

Place = tuple[str, str]  # group or end of the body, and a direction there ("" for all directions of an end)

NOT_ASSESSED = "its truncation error is not estimated"


@dataclass(frozen=True, eq=False)
class CraftModes:
    """The modes of a craft at rest, or the reason why they are not known.

    response: to the loads, commands and initial state of the run; None where it is not estimated
    t: time at which deploying members have their lengths [s]
    """

    system: System
    origins: BodyOrigins
    modes: RestModes | None
    reason: str = ""
    response: ElasticResponse | None = None
    t: float = 0.0

    def excited_motions(self, name: str) -> Array:
        """Elastic coordinates (n, k) [kg^1/2 m] of a body in the modes that the run excites in it.

        A mode counts if it displaces the body by more than EXCITATION_SHARE of the body's largest amplitude (measured
        by the root of the strain energy over the frequency). It also counts if it rotates a joint by more than this
        share, and the body has more than this share of its energy. The strain energy of the whole craft is 1/2 in each
        motion, times a weight above 1 where the phase matters more: without a share e of its energy a mode is out of
        phase by omega t e / 2 at the end, and this error counts by the vibration in this mode over the body's
        displacement.
        """
        assert self.modes is not None
        V1 = self.modes.system.bodies[name].strain.V1
        if self.response is None or name not in self.response.shapes:
            return np.zeros((len(V1), 0))
        response, shapes = self.response, self.response.shapes[name]
        omega = response.omega
        energy = np.maximum((shapes * (V1 @ shapes)).sum(axis=0), 0.0)
        size = response.peak * np.sqrt(energy) / omega
        turning = (response.recoil > EXCITATION_SHARE) & (energy > EXCITATION_SHARE * omega**2)
        numbers = np.flatnonzero((size > EXCITATION_SHARE * size.max(initial=0.0)) | turning)
        share = np.maximum(response.shares[name], response.recoil)
        phase = share * omega * response.ringing * ENERGY_SHARE / HISTORY_ERROR
        return np.asarray(shapes[:, numbers] / omega[numbers] * np.sqrt(np.maximum(phase[numbers], 1.0)))


def craft_modes(
    system: System, origins: BodyOrigins, response: ElasticResponse | None = None, t: float = 0.0
) -> CraftModes:
    """The modes of a craft with linear strain at rest, by which its sets of shapes are judged."""
    count = sum(body.n_modes for body in system.bodies.values())
    if not are_assessable(system, origins) or count > MANY_SHAPES:
        reason = f"{count} coordinates, over {MANY_SHAPES}" if count > MANY_SHAPES else ""
        return CraftModes(system, origins, None, reason, response, t)
    try:
        return CraftModes(system, origins, rest_modes(system), "", response, t)
    except (ValueError, RuntimeError, np.linalg.LinAlgError) as error:
        return CraftModes(system, origins, None, error_text(error, SINGULAR), response, t)


def are_assessable(system: System, origins: BodyOrigins) -> bool:
    """Whether the sets of shapes of some bodies of a system can be judged."""
    return any(body.n_modes and name in origins and origins[name].is_resolved for name, body in system.bodies.items())


def joint_advice(
    crafts: Iterable[CraftModes], origins: BodyOrigins, places: Mapping[str, Collection[str]], band: float
) -> dict[str, Advice]:
    """The static shapes of joints, {group: directions} or ends of a beam, for each body whose case does not name them.

    crafts: the craft with all static shapes, once for each length of its members. places: the groups or ends with
    static shapes of each such body. band [Hz]. Bodies of the same origin get the same shapes.
    """
    needed: dict[int, set[Place]] = {}
    for craft in crafts:
        judged = {} if craft.modes is None else craft.modes.shapes
        for name in places:
            if name in judged and craft.origins[name].is_resolved:
                shapes = _needed_shapes(craft, name, places[name], band)
                needed.setdefault(id(origins[name]), set()).update(shapes)
    return {name: _joint_choice(name, needed.get(id(origins[name]), set())) for name in places}


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


def _needed_shapes(craft: CraftModes, name: str, places: Collection[str], band: float) -> list[Place]:
    """The static shapes at these places of a body that the craft needs in its lowest and its excited modes."""
    assert craft.modes is not None
    lowest = craft.modes.relevant(LOWEST_MODES, band)
    motions = [craft.modes.shapes[name][:, lowest] / craft.modes.omega[lowest], craft.excited_motions(name)]
    V1, loads = craft.modes.system.bodies[name].strain.V1, _loads_at(craft, name, places)
    return selected_shapes(V1, _retained(craft, name), loads, np.column_stack(motions))


def _loads_at(craft: CraftModes, name: str, places: Collection[str]) -> dict[Place, Array]:
    """Generalised loads (n, m) on a body's shapes by its joints at these places; zero at a root that cannot move."""
    assert craft.modes is not None
    body, origin = craft.modes.system.bodies[name], craft.origins[name]
    markers = sorted(joint_markers(craft.system).get(name, ()))
    by_group = {origin.place_of_marker(body, marker): body.marker(marker).loads for marker in markers}
    by_group[origin.root] = body.moments.acceleration_loads() * (not _has_fixed_root(craft.system, name))
    by_group = {group: loads for group, loads in by_group.items() if group in places}
    if not isinstance(origin.origin.source, Meshed):
        return {(end, ""): loads for end, loads in by_group.items()}
    return {(group, way): loads[:, [k]] for group, loads in by_group.items() for k, way in enumerate(DIRECTIONS)}


def _retained(craft: CraftModes, name: str) -> Array:
    """Coordinates (n, k) of the shapes of a body that are not static shapes."""
    assert craft.modes is not None
    body, source = craft.modes.system.bodies[name], craft.origins[name].origin.source
    if isinstance(source, Deployed):
        return source.requested
    return np.eye(body.n_modes)[:, ~is_added(body.kinds[: body.n_modes])]


def _has_fixed_root(system: System, name: str) -> bool:
    """Whether the root of a body is fixed: it and all rigid bodies that carry it are at rest in the base frame."""
    joint = system.joint_of(name)
    moving = any(profile.moves for profile in joint.prescribed.values())
    if joint.n_u > len(joint.prescribed) or moving or system.orbit is not None:
        return False
    return joint.parent is None or (not system.bodies[joint.parent].n_modes and _has_fixed_root(system, joint.parent))


def selected_shapes(V1: Array, retained: Array, loads: Mapping[Place, Array], motions: Array) -> list[Place]:
    """The places of the static shapes V1^-1 loads (n, m) that motions need in addition to the retained shapes (n, j).

    motions (n, k) have a strain energy of 1/2 in the whole craft. In each pass the static shape with most of the
    remaining energy of a motion is selected, as long as this energy is above ENERGY_SHARE.
    """
    energy, vectors = np.linalg.eigh((V1 + V1.T) / 2)
    size = np.sqrt(np.maximum(energy, 0.0))
    root, inverse = size[:, None] * vectors.T, vectors.T / np.where(size > 0.0, size, np.inf)[:, None]
    Q = np.linalg.qr(root @ retained)[0]
    remaining = root @ motions
    places: list[Place] = []
    while True:
        remaining = remaining - Q @ (Q.T @ remaining)
        gains = {}
        for place, load in loads.items():
            if place not in places and (direction := _orthonormal_rest(Q, inverse @ load)).size:
                gains[place] = float(((direction.T @ remaining) ** 2).sum(axis=0).max(initial=0.0)), direction
        best = max(gains, key=lambda place: gains[place][0], default=None)
        if best is None or gains[best][0] < ENERGY_SHARE:
            return places
        places.append(best)
        Q = np.column_stack([Q, gains[best][1]])


def _orthonormal_rest(Q: Array, x: Array) -> Array:
    """Orthonormal basis (n, m) of the part of columns x (n, k) outside the orthonormal Q; rounding is dropped."""
    size = np.linalg.norm(x, axis=0)
    for _ in range(2):
        x = x - Q @ (Q.T @ x)
    x = x[:, np.linalg.norm(x, axis=0) > ROUNDING * size]
    return np.linalg.qr(x)[0] if x.size else x[:, :0]


def truncation_warnings(crafts: Iterable[CraftModes], band: float) -> list[Advice]:
    """A warning if what the sets lack changes the elastic motion of the run, or elastic frequencies of the craft.

    The limits are HISTORY_ERROR of the motion's peak, and FREQUENCY_ERROR of each frequency below the band [Hz] and of
    the LOWEST_MODES; the latter do not count if loads and commands alone excite the craft. Of several lengths of its
    members the worst is taken.
    """
    advice = [entry for craft in crafts if craft.modes is not None for entry in _truncation_warnings(craft, band)]
    return sorted(advice, key=lambda entry: -(entry.value or 0.0))[:1]


def _truncation_warnings(craft: CraftModes, band: float) -> list[Advice]:
    modes, response = craft.modes, craft.response
    assert modes is not None
    try:
        by_body = stiffness_errors(craft)
    except (ValueError, np.linalg.LinAlgError) as error:
        log.info(f"the truncation error of the craft is not estimated: {error_text(error, SINGULAR)}")
        return []
    if not by_body:
        return []
    squares = np.where(modes.omega > 0.0, modes.omega, np.inf) ** 2
    errors = 1.0 - np.sqrt(np.maximum(1.0 - sum(by_body.values()) / squares, 0.0))
    motion, mode = _history_error(errors, craft)
    forced = response is not None and any(share.any() for share in response.shares.values())
    lowest = 0 if forced and not craft.system.delta0 else LOWEST_MODES
    relevant = modes.relevant(lowest, band)
    wrong = [int(k) for k in relevant if errors[k] > FREQUENCY_ERROR]
    if motion > HISTORY_ERROR:
        text = (
            f"the elastic motion of this run may be {motion:.0%} of its peak off (limit {HISTORY_ERROR:.0%}), by what "
            f"the shapes of its bodies lack: {_error_text(modes, errors, mode)}"
        )
        value, limit, wrong = motion, HISTORY_ERROR, [mode]
    elif wrong:
        each = ", ".join(_error_text(modes, errors, k) for k in wrong)
        below = " and ".join([f"among the first {lowest}"] * (lowest > 0) + [f"below {band:g} Hz"] * (band > 0.0))
        text = (
            f"elastic frequencies of the craft {below} are over {FREQUENCY_ERROR:.0%} too high by what the shapes of "
            "its bodies lack (at rest, with linear strain"
            + f", lengths of t = {craft.t:.6g} s" * bool(craft.t)
            + f"): {each}"
        )
        value, limit = float(errors[wrong].max()), FREQUENCY_ERROR
    else:
        return []
    worst = {name: float(error[max(wrong, key=lambda k: errors[k])]) for name, error in by_body.items()}
    bodies = ", ".join(repr(name) for name, error in worst.items() if error >= max(worst.values()) / 2)
    text += (
        f". Raise the number of modes of {bodies}, or give the body more static shapes (`joints`); femflex converge "
        "--over modes shows how much it matters"
    )
    return [replace(doubt("", "truncation", text, value, limit), category=TruncationWarning)]


def stiffness_errors(craft: CraftModes) -> dict[str, Array]:
    """The error (n_modes,) [1/s^2] of omega^2 of each craft mode that the truncated set of each body causes."""
    assert craft.modes is not None
    modes, markers = craft.modes, joint_markers(craft.system)
    squares, loads, resolved, out = modes.omega**2, joint_loads(modes), {}, dict[str, Array]()
    for name, shapes in modes.shapes.items():
        if name not in craft.origins:
            continue
        names, frame = tuple(sorted(markers.get(name, ()))), modes.frames[name]
        key = (id(craft.origins[name]), names)
        if key not in resolved:
            resolved[key] = craft.origins[name].resolved(modes.system.bodies[name], names)
        if (body := resolved[key]) is not None:
            roots = np.vstack([frame.attitude.T @ frame.slide, frame.attitude.T @ frame.turn])
            out[name] = body.stiffness_error(shapes, squares, roots, loads[name])
    return out


def _history_error(errors: Array, craft: CraftModes) -> tuple[float, int]:
    """Largest error of a body's elastic motion or of a joint's rate, over its peak, and the mode with most of it.

    A relative frequency error e makes a mode out of phase by e omega t; from 1 rad on, the whole mode counts as error.
    """
    response, modes = craft.response, craft.modes
    assert modes is not None
    if response is None or not response.omega.size:
        return 0.0, 0
    number = np.abs(modes.omega[:, None] - response.omega).argmin(axis=0)
    near = np.abs(modes.omega[number] - response.omega) <= CLOSE * response.omega
    lost = np.minimum(1.0, np.where(near, errors[number], 0.0) * response.omega * response.ringing)
    parts = np.array([*response.shares.values(), response.recoil]) * lost
    worst = parts[int(np.argmax((parts**2).sum(axis=1)))]
    return min(float(np.linalg.norm(worst)), 1.0), int(number[np.argmax(worst)])


def _error_text(modes: RestModes, errors: Array, k: int) -> str:
    return f"the mode of {modes.omega[k] / (2.0 * np.pi):.4g} Hz is about {100.0 * errors[k]:.2g} % too high"


def unassessed_truncation(craft: CraftModes) -> list[Advice]:
    """A note on each body whose set is not assessed."""
    notes = []
    for name, body in craft.system.bodies.items():
        if not body.n_modes or name not in craft.origins:
            continue
        origin = craft.origins[name]
        reason = "its file has no elements" if origin.origin.source is None else craft.reason
        if origin.is_preloaded:
            reason = "its modes are computed about its preload"
        if reason:
            notes.append(Advice(name, "truncation", None, f"{NOT_ASSESSED} ({reason})"))
    return notes


Loads = dict[str, dict[str, Array]]  # body -> marker -> force and moment (6, m), body axes


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


def joint_loads(modes: RestModes) -> Loads:
    """Loads on each body at its joints in the m modes of a craft.

    In a tree, what a joint transmits is the rate of momentum of all bodies beyond it. With loops or springs, the loads
    are the least that balance each body's own equations.
    """
    system = modes.system
    if tie_markers(system.loops, (), system.springs):
        return {name: _balancing_loads(modes, name, joint_markers(system)[name]) for name in modes.shapes}
    loads: Loads = {name: {} for name in system.bodies}
    momenta = {name: _momentum(system.bodies[name], modes.frames[name]) for name in system.order}
    for name in reversed(system.order):
        joint, rate = system.joint_of(name), -(modes.omega**2) * momenta[name]
        _add_load(loads, system, modes.frames, (name, joint.child_marker), rate)
        if joint.parent is not None:
            _add_load(loads, system, modes.frames, (joint.parent, joint.parent_marker), -rate)
            momenta[joint.parent] = momenta[joint.parent] + momenta[name]
    return loads


def _momentum(body: FlexibleBody, frame: BodyMotion) -> Array:
    """Momentum and angular momentum about the base frame's origin (6, m) of a body that moves as its frame says."""
    v, omega = frame.attitude.T @ frame.slide, frame.attitude.T @ frame.turn
    centre, C = body.moments.first[0], body.moments.acceleration_loads()
    p = body.moments.mass * v + np.cross(omega.T, centre).T + C[:, :3].T @ frame.shape
    h = np.cross(centre, v.T).T + body.moments.inertia() @ omega + C[:, 3:].T @ frame.shape
    p, h = frame.attitude @ p, frame.attitude @ h
    return np.vstack([p, h + np.cross(frame.position, p.T).T])


def _add_load(
    loads: Loads, system: System, frames: Mapping[str, BodyMotion], end: tuple[str, str], wrench: Array
) -> None:
    """Add a force and moment about the base frame's origin (6, m) to the loads of a body at a marker."""
    (name, marker), frame = end, frames[end[0]]
    place = frame.position + frame.attitude @ system.bodies[name].marker(marker).position
    force, moment = wrench[:3], wrench[3:] - np.cross(place, wrench[:3].T).T
    load = np.vstack([frame.attitude.T @ force, frame.attitude.T @ moment])
    loads[name][marker] = loads[name].get(marker, 0.0) + load


def _balancing_loads(modes: RestModes, name: str, markers: set[str]) -> dict[str, Array]:
    """The least loads at these markers of a body that balance its motion, each measured by its static energy."""
    body, frame, squares = modes.system.bodies[name], modes.frames[name], modes.omega**2
    root = np.vstack([frame.attitude.T @ frame.slide, frame.attitude.T @ frame.turn])
    inertia = body.moments.elastic_mass() @ modes.shapes[name] + body.moments.acceleration_loads() @ root
    F = np.column_stack([body.marker(marker).loads for marker in sorted(markers)])
    size = np.sqrt(np.maximum((F * np.linalg.lstsq(body.strain.V1, F, rcond=None)[0]).sum(axis=0), 0.0))
    size[size <= 1e-9 * size.max(initial=0.0)] = np.inf
    f = (
        np.linalg.lstsq(F / size, body.strain.V1 @ modes.shapes[name] - squares * inertia, rcond=None)[0]
        / size[:, None]
    )
    return {marker: f[6 * k : 6 * k + 6] for k, marker in enumerate(sorted(markers))}
