"""The system: bodies and joints in a tree over the base frame, with orbit and loads."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from difflib import get_close_matches
from functools import cached_property
from typing import Any

import numpy as np

from femflex.arrays import Array
from femflex.body import FlexibleBody
from femflex.noun.names import name_problems, prefix_problems
from femflex.summary import Rows, Summarised, listed
from femflex.system.connections import tie_markers, tie_problems
from femflex.system.constraint import Nonholonomic
from femflex.system.controller import Controller
from femflex.system.effector import Effector
from femflex.system.effector_problems import effector_problems
from femflex.system.environment import Environment
from femflex.system.joint import Joint
from femflex.system.joint_coordinates import latch_start_problems
from femflex.system.length_table import LengthTable
from femflex.system.load import Load
from femflex.system.orbit import CRAFT_SIGNALS, EARTH_RADIUS, MU_EARTH, ORBIT_SIGNALS, Frame, Orbit
from femflex.system.segments import Part, effector_at_segments, with_segment_names, with_segments
from femflex.system.sight import Sight
from femflex.system.spring import Spring
from femflex.system.variation import Variation

ALIKE = 1e-2  # of mu, up to which a central body counts as the Earth


@dataclass(frozen=True, eq=False, repr=False)
class System(Summarised):
    """Bodies and joints in a tree, in any numbering; body names are the keys of `bodies`.

    bodies   name -> FlexibleBody
    joints   one per body, in any order; parent None means the base frame
    frame    base frame F of joints without a parent
    orbit    None, or the orbit of O; then one root body, and F's origin is O
    environment  uniform gravity, where there is no orbit
    delta0   body name -> initial elastic coordinates (n,);  ddelta0 their rates
    z0       name of a state of z -> its initial value, where it is not the one that its owner gives
    libration_sequence  angles reported of the root joint's marker on the root body relative to F, such as "xzy" or
             "extrinsic xzy"
    loops        joints cut out of the tree: each closes a loop between two bodies, or to the base frame
    constraints  on velocities: rolling, knife edges, general rows
    springs      between two markers
    effectors    forces computed by functions, with states of their own, sampled controllers, and sensors (see
                 `with_effectors` for those of femflex.effectors)
    sights       axes that are to look at a station on the Earth
    reactions    whether runs report what the joints carry
    momenta      whether runs report canonical momenta and the Hamiltonian
    keep         joints, or joint coordinates such as "drive.angle", whose initial values stay exact where loops close
    varying  body name -> Variation: how its properties depend on time
    segments  body cut into segments -> names of the bodies that are its segments, near to far (see `assembled`)

    With a specified orbit O is the centre of mass: the root joint's translation is eliminated, so the root joint must
    have none (spherical: attitude free; specified turns: attitude held). With a free orbit the root joint is `free`.
    Raises ValueError for a tree that is not one, markers or bodies that do not exist, and shapes that do not fit.
    """

    bodies: dict[str, FlexibleBody]
    joints: tuple[Joint, ...]
    loads: tuple[Load, ...] = ()
    frame: Frame = field(default_factory=Frame)
    orbit: Orbit | None = None
    delta0: dict[str, Array] = field(default_factory=dict)
    ddelta0: dict[str, Array] = field(default_factory=dict)
    libration_sequence: str = "xzy"
    segments: dict[str, tuple[str, ...]] = field(default_factory=dict)
    loops: tuple[Joint, ...] = ()
    constraints: tuple[Nonholonomic, ...] = ()
    springs: tuple[Spring, ...] = ()
    sights: tuple[Sight, ...] = ()
    effectors: tuple[Effector | Controller, ...] = ()
    reactions: bool = False
    momenta: bool = False
    keep: tuple[str, ...] = ()
    environment: Environment = field(default_factory=Environment)
    z0: dict[str, float] = field(default_factory=dict)
    varying: dict[str, Variation] = field(default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "loads", tuple(load.read_from() for load in self.loads))
        entries = list(self.effectors.values()) if isinstance(self.effectors, Mapping) else list(self.effectors)
        others = [type(entry).__name__ for entry in entries if not isinstance(entry, Effector | Controller)]
        if isinstance(self.effectors, Mapping) or others:
            text = f"a mapping of {', '.join(others)}" if isinstance(self.effectors, Mapping) else ", ".join(others)
            raise TypeError(
                f"System: effectors is {text}; it is a tuple of Effector and Controller. Those of femflex.effectors "
                'are mounted by name: system.with_effectors(craft, {"star": Sensor(...)})'
            )
        problems = [*self._tree_problems(), *self._orbit_problems(), *self._name_problems()]
        problems += keep_problems(self.keep, self.joints)
        problems += self._variation_problems()
        problems += tie_problems(self.loops, self.constraints, self.springs, self.orbit)
        problems += effector_problems(
            self.effectors, self.bodies, self.joints, () if self.orbit is None else ORBIT_SIGNALS + CRAFT_SIGNALS
        )
        if problems:
            raise ValueError("\n".join(problems))

    def summary(self) -> tuple[str, Rows]:
        """Return a text: bodies, joints, elements that act, and the number of degrees of freedom."""
        mass = sum(body.moments.mass for body in self.bodies.values())
        elastic = sum(body.n_modes for body in self.bodies.values())
        rows = [
            ("bodies", f"{len(self.bodies)}: {listed(self.order)}"),
            ("mass", f"{mass:.6g} kg"),
            ("degrees of freedom", f"{len(self.velocity_names())}, {elastic} of them elastic"),
            ("joints", listed([joint.label for joint in self.joints])),
        ]
        for key in ("loops", "constraints", "loads", "springs", "effectors"):
            items: Sequence[Any] = getattr(self, key)
            names = [str(getattr(item, "label", None) or getattr(item, "name", "")) for item in items]
            rows += [(key, listed(names))] if names else []
        rows += [("varying bodies", listed(sorted(self.varying)))] if self.varying else []
        if self.orbit is not None:
            rows += [("orbit", f"{'free' if self.orbit.free else 'specified'}, period {self.orbit.period:.6g} s")]
        return "System", [*rows, ("frame", self.frame.kind)]

    @cached_property
    def order(self) -> list[str]:
        """Return body names with parents before their children; by distance from the base, then in the order given."""
        depth: dict[str | None, int] = {None: 0}
        for body in self.bodies:
            path = [body]
            while (up := self.joint_of(path[-1]).parent) not in depth:
                assert up is not None
                path.append(up)
            depth |= {name: depth[up] + k for k, name in enumerate(reversed(path), start=1)}
        return sorted(self.bodies, key=depth.__getitem__)

    def joint_of(self, body: str) -> Joint:
        """The joint whose child is that body."""
        return self._joint_above[body]

    @cached_property
    def _joint_above(self) -> dict[str, Joint]:
        return {joint.child: joint for joint in self.joints}

    @property
    def root(self) -> str:
        """The first body with a joint to the base frame."""
        return next(b for b in self.order if self.joint_of(b).parent is None)

    @property
    def controllers(self) -> list[Controller]:
        """The sampled controllers."""
        return [effector for effector in self.effectors if isinstance(effector, Controller)]

    def coordinate_names(self) -> list[tuple[str, str]]:
        """Name and unit of every coordinate of q: per body in tree order its joint's, then its elastic ones."""
        return list(self._coordinate_names)

    def velocity_names(self) -> list[tuple[str, str]]:
        """Name and unit of every quasi-velocity of u, in the same order."""
        return list(self._velocity_names)

    def state_names(self) -> list[tuple[str, str]]:
        """Name and unit of every state of z: per body in tree order those of its joint's latches, then of effectors."""
        return list(self._state_names)

    @cached_property
    def _coordinate_names(self) -> list[tuple[str, str]]:
        return [
            pair for b in self.order for pair in (*self.joint_of(b).coordinate_names(), *self._elastic_names(b, ""))
        ]

    @cached_property
    def _velocity_names(self) -> list[tuple[str, str]]:
        return [
            pair for b in self.order for pair in (*self.joint_of(b).velocity_names(), *self._elastic_names(b, "_rate"))
        ]

    @cached_property
    def _state_names(self) -> list[tuple[str, str]]:
        return [pair for owner in self._state_owners() for pair in owner.state_names()]

    def state_sizes(self) -> Array:
        """Usual sizes of the states of z (n_z,)."""
        sizes = (getattr(owner, "sizes", np.ones(len(owner.state_names()))) for owner in self._state_owners())
        return np.concatenate([np.zeros(0), *sizes])

    def all_state_names(self) -> list[tuple[str, str]]:
        """Name and unit of every state of x = (q, u, z)."""
        return [*self.coordinate_names(), *self.velocity_names(), *self.state_names()]

    def initial_state(self) -> Array:
        """x0 = (q, u, z) at t = 0."""
        q, u = [], []
        for b in self.order:
            n, joint = self.bodies[b].n_modes, self.joint_of(b)
            q += [joint.q0, self.delta0.get(b, np.zeros(n))]
            u += [joint.u0, self.ddelta0.get(b, np.zeros(n))]
        return np.concatenate([*q, *u, self._initial_z()])

    def _state_owners(self) -> list[Joint | Effector | Controller]:
        """Return the elements that have states, in the order of z."""
        return [*(self.joint_of(b) for b in self.order), *self.effectors]

    def _initial_z(self) -> Array:
        values = np.concatenate([np.zeros(0), *(owner.initial_states() for owner in self._state_owners())])
        names = [name for name, _ in self.state_names()]
        return np.array([self.z0.get(name, value) for name, value in zip(names, values, strict=True)])

    def _elastic_names(self, body: str, suffix: str) -> list[tuple[str, str]]:
        unit = "kg^1/2 m" + ("/s" if suffix else "")
        return [(f"{body}.delta{k + 1}{suffix}", unit) for k in range(self.bodies[body].n_modes)]

    def _tree_problems(self) -> list[str]:
        body_names = sorted(self.bodies)
        out = [] if self.bodies else ["the system has no bodies"]
        out += [text for j in self.joints if (text := j.singular_start()) is not None]
        out += [text for j in self.joints for text in latch_start_problems(j, self.z0)]
        out += [
            f"joint {j.label!r} has play, but its coordinates keep it together exactly; play belongs to a loop"
            for j in self.joints
            if j.play
        ]
        parent: dict[str, str | None] = {}
        for j in self.joints:
            for role, name in (("child", j.child), ("parent", j.parent)):
                if name is not None and name not in self.bodies:
                    out.append(f"{role} {name!r} of joint {j.label!r} is not a body; bodies are {body_names}")
            if j.child == j.parent:
                out.append(f"joint {j.label!r} joins body {j.child!r} to itself")
            if j.child in parent:
                out.append(f"body {j.child!r} is the child of two joints; a tree gives every body one parent")
            parent[j.child] = j.parent
        out += [
            f"body {b!r} has no joint; join it to a parent or to the base frame" for b in body_names if b not in parent
        ]
        if out:
            return out
        for b in body_names:
            path = [b]
            while (up := parent[path[-1]]) is not None:
                if up in path:
                    loop = " -> ".join([*path[path.index(up) :], up])
                    return [
                        f"the tree of joints is cyclic: {loop}; one body of the cycle must be joined to the base frame"
                    ]
                path.append(up)
        return []

    def _orbit_problems(self) -> list[str]:
        if self.orbit is None:
            return (
                ["the orbital frame needs an orbit; give one, or measure attitude from the inertial frame"]
                if self.frame.kind == "orbital"
                else []
            )
        if self.environment.has_weight:
            g = float(np.linalg.norm(self.environment.gravity))
            return [
                f"uniform gravity of {g:.4g} m/s^2 with an orbit, whose gravity is that of the central body; give "
                "one of them"
            ]
        roots = [j for j in self.joints if j.parent is None]
        if len(roots) > 1:
            return [f"an orbiting system has one root body; found {[j.child for j in roots]}"]
        slides = len(roots[0].translations) if roots else 0
        if self.orbit.free and slides != 3:
            return [f"a free orbit needs a free root joint; joint {roots[0].label!r} has {slides} translations"]
        if not self.orbit.free and slides:
            label, kind = roots[0].label, roots[0].kind
            return [
                "a specified orbit eliminates the root's translation; "
                f"joint {label!r} must be spherical, weld or turning, not {kind}"
            ]
        return [*self._attraction_problems(self.orbit)]

    def _attraction_problems(self, orbit: Orbit) -> Iterator[str]:
        """Problems of zonal harmonics and third bodies that do not fit the orbit."""
        environment, perigee = self.environment, orbit.semi_major_axis * (1.0 - orbit.eccentricity)
        of_earth = abs(orbit.mu / MU_EARTH - 1.0) < ALIKE
        if environment.zonals.size and environment.radius == EARTH_RADIUS and not of_earth:
            yield (
                f"oblateness of a body whose mu is {orbit.mu:.4g} m^3/s^2 has the Earth's radius; give the radius that "
                "its J2 is defined with"
            )
        elif environment.zonals.size and perigee < environment.radius:
            yield (
                f"the perigee is {perigee / 1e3:.6g} km from the centre, inside the body, whose radius is "
                f"{environment.radius / 1e3:.6g} km; its oblateness acts on orbits outside it"
            )
        if not environment.third_bodies:
            return
        names = " and ".join(environment.third_bodies)
        if not orbit.free:
            yield (
                f"environment.third_bodies has {names}, and the orbit is specified, so that their tides cannot change "
                "it; set orbit.kind = 'free', or leave them out"
            )
        if not of_earth:
            yield (
                f"environment.third_bodies has {names}, whose places are those seen from the Earth, and the orbit's mu "
                f"is {orbit.mu:.4g} m^3/s^2; leave them out"
            )

    def _name_problems(self) -> list[str]:
        out = self._illegal_names()
        markers = [
            (f"joint {j.label!r}", b, m)
            for j in self.joints
            for b, m in ((j.child, j.child_marker), (j.parent, j.parent_marker))
            if b in self.bodies
        ]
        markers += [(f"load {load.name!r}", load.body, load.marker) for load in self.loads]
        markers += [(f"sight {sight.name!r}", sight.body, sight.marker) for sight in self.sights]
        if self.sights and self.orbit is None:
            out.append(f"sight {self.sights[0].name!r} looks at a station on the Earth; give an orbit")
        markers += tie_markers(self.loops, self.constraints, self.springs)
        for who, body, marker in markers:
            if body not in self.bodies:
                out.append(f"body {body!r} of {who} does not exist; bodies are {sorted(self.bodies)}")
            elif marker not in self.bodies[body].markers:
                marker_names = sorted(self.bodies[body].markers)
                out.append(f"marker {marker!r} of {who} is not on body {body!r}; its markers are {marker_names}")
        for what in ("delta0", "ddelta0"):
            for body, value in getattr(self, what).items():
                n = self.bodies[body].n_modes if body in self.bodies else -1
                if np.shape(value) != (n,):
                    out.append(f"{what} of body {body!r} has shape {np.shape(value)}; expected ({n},)")
        return out

    def _variation_problems(self) -> list[str]:
        unknown = [
            f"body {name!r}, whose properties are to vary, does not exist; bodies are {sorted(self.bodies)}"
            for name in self.varying
            if name not in self.bodies
        ]
        existing = {name: variation for name, variation in self.varying.items() if name in self.bodies}
        growing = [name for name, variation in existing.items() if "growth" in variation.acting]
        if growing and self.orbit is not None:
            unknown.append(
                f"mass arrives on body {growing[0]!r}, and the system is in an orbit, whose gravity on arriving mass "
                "is not counted in the balance of energy; leave 'growth' out of its variation, or give no orbit"
            )
        without_points = [
            name for name, variation in existing.items() if "mass" in variation.acting and not _has_points(variation)
        ]
        if without_points and self.environment.attraction == "exact":
            unknown.append(
                f"attraction 'exact' is integrated over points of mass, and those of body {without_points[0]!r}, whose "
                "mass varies with time, are not known: uniform members that deploy have them; take attraction = "
                "'gradient'"
            )
        unknown += self._length_problems(existing)
        return unknown + [text for name, v in existing.items() for text in v.problems(name, self.bodies[name])]

    def _length_problems(self, varying: Mapping[str, Variation]) -> list[str]:
        """Sentences on lengths that are states."""
        if self._tree_problems():  # without a tree the states have no order
            return []
        states = [name for name, _ in self.state_names()]
        out = []
        for name, variation in varying.items():
            length = variation.write.length if isinstance(variation.write, LengthTable) else None
            if not isinstance(length, str):
                continue
            if length not in states:
                out.append(
                    f"the length of body {name!r} is state {length!r}, which does not exist; states are {states}"
                )
            elif states.index(length) + 1 >= len(states):
                out.append(f"the length of body {name!r} is state {length!r}; the state after it must be its rate")
        return out

    def _illegal_names(self) -> list[str]:
        names: dict[str, list[str]] = {
            "body": [*self.bodies, *self.segments],
            "marker": [m for b in self.bodies.values() for m in b.markers if not m.startswith(".")],  # ends of segments
            "joint or loop": [joint.label for joint in (*self.joints, *self.loops)],
            "law": [law.name for joint in (*self.joints, *self.loops) for law in joint.laws if law.name],
            "load": [load.name for load in self.loads],
            "constraint": [constraint.name for constraint in self.constraints],
            "spring": [spring.name for spring in self.springs],
            "sight": [sight.name for sight in self.sights],
            "effector": [effector.name for effector in self.effectors],
        }
        out = [problem for kind, used in names.items() for problem in name_problems(kind, dict.fromkeys(used))]
        segment_names = [name for parts in self.segments.values() for name in parts]
        out += prefix_problems("bodies", [*(set(self.bodies) - set(segment_names)), *self.segments])
        return out + prefix_problems("joints", [joint.label for joint in self.joints])


