"""Motions of a craft that its equations do not resist: of a free craft as a whole, and of free joints.

A free craft may be anywhere, drift anywhere, be turned any way and spin a little faster. Seen in a frame that spins at
Omega these known solutions of the linear equations are, for a displacement t and a rotation theta (both constant in
inertial axes, the displacement also linear in time),

    dxi = T t + P theta,    t' = -Omega x t,    theta' = -Omega x theta,

so that their eigenvalues are 0 along the spin axis and +-i Omega across it, double and defective for drift. Found
numerically they would split by the root of the rounding and look like slow growth; they are taken out before instead
(`femflex.dynamics.linear.small_motions`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from femflex.arrays import Array, BoolArray, ComplexArray
from femflex.dynamics.linear.body_motions import BodyMotion
from femflex.dynamics.linear.linearised import is_prescribed
from femflex.dynamics.lowering.layout import body_records
from femflex.dynamics.model import Model

FIELD_TOLERANCE = (
    1e-6  # misfit, relative, up to which a field is one of rigid motion, or a solution of the linear equations
)
SPAN_TOLERANCE = 1e-3  # part of a neutral direction outside of those known before that makes it one more


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
    """Increments (n_u, 6) that move the whole craft along and about the axes of a triad (3, 3), and which exist (6,).

    Turns are about the origin of the base frame. Only joints to the base frame move, none of them where it is locked
    or prescribed.
    """
    roots = [name for name in model.system.order if model.system.joint_of(name).parent is None]
    prescribed, columns = is_prescribed(model), []
    for name, record in zip(model.system.order, body_records(model.table)[1:], strict=True):
        if name in roots:
            columns += [int(record["u"]) + k for k in range(model.system.joint_of(name).n_u)]
    columns = [k for k in columns if not prescribed[k]]
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
    model: Model, bodies: Mapping[str, BodyMotion], equations: tuple[Array, Array, Array], neutral: Array, sizes: Array
) -> KnownMotions:
    """The known motions about an equilibrium.

    equations: M, D, K (n_u, n_u). neutral (n_u, k): directions that no force resists, as the search for the equilibrium
    left them; sizes (n_u,): usual sizes of the coordinates.
    """
    frame = model.system.frame
    rate = frame.rate if frame.kind == "spinning" else np.zeros(3)
    speed = float(np.linalg.norm(rate))
    triad = _triad(rate / speed) if speed else np.eye(3)
    fields, exist_all = rigid_fields(model, bodies, triad)
    T, P = fields[:, :3], fields[:, 3:]
    names = ("along the spin axis",) if speed else ("x", "y", "z")
    motions: list[KnownMotion] = []
    rigid: list[Array] = []
    for kind, X, exist in (("translation", T, exist_all[:3]), ("rotation", P, exist_all[3:])):
        for field, exists, axis_name in zip(X.T, exist, names, strict=False):
            name = f"{kind} {axis_name}"
            if exists and (
                _is_in_span(field, neutral, sizes) or (speed and _has_no_stiffness(field, equations, speed, sizes))
            ):
                name = "spin" if speed and kind == "rotation" else name
                motions.append(KnownMotion(name, 0j, True, field.astype(complex)))
                rigid.append(field)
    moving, turning = np.zeros((model.n_u, 0)), np.zeros((model.n_u, 0))
    J = speed * np.array([[0.0, -1.0], [1.0, 0.0]])  # Omega x, over both axes across the spin
    if speed and exist_all[1:3].all() and _solves_as_translation(T[:, 1:], equations, J, sizes):
        moving = T[:, 1:]
        across = "translation across the spin axis"
        motions += [KnownMotion(across, 1j * speed, True, moving[:, k].astype(complex)) for k in range(2)]
    if speed and exist_all[4:].all() and _solves_as_rotation(P[:, 1:], equations, J, sizes):
        turning = P[:, 1:]
        motions.append(KnownMotion("tilt of the spin axis", 1j * speed, False, turning @ np.array([1.0, 1j])))
    if len(others := _outside_rigid_motions(neutral, np.array(rigid).reshape(len(rigid), model.n_u).T, sizes).T):
        motions += [
            KnownMotion(_joint_name(model, direction, sizes), 0j, True, direction.astype(complex))
            for direction in others
        ]
        rigid += list(others)
    return KnownMotions(
        tuple(motions), moving, turning, -turning @ J if turning.size else turning,
        np.array(rigid).reshape(len(rigid), model.n_u).T,
    )  # fmt: skip


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


def _joint_name(model: Model, direction: Array, sizes: Array) -> str:
    """The coordinate that a direction moves most."""
    names = [name.removesuffix("_rate") for name, _ in model.system.velocity_names()]
    return names[int(np.argmax(np.abs(direction / sizes)))]
