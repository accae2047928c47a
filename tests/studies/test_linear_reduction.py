"""Linear models made at random: truncations, zeros, poles, responses, files and margins by a second formulation."""

from __future__ import annotations

import h5py
import numpy as np
import pytest
from scipy.io import loadmat
from scipy.linalg import eig, expm

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
    A, at = np.zeros((n, n)), 0
    for block in blocks:
        A[at : at + len(block), at : at + len(block)] = block
        at += len(block)
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


def response(one: StateSpace, s: complex) -> np.ndarray:
    return one.C @ np.linalg.solve(s * np.eye(len(one.A)) - one.A, one.B) + one.D


SLOW, FAST = (-0.1 + 1j, -0.3, -0.2 + 2j), (-1 + 9j, -20.0, -2 + 30j)


def test_modal_truncation_has_poles_residues_and_static_response():
    whole = model(SLOW + FAST)
    for static in (True, False):
        small = modal_truncation(whole, 5.0, static)
        assert sorted(np.abs(small.eigenvalues())) == pytest.approx(sorted(np.abs(np.array([*SLOW, SLOW[0], SLOW[2]]))))
        assert small.states == tuple((f"mode state {k}", "1") for k in range(1, 6)) and np.isnan(small.bound)
        assert small.inputs == whole.inputs and small.outputs == whole.outputs and not small.hankel.size
        # what is left out has poles beyond 5 alone: the difference of both is that part, by partial fractions
        values, left, right = eig(whole.A, left=True)
        far = np.abs(values) > 5.0

        def removed_part(s: complex) -> np.ndarray:
            out = np.zeros((3, 2), complex)
            for k in np.flatnonzero(far):  # noqa: B023
                scale = left[:, k].conj() @ right[:, k]  # noqa: B023
                out += np.outer(whole.C @ right[:, k], left[:, k].conj() @ whole.B) / scale / (s - values[k])  # noqa: B023
            return out

        s = 0.3 + 0.7j
        assert response(small, s) == pytest.approx(
            response(whole, s) - removed_part(s) + static * removed_part(0.0), rel=1e-8
        )
    assert response(modal_truncation(whole, 5.0), 0.0) == pytest.approx(response(whole, 0.0), rel=1e-8)


@pytest.mark.parametrize("order", [2, 5])
def test_balanced_truncation_bound_and_gramians(order: int):
    whole = model(SLOW + FAST, seed=2)
    small = balanced_truncation(whole, order)
    assert (
        len(small.A) == order
        and small.hankel.shape == (10,)
        and small.bound == pytest.approx(2 * small.hankel[order:].sum())
    )
    from scipy.linalg import solve_continuous_lyapunov

    reach = solve_continuous_lyapunov(whole.A, -whole.B @ whole.B.T)
    seen = solve_continuous_lyapunov(whole.A.T, -whole.C.T @ whole.C)
    assert small.hankel == pytest.approx(np.sort(np.sqrt(np.linalg.eigvals(reach @ seen).real))[::-1], rel=1e-5)
    own = solve_continuous_lyapunov(small.A, -small.B @ small.B.T)
    assert own == pytest.approx(np.diag(small.hankel[:order]), rel=1e-5, abs=1e-6 * small.hankel[0])
    errors = [
        np.linalg.svd(response(whole, 1j * w) - response(small, 1j * w), compute_uv=False)[0]
        for w in np.geomspace(0.01, 300, 200)
    ]
    assert small.hankel[order] * 0.2 < max(errors) <= small.bound
    assert small.states[0] == ("balanced state 1", "1")


@pytest.mark.parametrize("through", [True, False])
def test_transmission_zeros_of_rosenbrocks_pencil(through: bool):
    whole = model(SLOW + FAST, 2, 2, seed=6)
    if not through:
        whole = StateSpace(whole.A, whole.B, whole.C, 0 * whole.D, whole.states, whole.inputs, whole.outputs)
    n = len(whole.A)
    left = np.block([[whole.A, whole.B], [whole.C, whole.D]])
    right = np.zeros((n + 2, n + 2))
    right[:n, :n] = np.eye(n)
    values = eig(left, right, right=False)
    wanted = values[np.isfinite(values) & (np.abs(values) < 1e5)]
    found = transmission_zeros(whole)
    assert len(found) == len(wanted) and (np.diff(np.abs(found)) >= -1e-9).all()
    assert all(np.abs(found - one).min() < 1e-5 * abs(one) for one in wanted)


