"""Linear models made at random: truncations, zeros, poles, responses, files and margins by a second formulation."""

from __future__ import annotations

import h5py
import numpy as np
import pytest
from scipy.io import loadmat
from scipy.linalg import eig

from femflex.studies.linear import (
    StateSpace,
    balanced_truncation,
    margins,
    modal_truncation,
    save_model,
    transmission_zeros,
)
from femflex.studies.linear.sampled import SampledModel


def numbered_names(word: str, n: int, unit: str) -> tuple[tuple[str, str], ...]:
    return tuple((f"{word}{k}", f"{unit}{k}") for k in range(n))


def model(poles, n_in: int = 2, n_out: int = 3, seed: int = 0) -> StateSpace:
    """A model in scrambled states with these poles (one of each pair)."""
    rng = np.random.default_rng(seed)
    blocks = [
        np.array([[p.real, p.imag], [-p.imag, p.real]]) if p.imag else np.array([[p.real]]) for p in map(complex, poles)
    ]
    n = sum(map(len, blocks))
    A, offset = np.zeros((n, n)), 0
    for block in blocks:
        A[offset : offset + len(block), offset : offset + len(block)] = block
        offset += len(block)
    T = rng.normal(size=(n, n))
    return StateSpace(
        T @ A @ np.linalg.inv(T),
        T @ rng.normal(size=(n, n_in)),
        rng.normal(size=(n_out, n)) @ np.linalg.inv(T),
        rng.normal(size=(n_out, n_in)),
        numbered_names("x", n, "m"),
        numbered_names("u", n_in, "N"),
        numbered_names("y", n_out, "V"),
    )


def response(state_space: StateSpace, s: complex) -> np.ndarray:
    return (
        state_space.C @ np.linalg.solve(s * np.eye(len(state_space.A)) - state_space.A, state_space.B) + state_space.D
    )


SLOW, FAST = (-0.1 + 1j, -0.3, -0.2 + 2j), (-1 + 9j, -20.0, -2 + 30j)


def test_modal_truncation_has_poles_residues_and_static_response():
    full_model = model(SLOW + FAST)
    for static in (True, False):
        reduced = modal_truncation(full_model, 5.0, static)
        assert sorted(np.abs(reduced.eigenvalues())) == pytest.approx(
            sorted(np.abs(np.array([*SLOW, SLOW[0], SLOW[2]])))
        )
        assert reduced.states == tuple((f"mode state {k}", "1") for k in range(1, 6)) and np.isnan(reduced.bound)
        assert reduced.inputs == full_model.inputs and reduced.outputs == full_model.outputs and not reduced.hankel.size
        # what is left out has poles beyond 5 alone: the difference of both is that part, by partial fractions
        values, left_vectors, right_vectors = eig(full_model.A, left=True)
        is_removed = np.abs(values) > 5.0

        def removed_part(s: complex) -> np.ndarray:
            out = np.zeros((3, 2), complex)
            for k in np.flatnonzero(is_removed):  # noqa: B023
                value, left, right = values[k], left_vectors[:, k].conj(), right_vectors[:, k]  # noqa: B023
                out += np.outer(full_model.C @ right, left @ full_model.B) / (left @ right) / (s - value)
            return out

        s = 0.3 + 0.7j
        assert response(reduced, s) == pytest.approx(
            response(full_model, s) - removed_part(s) + static * removed_part(0.0), rel=1e-8
        )
    assert response(modal_truncation(full_model, 5.0), 0.0) == pytest.approx(response(full_model, 0.0), rel=1e-8)


