"""Transmission zeros, and linear models reduced by modal and balanced truncation; rigid-body modes are kept."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag, cholesky, schur, solve_continuous_lyapunov, solve_sylvester

from femflex.arrays import Array, ComplexArray
from femflex.studies.linear.space import StateSpace

SLOW = 1e-5  # of the largest pole: poles below are those of rigid-body motion
DAMPED = 1e-7  # least damping ratio of poles that are balanced
LEAST = 1e-13  # of the largest Hankel singular value: states below are uncontrollable or unobservable
FARTHEST = 1e3  # times the largest pole: zeros beyond it are zeros at infinity, split by rounding
SINGULAR = 1e-12  # of the largest singular value of G(s0) below which inputs or outputs depend on each other


@dataclass(frozen=True, eq=False)
class Truncated(StateSpace):
    """A truncated model; hankel (n,): singular values of all that could be kept, empty for a modal truncation.

    bound  largest singular value of the error over all frequencies, at most; NaN for a modal truncation
    """

    hankel: Array
    bound: float


def modal_truncation(model: StateSpace, highest: float, static: bool = True) -> Truncated:
    """The model with only its poles up to highest [rad/s]; states "mode state 1", ...

    static: the static response of the removed modes is kept in D, so that the model is exact at rest. Raises
    ValueError when none, or all, of the poles would be left.
    """
    size = np.abs(model.eigenvalues())
    if not (size <= highest).any() or (size <= highest).all():
        retained_text = "none" if (size > highest).all() else "all"
        raise ValueError(
            f"a modal truncation at {highest:.6g} rad/s keeps {retained_text} of the poles, which lie at "
            f"{size.min(initial=np.inf):.4g} to {size.max(initial=0.0):.4g} rad/s; take one between"
        )
    retained, (A, B, C) = decoupled_parts(model, highest)
    D = model.D - C @ np.linalg.solve(A, B) if static else model.D
    return _with_state_names(retained, D, model, "mode state", np.zeros(0), float("nan"))


def balanced_truncation(model: StateSpace, order: int) -> Truncated:
    """The model with so many states of the largest Hankel singular values; rigid-body modes are kept in addition.

    The error is at most twice the sum of the singular values left out (its `bound`). Units of inputs and outputs act
    as weights: scale them first where they differ. Raises ValueError for a model whose vibrations are not damped.
    """
    poles = model.eigenvalues()
    slow = SLOW * float(np.abs(poles).max(initial=0.0))
    fast = poles[np.abs(poles) > slow]
    if not len(fast):
        raise ValueError("the model has only rigid-body modes; there is nothing to truncate")
    worst = fast[np.argmax(fast.real / np.abs(fast))]
    if not -worst.real > DAMPED * abs(worst):
        behaviour = "grows" if worst.real > DAMPED * abs(worst) else "is not damped"
        raise ValueError(
            f"a balanced truncation needs damped motions; the one at {abs(worst.imag) / (2 * np.pi):.6g} Hz "
            f"{behaviour}. Give bodies and joints damping, or take a modal truncation"
        )
    (rigid_A, rigid_B, rigid_C), (A, B, C) = decoupled_parts(model, slow)
    gramians = solve_continuous_lyapunov(A, -B @ B.T), solve_continuous_lyapunov(A.T, -C.T @ C)
    R, L = (_root(np.asarray(gramian, float)) for gramian in gramians)
    U, sigma, Vt = np.linalg.svd(L.T @ R)  # the square-root method
    max_order = int((sigma > LEAST * sigma.max(initial=0.0)).sum())
    if not 1 <= order <= max_order:
        raise ValueError(
            f"a balanced truncation to {order} states was requested; {max_order} states are controllable and "
            f"observable, and {len(rigid_A)} more are rigid-body motion. Take a number from 1 to {max_order}"
        )
    scale = 1.0 / np.sqrt(sigma[:order])
    T, S = R @ Vt.T[:, :order] * scale, (L @ U[:, :order] * scale).T
    blocks = block_diag(rigid_A, S @ A @ T), np.vstack([rigid_B, S @ B]), np.hstack([rigid_C, C @ T])
    return _with_state_names(blocks, model.D, model, "balanced state", sigma, float(2 * sigma[order:].sum()))


Blocks = tuple[Array, Array, Array]  # A, B, C of a decoupled part of a model


def decoupled_parts(model: StateSpace, highest: float) -> tuple[Blocks, Blocks]:
    """The parts of a model with poles up to highest [rad/s] and beyond, by an ordered Schur form.

    With A = Q [[S11, S12], [0, S22]] Q^T and S11 X - X S22 = -S12 the parts are decoupled.
    """
    S, Q, n = schur(model.A, output="real", sort=lambda re, im: bool(np.hypot(re, im) <= highest))
    X = solve_sylvester(S[:n, :n], -S[n:, n:], -S[:n, n:]) if 0 < n < len(S) else np.zeros((n, len(S) - n))
    B, C = Q.T @ model.B, model.C @ Q
    return (S[:n, :n], B[:n] - X @ B[n:], C[:, :n]), (S[n:, n:], B[n:], C[:, n:] + C[:, :n] @ X)


def _root(W: Array) -> Array:
    """L with W = L L^T of a matrix that is positive but for rounding."""
    try:
        return np.asarray(cholesky(W, lower=True))
    except np.linalg.LinAlgError:
        values, vectors = np.linalg.eigh((W + W.T) / 2)
        return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0)))


def _with_state_names(blocks: Blocks, D: Array, model: StateSpace, word: str, sigma: Array, bound: float) -> Truncated:
    states = tuple((f"{word} {k + 1}", "1") for k in range(len(blocks[0])))
    return Truncated(*blocks, D, states, model.inputs, model.outputs, sigma, bound, frames=model.frames)


def transmission_zeros(model: StateSpace) -> ComplexArray:
    """Finite transmission zeros [1/s] of a model with as many inputs as outputs, by rising size.

    With s = s0 + 1 / w the model becomes one whose feedthrough is G(s0), so that its zeros are the eigenvalues
    w of -R + R B G(s0)^-1 C R, R = (s0 - A)^-1; those at infinity become w = 0. Uncontrollable and unobservable
    poles are among them. Raises ValueError where inputs and outputs differ in number, or depend on each other.
    """
    if len(model.inputs) != len(model.outputs) or not model.inputs:
        raise ValueError(
            f"transmission zeros need as many inputs as outputs; found {len(model.inputs)} and {len(model.outputs)}. "
            "Choose some of them (--inputs, --outputs)"
        )
    size = float(np.abs(model.eigenvalues()).max(initial=0.0)) or 1.0
    s0 = 1.2345 * size  # to the right of all poles
    R = np.linalg.inv(s0 * np.eye(len(model.A)) - model.A)
    G = model.D + model.C @ R @ model.B
    scale_in = np.linalg.norm(G, axis=0)
    sigma = np.linalg.svd(G / np.where(scale_in > 0, scale_in, 1.0), compute_uv=False)
    if not sigma[-1] > SINGULAR * sigma[0]:
        raise ValueError(
            "the transfer matrix is singular at all frequencies, so there are no transmission zeros; choose other "
            "inputs or outputs"
        )
    w = np.asarray(np.linalg.eigvals(-R + R @ model.B @ np.linalg.solve(G, model.C @ R)), complex)
    zeros = s0 + 1.0 / w[np.abs(w) > 1.0 / (FARTHEST * size)]
    zeros = zeros[np.abs(zeros) < FARTHEST * size]
    return zeros[np.argsort(np.abs(zeros), kind="stable")]
