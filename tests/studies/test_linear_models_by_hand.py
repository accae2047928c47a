"""Linear models made at random: truncations, zeros, poles, responses, files and margins against second formulations."""

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
    poles_of,
    save_model,
    transmission_zeros,
)
from femflex.studies.linear.grid import response_grid
from femflex.studies.linear.sampled import SampledModel
from femflex.studies.linear.truncated import separated


def named(word: str, n: int, unit: str) -> tuple[tuple[str, str], ...]:
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
        named("x", n, "m"),
        named("u", n_in, "N"),
        named("y", n_out, "V"),
    )


def response(one: StateSpace, s: complex) -> np.ndarray:
    return one.C @ np.linalg.solve(s * np.eye(len(one.A)) - one.A, one.B) + one.D


SLOW, FAST = (-0.1 + 1j, -0.3, -0.2 + 2j), (-1 + 9j, -20.0, -2 + 30j)


def test_a_modal_truncation_keeps_its_poles_residues_and_static_response():
    whole = model(SLOW + FAST)
    for static in (True, False):
        small = modal_truncation(whole, 5.0, static)
        assert sorted(np.abs(small.eigenvalues())) == pytest.approx(sorted(np.abs(np.array([*SLOW, SLOW[0], SLOW[2]]))))
        assert small.states == tuple((f"mode state {k}", "1") for k in range(1, 6)) and np.isnan(small.bound)
        assert small.inputs == whole.inputs and small.outputs == whole.outputs and not small.hankel.size
        # what is left out has poles beyond 5 alone: the difference of both is that part, by partial fractions
        values, left, right = eig(whole.A, left=True)
        far = np.abs(values) > 5.0

        def beyond(s: complex) -> np.ndarray:
            out = np.zeros((3, 2), complex)
            for k in np.flatnonzero(far):  # noqa: B023
                scale = left[:, k].conj() @ right[:, k]  # noqa: B023
                out += np.outer(whole.C @ right[:, k], left[:, k].conj() @ whole.B) / scale / (s - values[k])  # noqa: B023
            return out

        s = 0.3 + 0.7j
        assert response(small, s) == pytest.approx(response(whole, s) - beyond(s) + static * beyond(0.0), rel=1e-8)
    assert response(modal_truncation(whole, 5.0), 0.0) == pytest.approx(response(whole, 0.0), rel=1e-8)


def test_a_model_falls_apart_into_slow_and_fast():
    whole = model(SLOW + FAST, seed=3)
    slow, fast = separated(whole, 5.0)
    assert len(slow.A) == 5 and len(fast.A) == 5
    s = 0.2 + 3j
    both = sum(part.C @ np.linalg.solve(s * np.eye(5) - part.A, part.B) for part in (slow, fast))
    assert both + whole.D == pytest.approx(response(whole, s), rel=1e-9)


@pytest.mark.parametrize("highest", [0.01, 100.0])
def test_a_modal_truncation_that_keeps_none_or_all_is_refused_with_the_range(highest: float):
    word = "none" if highest < 1 else "all"
    with pytest.raises(
        ValueError, match=rf"at {highest:g} rad/s keeps {word} of the poles, which lie at 0\.3 to 30\.07 rad/s"
    ):
        modal_truncation(model(SLOW + FAST), highest)


@pytest.mark.parametrize("order", [2, 5])
def test_a_balanced_truncation_is_within_its_bound_and_has_gramians_of_its_singular_values(order: int):
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


def test_rigid_motion_is_kept_beside_the_balanced_states():
    whole = model((0.0, *SLOW), seed=4)
    small = balanced_truncation(whole, 3)
    assert len(small.A) == 4 and np.abs(small.eigenvalues()[0]) < 1e-9
    s = 1e-4j
    assert response(small, s) == pytest.approx(response(whole, s), rel=1e-2)  # its drift


@pytest.mark.parametrize(
    ("poles", "order", "words"),
    [
        ((0.0,), 1, "the model has only rigid-body modes"),
        ((*SLOW, 6j), 2, "the one at 0.95493 Hz is not damped"),
        ((*SLOW, 0.1 + 6j, -0.01 + 300j), 2, "the one at 0.95493 Hz grows"),
        (SLOW, 0, "to 0 states was requested; 5 states are controllable and observable, and 0 more are"),
        (
            (0.0, *SLOW),
            6,
            "to 6 states was requested; 5 states are controllable and observable, and 1 more are rigid-body "
            "motion. Take a number from 1 to 5",
        ),
    ],
)
def test_a_balanced_truncation_that_cannot_be_is_refused(poles, order, words):
    with pytest.raises(ValueError, match=words):
        balanced_truncation(model(poles), order)


@pytest.mark.parametrize("through", [True, False])
def test_transmission_zeros_are_those_of_rosenbrocks_pencil(through: bool):
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


def test_models_without_zeros_to_speak_of_are_refused():
    whole = model(SLOW, 2, 2)
    with pytest.raises(ValueError, match="as many inputs as outputs; found 2 and 3"):
        transmission_zeros(model(SLOW))
    double = StateSpace(
        whole.A, whole.B[:, [0, 0]], whole.C, whole.D[:, [0, 0]], whole.states, whole.inputs, whole.outputs
    )
    with pytest.raises(ValueError, match="the transfer matrix is singular at all frequencies"):
        transmission_zeros(double)