@pytest.mark.parametrize("order", [2, 5])
def test_balanced_truncation_bound_and_gramians(order: int):
    full_model = model(SLOW + FAST, seed=2)
    reduced = balanced_truncation(full_model, order)
    assert (
        len(reduced.A) == order
        and reduced.hankel.shape == (10,)
        and reduced.bound == pytest.approx(2 * reduced.hankel[order:].sum())
    )
    from scipy.linalg import solve_continuous_lyapunov

    controllability = solve_continuous_lyapunov(full_model.A, -full_model.B @ full_model.B.T)
    observability = solve_continuous_lyapunov(full_model.A.T, -full_model.C.T @ full_model.C)
    assert reduced.hankel == pytest.approx(
        np.sort(np.sqrt(np.linalg.eigvals(controllability @ observability).real))[::-1], rel=1e-5
    )
    reduced_gramian = solve_continuous_lyapunov(reduced.A, -reduced.B @ reduced.B.T)
    assert reduced_gramian == pytest.approx(np.diag(reduced.hankel[:order]), rel=1e-5, abs=1e-6 * reduced.hankel[0])
    errors = [
        np.linalg.svd(response(full_model, 1j * w) - response(reduced, 1j * w), compute_uv=False)[0]
        for w in np.geomspace(0.01, 300, 200)
    ]
    assert reduced.hankel[order] * 0.2 < max(errors) <= reduced.bound
    assert reduced.states[0] == ("balanced state 1", "1")


@pytest.mark.parametrize("through", [True, False])
def test_transmission_zeros_of_rosenbrocks_pencil(through: bool):
    full_model = model(SLOW + FAST, 2, 2, seed=6)
    if not through:
        full_model = StateSpace(
            full_model.A,
            full_model.B,
            full_model.C,
            0 * full_model.D,
            full_model.states,
            full_model.inputs,
            full_model.outputs,
        )
    n = len(full_model.A)
    pencil_matrix = np.block([[full_model.A, full_model.B], [full_model.C, full_model.D]])
    pencil_mass = np.zeros((n + 2, n + 2))
    pencil_mass[:n, :n] = np.eye(n)
    values = eig(pencil_matrix, pencil_mass, right=False)
    expected = values[np.isfinite(values) & (np.abs(values) < 1e5)]
    zeros = transmission_zeros(full_model)
    assert len(zeros) == len(expected) and (np.diff(np.abs(zeros)) >= -1e-9).all()
    assert all(np.abs(zeros - zero).min() < 1e-5 * abs(zero) for zero in expected)


def test_response_of_selected_inputs_and_outputs():
    full_model = model(SLOW)
    full_response = full_model.frequency_response(np.array([0.5, 7.0]))
    assert full_response.shape == (2, 3, 2) and full_response[1] == pytest.approx(response(full_model, 7j))
    selected_model = full_model.selected(["u1"], ["y2", "y0"])
    assert selected_model.inputs == (full_model.inputs[1],) and selected_model.outputs == (
        full_model.outputs[2],
        full_model.outputs[0],
    )
    assert selected_model.frequency_response(0.5)[0] == pytest.approx(full_response[0][[2, 0]][:, [1]])
    assert (
        full_model.selected(outputs=["y1"]).inputs == full_model.inputs
        and full_model.selected(inputs=["u1"]).outputs == full_model.outputs
    )


@pytest.mark.parametrize("suffix", [".mat", ".npz", ".h5", ".MAT"])
def test_saved_model_round_trip(tmp_path, suffix: str):
    full_model = model(SLOW)
    path = save_model(full_model, tmp_path / f"m{suffix}")
    if suffix == ".npz":
        stored = dict(np.load(path))
    elif suffix == ".h5":
        with h5py.File(path) as file:
            stored = {
                key: np.array([t.decode() for t in data[:]]) if data.dtype == object else data[:]
                for key, data in file.items()
            }
    else:
        stored = {
            k: v if k in "ABCD" else np.array(["".join(t) for t in v.ravel()])
            for k, v in loadmat(path).items()
            if k[0] != "_"
        }
    for key in "ABCD":
        assert stored[key] == pytest.approx(getattr(full_model, key), rel=0, abs=0)
    for key, unit in (("states", "m"), ("inputs", "N"), ("outputs", "V")):
        pairs = getattr(full_model, key)
        assert list(stored[key]) == [name for name, _ in pairs]
        assert list(stored[f"{key[:-1]}_units"]) == [f"{unit}{k}" for k in range(len(pairs))]
    further = {f"{key}_{kind}" for key in ("input", "output") for kind in ("units", "frames")}
    assert set(stored) == {*"ABCD", "states", "inputs", "outputs", "state_units", *further}
    with pytest.raises(FileExistsError):
        save_model(full_model, path)
    assert save_model(full_model, str(path), force=True) == path