def _has_points(variation: Variation) -> bool:
    """Whether the points of mass of a body that varies are known."""
    return isinstance(variation.write, LengthTable) and variation.write.points is not None


def started(system: System, x: Array) -> System:
    """The system with the initial state x = (q, u, z)."""
    n_q, n_u = len(system.coordinate_names()), len(system.velocity_names())
    q, u, z = np.split(np.asarray(x, float), [n_q, n_q + n_u])
    z0 = {name: float(value) for (name, _), value in zip(system.state_names(), z, strict=True)}
    joints, delta, ddelta = {}, {}, {}
    for name in system.order:
        joint, n = system.joint_of(name), system.bodies[name].n_modes
        joints[name] = joint.with_initial(q[: joint.n_q], u[: joint.n_u])
        delta[name], ddelta[name] = q[joint.n_q : joint.n_q + n], u[joint.n_u : joint.n_u + n]
        q, u = q[joint.n_q + n :], u[joint.n_u + n :]
    new_joints = tuple(joints[joint.child] for joint in system.joints)
    return replace(system, joints=new_joints, delta0=delta, ddelta0=ddelta, z0=z0)


def assembled(parts: Mapping[str, Part], joints: Sequence[Joint], loads: Sequence[Load] = (), **more: Any) -> System:
    """Return the System of bodies of which some are cut into Segments; other elements name these as one body."""
    bodies, all_joints, acting, segments = with_segments(parts, joints, loads)
    for key in ("loops", "constraints", "springs", "sights"):
        more[key] = tuple(with_segment_names(tie, parts) for tie in more.get(key, ()))
    more["effectors"] = tuple(
        effector_at_segments(effector, parts) if isinstance(effector, Effector) else effector
        for effector in more.get("effectors", ())
    )
    return System(bodies, all_joints, acting, segments=segments, **more)


def keepable_names(joint: Joint) -> dict[str, list[int]]:
    """Return every name that may be kept, and the freedoms of the joint under it; a ball only as a whole."""
    single = len(joint.translations) + (len(joint.rotations) if joint.ball is None else 0)
    names = {joint.label: list(range(joint.n_u))} if joint.n_u else {}
    return names | {name: [k] for k, name in enumerate(joint.freedom_names()[:single])}


def kept_coordinates(keep: Sequence[str], joint: Joint) -> list[int]:
    """Freedoms of the joint whose initial values stay as given."""
    names = keepable_names(joint)
    return sorted({k for name in keep for k in names.get(name, ())})


def keep_problems(keep: Sequence[str], joints: Sequence[Joint]) -> list[str]:
    """Return sentences on names under which nothing can be kept."""
    keepable = [name for joint in joints for name in keepable_names(joint)]
    out = []
    for name in keep:
        if name not in keepable:
            matches = get_close_matches(name, keepable, n=1)
            hint = f"did you mean {matches[0]!r}? " if matches else ""
            out.append(
                f"keep names {name!r}, which is no joint that moves and no slide or turn of one; {hint}"
                f"known are {', '.join(keepable)}"
            )
    return out