def test_poles_of_a_plain_model_take_part_in_states_as_their_eigenvectors_say():
    whole = model(SLOW + FAST, seed=8)
    found = poles_of(whole)
    wanted = sorted([*SLOW, *FAST], key=abs)
    assert [one.value for one in found] == pytest.approx(wanted) and not any(one.rigid for one in found)
    values, right = np.linalg.eig(whole.A)
    left = np.linalg.inv(right)
    for one in found:
        k = int(np.argmin(np.abs(values - one.value)))
        share = np.abs(left[k] * right[:, k])
        share /= share.sum()
        assert one.participation == pytest.approx({f"x{j}": share[j] for j in np.flatnonzero(share >= 0.02)}, rel=1e-6)
        assert one.name == f"x{np.argmax(share)}" == next(iter(one.participation))
        assert one.frequency == pytest.approx(np.imag(one.value) / (2 * np.pi)) and one.damping_ratio == pytest.approx(
            -one.value.real / abs(one.value)
        )
        told = one.to_dict()
        assert (told["real"], told["imag"], told["name"], told["rigid"]) == (
            one.value.real,
            one.value.imag,
            one.name,
            False,
        )
        assert (told["frequency_hz"], told["damping_ratio"], told["participation"]) == (
            one.frequency,
            one.damping_ratio,
            one.participation,
        )


def test_a_response_is_that_of_the_transfer_matrix_and_parts_of_a_model_stay_in_the_order_wanted():
    whole = model(SLOW)
    found = whole.frequency_response(np.array([0.5, 7.0]))
    assert found.shape == (2, 3, 2) and found[1] == pytest.approx(response(whole, 7j))
    part = whole.selected(["u1"], ["y2", "y0"])
    assert part.inputs == (whole.inputs[1],) and part.outputs == (whole.outputs[2], whole.outputs[0])
    assert part.frequency_response(0.5)[0] == pytest.approx(found[0][[2, 0]][:, [1]])
    assert (
        whole.selected(outputs=["y1"]).inputs == whole.inputs and whole.selected(inputs=["u1"]).outputs == whole.outputs
    )
    with pytest.raises(KeyError, match="the linear model has no output 'y9'"):
        whole.selected(outputs=["y9"])
    with pytest.raises(ValueError, match=r"the model has an undamped pole at 3 rad/s"):
        StateSpace(
            np.array([[0.0, 3.0], [-3.0, 0.0]]),
            np.ones((2, 1)),
            np.ones((1, 2)),
            np.zeros((1, 1)),
            named("x", 2, ""),
            named("u", 1, ""),
            named("y", 1, ""),
        ).frequency_response(3.0)
    with pytest.raises(ValueError, match=r"B of a linear model has the shape \(5, 3\); expected \(5, 2\)"):
        StateSpace(whole.A, np.zeros((5, 3)), whole.C, whole.D, whole.states, whole.inputs, whole.outputs)


@pytest.mark.parametrize("suffix", [".mat", ".npz", ".h5", ".MAT"])
def test_a_file_of_any_kind_holds_every_matrix_name_and_unit(tmp_path, suffix: str):
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
    with pytest.raises(ValueError, match=r"a linear model is written as \.mat, \.npz, \.h5; m\.csv is neither"):
        save_model(whole, tmp_path / "m.csv")


def test_frequencies_lie_close_about_poles_and_on_none_that_is_undamped():
    grid = response_grid(model((0.0, -0.02 + 2j, -0.1 + 50j)))
    assert (
        grid[0] == pytest.approx(0.2, rel=1e-3)
        and grid[-1] == pytest.approx(150, rel=1e-2)
        and (np.diff(grid) > 0).all()
    )
    for place, width in ((2.0, 0.02), (50.0, 0.1)):
        near = grid[np.abs(grid - place) < 0.11 * width]
        assert len(near) >= 3 and place == pytest.approx(near[len(near) // 2], abs=1e-6)
    assert response_grid(model((-0.1 + 1j, -0.3 + 2e5j))).max() == pytest.approx(0.1 * abs(-0.1 + 1j) * 1e4, rel=1e-2)
    part = response_grid(model(SLOW), 1.5, 3.0)
    assert part[0] == pytest.approx(1.5) and part[-1] == pytest.approx(3.0)
    undamped = response_grid(model((2j, -0.1 + 3j)))
    assert np.abs(undamped - 2.0).min() > 1e-7 and np.abs(undamped - 2.0).min() < 1e-4
    with pytest.raises(ValueError, match=r"is to go from 3 to 2 rad/s; give two rising frequencies above 0"):
        response_grid(model(SLOW), 3.0, 2.0)
    still = response_grid(
        StateSpace(
            np.zeros((1, 1)),
            np.ones((1, 1)),
            np.ones((1, 1)),
            np.zeros((1, 1)),
            named("x", 1, ""),
            named("u", 1, ""),
            named("y", 1, ""),
        )
    )
    assert (still[0], still[-1]) == pytest.approx((0.1, 10.0))


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
    return SampledModel(expm(wide * period), S, named("s", 6, ""), {"law/a": 3, "law/b": 4}, period)


@pytest.mark.parametrize("command", ["law/a", "law/b"])
def test_margins_are_where_the_closed_loop_becomes_unstable(command: str):
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
    with pytest.raises(KeyError, match="there is no sampled command 'law/c'"):
        one.loop("law/c", np.ones(1))