def sampled(gain: float, lag: float, period: float = 0.4) -> SampledModel:
    """Two commands held on a plant of three states; each is -gain times a mix of states as sampled, with a memory."""
    rng = np.random.default_rng(12)
    A = np.array([[0.0, 1.0, 0.0], [-2.0, -0.3, 0.4], [0.0, 0.5, -1.0]])
    B, K = rng.normal(size=(3, 2)), rng.normal(size=(2, 3))
    wide = np.zeros((6, 6))
    wide[:3, :3], wide[:3, 3:5] = A, B
    S = np.eye(6)
    S[3:5] = 0.0
    S[3:5, :3] = -gain * (1 - lag) * K
    S[3:5, 5] = [0.3 * lag, 0.0]
    S[5] = [0.2 * lag, 0, 0.1, 0, 0.1, 0.5]
    return SampledModel(wide, S, numbered_names("s", 6, ""), {"law/a": 3, "law/b": 4}, period)


@pytest.mark.parametrize("command", ["law/a", "law/b"])
def test_margins_are_at_the_limit_of_stability(command: str):
    """Multiply one command, or delay it, and look at the multipliers of the loop that is then closed."""
    loop_model = sampled(0.25, 0.3)
    k = loop_model.commands[command]

    def radius(factor: complex) -> float:
        S = loop_model.sample.astype(complex)
        S[k] = S[k] * factor
        return np.abs(np.linalg.eigvals(S @ loop_model.flow)).max()

    assert np.abs(loop_model.multipliers()[0]) == pytest.approx(radius(1.0)) and radius(1.0) < 1
    assert (np.diff(np.abs(loop_model.multipliers())) <= 1e-12).all()
    margins_of_loop = margins(loop_model, command)
    if np.isfinite(margins_of_loop.gain_up):
        assert radius(0.999 * margins_of_loop.gain_up) < 1 < radius(1.001 * margins_of_loop.gain_up)
    else:
        assert radius(50.0) < 1
    if margins_of_loop.gain_down > 0:
        assert radius(1.001 * margins_of_loop.gain_down) < 1 < radius(0.999 * margins_of_loop.gain_down)
    assert margins_of_loop.modulus == pytest.approx(
        min(
            abs(1 - loop_model.loop(command, np.array([w]))[0])
            for w in np.geomspace(np.pi / 0.4 * 1e-4, np.pi / 0.4, 4000)
        ),
        rel=1e-3,
    )
    for w in (0.3, 2.0):  # L by its definition: S and E with the command's row left out
        z = np.exp(1j * w * 0.4)
        open_sample = loop_model.sample.copy()
        open_sample[k] = 0.0
        x = np.linalg.solve(z * np.eye(6) - loop_model.flow @ open_sample, loop_model.flow[:, k])
        assert loop_model.loop(command, np.array([w]))[0] == pytest.approx(loop_model.sample[k] @ x)
    if np.isfinite(margins_of_loop.phase):
        shift = [np.exp(-1j * margins_of_loop.phase * f) for f in (0.999, 1.001)]
        S = loop_model.sample.astype(complex)
        circle = []
        for factor in shift:
            S = loop_model.sample.astype(complex)
            S[k] = S[k] * factor
            circle.append(np.abs(np.linalg.eigvals(S @ loop_model.flow)).max())
        assert circle[0] < 1 < circle[1]
        crossing = loop_model.loop(command, np.array([margins_of_loop.crossover]))[0]
        assert abs(crossing) == pytest.approx(1.0, rel=1e-9) and margins_of_loop.delay <= margins_of_loop.phase / 1e-3
