"""Motion of joints: slides, turns and their rates; for rotations the angle that remains to a singularity."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

from femflex.arrays import Array
from femflex.dynamics.joints.places import has_singularity, joint_places, latch_places
from femflex.dynamics.report import Observation, Report
from femflex.rotations import coordinates_from_dcm, dcm_from_coordinates, dcm_from_quaternion, singularity_distance
from femflex.system import Channel, Joint, System
from femflex.system.gimbal_lock import can_lock, lock_angle

Quantity = tuple[str, Channel, Callable[[Array, Array], Array]]


class Joints(Report):
    """The quantities of every joint, in tree order."""

    def channels(self, system: System) -> dict[str, Channel]:
        return {
            f"joints/{joint.label}/{key}": channel
            for joint, _, _ in joint_places(system)
            for key, channel, _ in quantities(joint)
        }

    def observe(self, seen: Observation) -> Iterator[Array]:
        for joint, iq, iu in joint_places(seen.system):
            q, u = seen.q[:, iq : iq + joint.n_q], seen.u[:, iu : iu + joint.n_u]
            yield from (value(q, u) for _, _, value in quantities(joint))


def quantities(joint: Joint) -> Iterator[Quantity]:
    """Last part of its path, channel, and value by q (n_t, n_q) and u (n_t, n_u), of each quantity of a joint.

    The motion of a free body in the base frame is the body's own, and is not reported again.
    """
    n, short, rotation = len(joint.translations), joint.label + ".", joint.ball or ""
    names = [(name.removeprefix(short), unit) for name, unit in joint.coordinate_names()]
    moves = joint.n_u > 0 and (joint.parent is not None or joint.ball is None)
    if moves and n:
        yield "slide", channel_of(names[:n], f"slide of joint {joint.label}"), lambda q, u: squeezed(q[:, :n])
    if moves and joint.ball is None and names[n:]:
        yield "angle", channel_of(names[n:], f"angle of turn of joint {joint.label}"), lambda q, u: squeezed(q[:, n:])
    if moves:
        rates = [(name.removeprefix(short), unit) for name, unit in joint.velocity_names()]
        text = f"; omega relative to the parent, in axes of {joint.child}.{joint.child_marker}" if joint.ball else ""
        turns = len(joint.prescribed) < joint.n_u or any(motion.moves for motion in joint.prescribed.values())
        channel = replace(channel_of(rates, f"rate of joint {joint.label}{text}"), reported=turns)
        yield "rate", channel, lambda q, u: squeezed(u)
    if joint.ball is not None and (joint.rebase or moves):
        text = ", independent of the reference of q" if joint.rebase else ""
        channel = channel_of(names[joint.ball_slice()], f"{joint.ball} from the parent's marker{text}")
        yield "rotation", channel, lambda q, u: rotation_coordinates(joint, rotation, q)
    if has_singularity(joint):
        channel = Channel("rad", f"angle to the singularity of {joint.ball}")
        yield "singularity", channel, lambda q, u: singularity_distance(q[:, joint.ball_slice()], rotation)
    if can_lock(joint):
        channel = Channel("rad", "angle left to gimbal lock of its free turns")
        yield "singularity", channel, lambda q, u: lock_angle(joint, q)


def rotation_coordinates(joint: Joint, rotation: str, q: Array) -> Array:
    """Coordinates of a ball (n_t, 3 or 4) from the parent's marker, at coordinates q (n_t, n_q) of its joint."""
    ball, n = q[:, joint.ball_slice()], len(joint.translations)
    if not joint.rebase:
        return ball
    C_PR = dcm_from_quaternion(q[:, n + 3 : n + 7])
    return coordinates_from_dcm(C_PR @ dcm_from_coordinates(ball, rotation), rotation)


def squeezed(values: Array) -> Array:
    """Values (n_t, n), those of a single column (n_t,)."""
    return values[:, 0] if values.shape[1] == 1 else values


def channel_of(parts: list[tuple[str, str]], text: str) -> Channel:
    """A channel of named parts with their units; of a single part a scalar."""
    names, units = zip(*parts, strict=True)
    if len(parts) == 1:
        return Channel(units[0], text)
    unit = units[0] if len(set(units)) == 1 else ", ".join(units)
    return Channel(unit, text, (len(parts),), names)


class Latches(Report):
    """Every latch, per body in tree order."""

    def channels(self, system: System) -> dict[str, Channel]:
        out = {}
        for place in latch_places(system):
            name = place.joint.freedom_names()[place.latch.freedom]
            out[f"latches/{name}/locked"] = Channel("1", f"1 from when {name} latched")
            out[f"latches/{name}/time"] = Channel("s", f"when {name} latched; -1 before; -2 - t once released at t")
            out[f"latches/{name}/loss"] = Channel("J", f"energy lost when {name} latched")
        return out

    def observe(self, seen: Observation) -> Iterator[Array]:
        for place in latch_places(seen.system):
            time, loss = seen.z[:, place.time], seen.z[:, place.time + 1]
            yield from ((time >= 0).astype(float), time, loss)