def test_response_of_selected_inputs_and_outputs():
    whole = model(SLOW)
    found = whole.frequency_response(np.array([0.5, 7.0]))
    assert found.shape == (2, 3, 2) and found[1] == pytest.approx(response(whole, 7j))
    part = whole.selected(["u1"], ["y2", "y0"])
    assert part.inputs == (whole.inputs[1],) and part.outputs == (whole.outputs[2], whole.outputs[0])
    assert part.frequency_response(0.5)[0] == pytest.approx(found[0][[2, 0]][:, [1]])
    assert (
        whole.selected(outputs=["y1"]).inputs == whole.inputs and whole.selected(inputs=["u1"]).outputs == whole.outputs
    )


@pytest.mark.parametrize("suffix", [".mat", ".npz", ".h5", ".MAT"])
def test_saved_model_round_trip(tmp_path, suffix: str):
    whole = model(SLOW)
    path = save_model(whole, tmp_path / f"m{suffix}")
    if suffix == ".npz":
        read = dict(np.load(path))
    elif suffix == ".h5":
        with h5py.File(path) as file:
            read = {
                key: np.array([t.decode() for t in data[:]]) if data.dtype == object else data[:]
                for key, data in file.items()
            }
    else:
        read = {
            k: v if k in "ABCD" else np.array([str(t[0]) for t in v.ravel()])
            for k, v in loadmat(path).items()
            if k[0] != "_"
        }
    for key in "ABCD":
        assert read[key] == pytest.approx(getattr(whole, key), rel=0, abs=0)
    for key, unit in (("states", "m"), ("inputs", "N"), ("outputs", "V")):
        pairs = getattr(whole, key)
        assert list(read[key]) == [name for name, _ in pairs]
        assert list(read[f"{key[:-1]}_units"]) == [f"{unit}{k}" for k in range(len(pairs))]
    assert set(read) == {*"ABCD", "states", "inputs", "outputs", "state_units", "input_units", "output_units"}
    with pytest.raises(FileExistsError):
        save_model(whole, path)
    assert save_model(whole, str(path), force=True) == path


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
    return SampledModel(expm(wide * period), S, numbered_names("s", 6, ""), {"law/a": 3, "law/b": 4}, period)


@pytest.mark.parametrize("command", ["law/a", "law/b"])
def test_margins_are_at_the_limit_of_stability(command: str):
    """Multiply one command, or delay it, and look at the multipliers of the loop that is then closed."""
    one = sampled(0.25, 0.3)
    k = one.commands[command]

    def radius(factor: complex) -> float:
        S = one.sample.astype(complex)
        S[k] = S[k] * factor
        return np.abs(np.linalg.eigvals(S @ one.flow)).max()

    assert np.abs(one.multipliers()[0]) == pytest.approx(radius(1.0)) and radius(1.0) < 1
    assert (np.diff(np.abs(one.multipliers())) <= 1e-12).all()
    found = margins(one, command)
    if np.isfinite(found.gain_up):
        assert radius(0.999 * found.gain_up) < 1 < radius(1.001 * found.gain_up)
    else:
        assert radius(50.0) < 1
    if found.gain_down > 0:
        assert radius(1.001 * found.gain_down) < 1 < radius(0.999 * found.gain_down)
    assert found.modulus == pytest.approx(
        min(abs(1 - one.loop(command, np.array([w]))[0]) for w in np.geomspace(np.pi / 0.4 * 1e-4, np.pi / 0.4, 4000)),
        rel=1e-3,
    )
    for w in (0.3, 2.0):  # L by its definition: S and E with the command's row left out
        z = np.exp(1j * w * 0.4)
        keep = one.sample.copy()
        keep[k] = 0.0
        x = np.linalg.solve(z * np.eye(6) - one.flow @ keep, one.flow[:, k])
        assert one.loop(command, np.array([w]))[0] == pytest.approx(one.sample[k] @ x)
    if np.isfinite(found.phase):
        shift = [np.exp(-1j * found.phase * f) for f in (0.999, 1.001)]
        S = one.sample.astype(complex)
        circle = []
        for factor in shift:
            S = one.sample.astype(complex)
            S[k] = S[k] * factor
            circle.append(np.abs(np.linalg.eigvals(S @ one.flow)).max())
        assert circle[0] < 1 < circle[1]
        crossing = one.loop(command, np.array([found.crossover]))[0]
        assert abs(crossing) == pytest.approx(1.0, rel=1e-9) and found.delay <= found.phase / 1e-3
