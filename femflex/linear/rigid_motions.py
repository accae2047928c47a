"""Motion of every body with the coordinates, and the motions of a craft that its equations do not resist.

These are those of a free craft as a whole, and of free joints. A free craft may be anywhere, drift anywhere, be turned
any way and spin a little faster. Seen in a frame that spins at Omega these known solutions of the linear equations are,
for a displacement t and a rotation theta (both constant in inertial axes, the displacement also linear in time),

    dxi = T t + P theta,    t' = -Omega x t,    theta' = -Omega x theta,

so that their eigenvalues are 0 along the spin axis and +-i Omega across it, double and defective for drift. Found
numerically they would split by the root of the rounding and look like slow growth; they are taken out before instead
(`femflex.linear.small_motions`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from femflex.arrays import Array, BoolArray, ComplexArray
from femflex.body import FlexibleBody
from femflex.dynamics.joints.places import joint_places
from femflex.dynamics.model import Model
from femflex.dynamics.motion.freedoms import freedom_names, is_prescribed, usual_sizes
from femflex.dynamics.motion.increments import advanced
from femflex.dynamics.observe.markers import base_attitude
from femflex.linear.states import STEP
from femflex.rotations import dcm_from_quaternion, vector_from_dcm

MOTIONS = tuple(f"{kind} {axis}" for kind in ("translation", "rotation") for axis in "xyz")  # of a frame at rest
ALONG, SPIN = "translation along the spin axis", "spin"
ACROSS, TILT = "translation across the spin axis", "tilt of the spin axis"
WOBBLE = "wobble"  # of a free spin, seen from inertial space: nutation
LIBRATIONS = ("libration pitch", "libration yaw", "libration roll")  # about x0, y0, z0 of the orbital frame
FIELD_TOLERANCE = 1e-6  # relative misfit up to which a field is a rigid motion, or solves the linear equations
SPAN_TOLERANCE = 1e-3  # part of a neutral direction outside of those known before that makes it one more


@dataclass(frozen=True, eq=False)
class BodyMotion:
    """A body in a state, and its motion along m increments; components in the base frame F.

    position (3,)       of its frame's origin [m];            slide (3, m) its displacement
    attitude (3, 3)     C_FB;                                 turn (3, m) its rotation vector
    delta    (n_shapes,) amplitudes of its shapes;            shape (n_shapes, m) their increments
    """

    position: Array
    attitude: Array
    delta: Array
    slide: Array
    turn: Array
    shape: Array

    def components(self, motion: ComplexArray) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
        """slide, turn and shape (., k) of motions (m, k), which may be complex."""
        return self.slide @ motion, self.turn @ motion, self.shape @ motion

    def points(self, rest: Array, shapes: Array, motion: ComplexArray) -> tuple[Array, ComplexArray]:
        """Points (p, 3) of the body in F, and their displacements (k, p, 3) in motions (m, k).

        rest (p, 3) in the axes of the body; shapes (n_shapes, p, 3) their motion by its shapes
        """
        arms = (rest + np.einsum("spa,s->pa", shapes, self.delta)) @ self.attitude.T
        slide, turn, amplitudes = self.components(motion)
        elastic = np.einsum("spa,sk->kpa", shapes, amplitudes, optimize=True) @ self.attitude.T
        return self.position + arms, slide.T[:, None] + np.cross(turn.T[:, None], arms) + elastic

    def in_motions(self, motion: Array) -> BodyMotion:
        """The body along other increments, the columns of motion (m, k)."""
        return replace(self, slide=self.slide @ motion, turn=self.turn @ motion, shape=self.shape @ motion)

    def kinetic(self, body: FlexibleBody, motion: ComplexArray) -> Array:
        """Twice the kinetic energy (k,) of a body whose velocities are the motions (m, k), from its mass moments."""
        v, omega, rates = self.components(motion)
        v, omega = self.attitude.T @ v, self.attitude.T @ omega
        y = np.concatenate([[1.0], self.delta])
        W = np.zeros((v.shape[1], 3, 3), complex)  # omega x r = W r
        for a, b, c in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
            W[:, a, b], W[:, b, a] = -omega[c], omega[c]
        X = np.einsum("kab,A->kaAb", W, y)
        X[:, :, 1:, :] += np.einsum("ab,Ak->kaAb", np.eye(3), rates)
        moments = body.moments
        linear = np.einsum("ak,kaAb,Ab->k", v.conj(), X, moments.first, optimize=True)
        square = np.einsum("kaAb,AbBc,kaBc->k", X.conj(), moments.second, X, optimize=True)
        return np.asarray((moments.mass * np.sum(np.abs(v) ** 2, axis=0) + 2 * linear + square).real)


def body_motions(model: Model, x: Array) -> dict[str, BodyMotion]:
    """The motion of every body along each quasi-velocity (m = n_u) from the state of rest x (n_x,)."""
    q, sizes = x[: model.n_q], usual_sizes(model) * STEP
    steps = np.eye(model.n_u) * sizes
    rows = [q, *(advanced(model, q, s) for s in steps), *(advanced(model, q, -s) for s in steps)]
    states = np.array([model.at_rest(row) for row in rows])
    channels = model.observation(np.zeros(len(states)), states)
    C_FN, n = base_attitude(model.system, np.zeros(1), channels)[0].T, model.n_u
    out = {}
    for name in model.system.order:
        C = C_FN @ dcm_from_quaternion(channels[f"bodies/{name}/attitude"])
        position, delta = channels[f"bodies/{name}/position"] @ C_FN.T, channels[f"bodies/{name}/delta"]
        turn = vector_from_dcm(C[1 : n + 1] @ np.swapaxes(C[n + 1 :], 1, 2)) / (2 * sizes[:, None])
        slide, shape = ((part[1 : n + 1] - part[n + 1 :]) / (2 * sizes[:, None]) for part in (position, delta))
        out[name] = BodyMotion(position[0], C[0], delta[0], slide.T, turn.T, shape.T)
    return out


@dataclass(frozen=True, eq=False)
class KnownMotion:
    """A motion known to be neither growing nor decaying.

    name        such as "translation x", "tilt of the spin axis", "base-wheel.angle"
    eigenvalue  0, or i Omega where it stands still in inertial axes
    drifts      whether it also goes on at a constant rate
    shape       (n_u,) increments of the coordinates
    """

    name: str
    eigenvalue: complex
    drifts: bool
    shape: ComplexArray


@dataclass(frozen=True, eq=False)
class KnownMotions:
    """Known motions of a craft in a base frame that turns at `rate` (3,) [rad/s].

    moving  (n_u, k) fields that with their velocities, any of both, make solutions: translations across the spin
    turning (n_u, k) fields that turn backwards with the frame, and their velocities `turning_rate` (n_u, k)
    neutral (n_u, k) directions in which the craft stays wherever it is put
    """

    motions: tuple[KnownMotion, ...]
    moving: Array
    turning: Array
    turning_rate: Array
    neutral: Array


def rigid_fields(model: Model, bodies: Mapping[str, BodyMotion], triad: Array) -> tuple[Array, BoolArray]:
    """Increments (n_u, 6) of 1 m or 1 rad, of the craft along and about the axes of a triad (3, 3); which exist (6,).

    Turns are about the origin of the base frame. Only joints to the base frame move, none of them where it is locked
    or prescribed.
    """
    roots = [name for name in model.system.order if model.system.joint_of(name).parent is None]
    places = [u + k for joint, _, u in joint_places(model.system) if joint.parent is None for k in range(joint.n_u)]
    prescribed = is_prescribed(model)
    columns = [k for k in places if not prescribed[k]]
    span = max(1e-300, *(float(np.abs(bodies[name].position).max()) for name in roots)) if roots else 1.0
    moves = np.concatenate([np.vstack([bodies[name].slide, bodies[name].turn]) for name in roots])[:, columns]
    targets = np.concatenate([
        np.vstack([
            np.hstack([triad, np.cross(triad.T, bodies[name].position).T]),
            np.hstack([np.zeros((3, 3)), triad]),
        ])
        for name in roots
    ])  # fmt: skip
    fields = np.zeros((model.n_u, 6))
    fields[columns] = np.linalg.lstsq(moves, targets, rcond=None)[0] if columns else 0.0
    misfit = np.linalg.norm(moves @ fields[columns] - targets, axis=0) if columns else np.ones(6)
    return fields, misfit <= FIELD_TOLERANCE * max(1.0, span)


def known_motions(
    model: Model, bodies: Mapping[str, BodyMotion], equations: tuple[Array, Array, Array], neutral: Array
) -> KnownMotions:
    """The known motions about an equilibrium.

    equations: M, D, K (n_u, n_u). neutral (n_u, k): directions that no force resists, as the search for the equilibrium
    left them.
    """
    frame, sizes = model.system.frame, usual_sizes(model)
    rate = frame.rate if frame.kind == "spinning" else np.zeros(3)
    speed = float(np.linalg.norm(rate))
    fields, exist = rigid_fields(model, bodies, _triad(rate / speed) if speed else np.eye(3))
    motions = [
        KnownMotion(name, 0j, True, fields[:, k].astype(complex))
        for k, name in (((0, ALONG), (3, SPIN)) if speed else enumerate(MOTIONS))
        if exist[k]
        and (
            _is_in_span(fields[:, k], neutral, sizes)
            or (speed and _has_no_stiffness(fields[:, k], equations, speed, sizes))
        )
    ]
    rigid = np.array([motion.shape.real for motion in motions]).reshape(-1, model.n_u).T
    moving, turning = np.zeros((model.n_u, 0)), np.zeros((model.n_u, 0))
    J = speed * np.array([[0.0, -1.0], [1.0, 0.0]])  # Omega x, over both axes across the spin
    if speed and exist[1:3].all() and _solves_as_translation(fields[:, 1:3], equations, J, sizes):
        moving = fields[:, 1:3]
        motions += [KnownMotion(ACROSS, 1j * speed, True, moving[:, k].astype(complex)) for k in range(2)]
    if speed and exist[4:].all() and _solves_as_rotation(fields[:, 4:], equations, J, sizes):
        turning = fields[:, 4:]
        motions.append(KnownMotion(TILT, 1j * speed, False, turning @ np.array([1.0, 1j])))
    others, names = _outside_rigid_motions(neutral, rigid, sizes), freedom_names(model.system)
    for direction in others.T:  # named by the coordinate that it moves most
        name = names[int(np.argmax(np.abs(direction / sizes)))]
        motions.append(KnownMotion(name, 0j, True, direction.astype(complex)))
    turning_rate = -turning @ J if turning.size else turning
    return KnownMotions(tuple(motions), moving, turning, turning_rate, np.hstack([rigid, others]))


def _triad(axis: Array) -> Array:
    """Return orthonormal columns (3, 3), right-handed, the first along the axis."""
    first = np.cross(axis, np.eye(3)[int(np.argmin(np.abs(axis)))])
    first /= np.linalg.norm(first)
    return np.column_stack([axis, first, np.cross(axis, first)])


def _is_in_span(field: Array, neutral: Array, sizes: Array) -> bool:
    """Whether a field (n_u,) lies in the span of the neutral directions (n_u, k)."""
    if not neutral.shape[1]:
        return False
    basis = np.linalg.qr(neutral / sizes[:, None])[0]
    scaled = field / sizes
    return bool(np.linalg.norm(scaled - basis @ (basis.T @ scaled)) <= SPAN_TOLERANCE * np.linalg.norm(scaled))


def _has_no_stiffness(field: Array, equations: tuple[Array, Array, Array], speed: float, sizes: Array) -> bool:
    """Whether the stiffness along a field is zero compared with that of its inertia in the spin."""
    M, _, K = equations
    return _is_negligible(sizes * (K @ field), sizes * (M @ field) * speed**2)


def _solves_as_translation(T: Array, equations: tuple[Array, Array, Array], J: Array, sizes: Array) -> bool:
    """Whether T t, with t any straight motion in inertial axes, solves the equations: D T = 2 M T J, K T = M T J^2."""
    M, D, K = equations
    scale = sizes[:, None]
    coriolis, centrifugal = scale * (M @ T @ J), scale * (M @ T @ J @ J)
    return _is_negligible(scale * (D @ T) - 2 * coriolis, coriolis) and _is_negligible(
        scale * (K @ T) - centrifugal, centrifugal
    )


def _solves_as_rotation(P: Array, equations: tuple[Array, Array, Array], J: Array, sizes: Array) -> bool:
    """Whether P theta, with theta constant in inertial axes, solves the equations: M P J^2 - D P J + K P = 0."""
    M, D, K = equations
    parts = [sizes[:, None] * part for part in (M @ P @ J @ J, D @ P @ J, K @ P)]
    return _is_negligible(parts[0] - parts[1] + parts[2], np.abs(parts[0]) + np.abs(parts[1]) + np.abs(parts[2]))


def _is_negligible(misfit: Array, reference: Array) -> bool:
    return bool(np.abs(misfit).max(initial=0.0) <= FIELD_TOLERANCE * np.abs(reference).max(initial=0.0))


def _outside_rigid_motions(neutral: Array, rigid: Array, sizes: Array) -> Array:
    """Return the neutral directions (n_u, m) that the rigid ones (n_u, k) do not contain."""
    if not neutral.shape[1]:
        return neutral
    scaled = neutral / sizes[:, None]
    scaled = scaled / np.linalg.norm(scaled, axis=0)
    if rigid.shape[1]:
        basis = np.linalg.qr(rigid / sizes[:, None])[0]
        scaled = scaled - basis @ (basis.T @ scaled)
    U, sigma, _ = np.linalg.svd(scaled, full_matrices=False)
    return np.asarray(U[:, sigma > SPAN_TOLERANCE] * sizes[:, None])
