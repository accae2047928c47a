"""Walks along states of large deflection, one step at a time, of structures made up for it."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from scipy import sparse

from femflex.reduction import wide_sheets
from femflex.reduction.large_deflection import sheet_bends
from femflex.reduction.large_deflection.load_path import DRAG, KEPT, LONGEST, RATE, STIFFEST, LoadedStructure, LoadPath

ONE = sparse.eye_array(1).tocsr()
STEP = 0.1


def falling(to=1.0, pushed=False, saddle=False, found=True):
    """A structure that rests at `to` alone, of unit stiffness, and the drags that it was asked for."""
    drags = []

    class Falling(LoadedStructure):
        def equilibrium(self, x0, guess, work, drag):
            drags.append(drag)
            return ((to + drag * x0) / (1.0 + drag), saddle) if found else None

    return Falling(None, np.array([0]), ONE, np.ones(1), np.full(1, float(pushed))), drags


def test_a_state_near_by_is_come_to_without_drag():
    held, drags = falling(0.19)
    (state,), saddle = held.descent(np.zeros(1), np.zeros(1), 1.0, STEP)
    assert state == pytest.approx(0.19) and not saddle and drags == [0.0]


def test_a_state_far_off_is_come_to_against_a_drag_in_steps_that_are_noted_unless_they_are_short():
    held, drags = falling(1.0)
    states, saddle = held.descent(np.zeros(1), np.zeros(1), 1.0, STEP)
    way = np.diff([0.0, *np.ravel(states)])
    assert states[-1] == 1.0 and not saddle and drags[-1] == 0.0
    assert (way[:-1] > KEPT * STEP).all() and (way <= LONGEST * STEP).all()
    rising = DRAG * RATE ** np.arange(5)
    assert drags[:7] == pytest.approx([0.0, *rising, rising[3]])  # 0.163 with the fifth, then a quarter of it
    assert np.ravel(states)[0] == pytest.approx(1 / (1 + rising[4]))


def test_what_is_not_found_with_any_drag_is_given_up():
    held, drags = falling(found=False)
    assert held.descent(np.zeros(1), np.zeros(1), 1.0, STEP) is None
    wanted = [0.0, *(DRAG * RATE ** np.arange(20))]
    assert drags == pytest.approx([drag for drag in wanted if drag <= STIFFEST])


@pytest.mark.parametrize(("pushed", "rests"), [(False, True), (True, False)])
def test_a_saddle_is_a_state_unless_something_pushes(pushed, rests):
    held, _ = falling(0.1, pushed, saddle=True)
    found = held.descent(np.zeros(1), np.zeros(1), 1.0, STEP)
    assert (found is not None) == rests and (not rests or found[1])


def test_a_part_of_the_work_is_halved_until_a_state_is_found_with_it():
    """States are found at most 0.3 of the work ahead, those beyond 0.4 by a snap through two more."""
    asked = []

    def descent(x, guess, work, step):
        asked.append((round(work, 12), float(guess[0])))
        if abs(work - x[0] / 2.0) > 0.3:
            return None
        last = np.array([2.0 * work])
        return ([last], False) if work < 0.4 else ([last / 2, last / 3, last], True)

    held = SimpleNamespace(descent=descent, whole=lambda x: x)
    path = LoadPath(held, np.array([3.0]), 1.0)
    assert path.advance(1.0, STEP) and (path.work, path.part) == (0.25, 0.25)
    assert asked == [(1.0, 3.0), (0.5, 1.5), (0.25, 0.75)]
    assert path.way == pytest.approx(2.0) and not path.snapped and not path.saddle
    assert path.advance(1.0, STEP) and path.work == 0.5 and path.snapped and path.saddle
    assert asked[-1] == (0.5, 1.0) and path.way == 0.0  # after a snap nothing is foretold
    assert path.advance(-1.0, STEP) and path.work == 0.25 and path.way == pytest.approx(2.0)
    assert path.snapped and path.saddle and np.ravel(path.states) == pytest.approx([0.5, 0.5, 1 / 3, 1.0, 0.5])
    held.descent = lambda *about: asked.append(about)
    before = len(asked)
    assert not path.advance(1.0, STEP) and len(asked) == before + 4  # a quarter, down to a thirty-second of the whole
    assert not path.advance(1.0, STEP) and len(asked) == before + 4 and path.work == 0.25


@pytest.fixture
def sheet(monkeypatch):
    """The odd part of a sheet whose states are phi q -+ even q^2, and the states asked for; its stiffness is 5."""
    phi, even = np.array([[0.0, 3.0, 4.0, 1.0, 0.0, 0.0]]).T, np.array([1.0, 0.0, 2.0, 0.0, 0.0, 3.0])
    structure = SimpleNamespace(translation=np.eye(6), M=np.eye(6) / 26.0)
    one = SimpleNamespace(phi=phi)

    def bent(found_up_to=np.inf, stretched_from=np.inf, start=0.1, deflection=5.0):
        asked = []

        def both(structure, one, q, odd, guess, settled=None):
            asked.append((q, odd, guess, settled))
            if q > found_up_to:
                raise ValueError("not found")
            return phi[:, 0] * q + even * q**2, -phi[:, 0] * q + even * q**2

        def energy(structure, x):
            q = x[1] / 3.0
            return 5.0 * q**2 / 2 * (1.01 if q >= stretched_from else 0.99) * sheet_bends.STRETCHED

        monkeypatch.setattr(sheet_bends, "_both_ways", both)
        monkeypatch.setattr(sheet_bends, "state_energy", energy)
        monkeypatch.setattr(sheet_bends, "over_mass", lambda structure, one: np.array([5.0]))
        monkeypatch.setattr(sheet_bends, "scaled_derivatives", lambda structure, one: 2 * even[:, None] / 5.0)
        return sheet_bends.changed_by_bending(structure, one, start, deflection), asked

    bent.phi, bent.even = phi[:, 0], even
    return bent


def test_states_of_a_sheet_foretell_each_other_up_to_the_deflection(sheet):
    """Nodes move by 5 and 1 per amplitude: 0.1 m to 5 m are 0.02 to 1, in three factors below four."""
    found, asked = sheet()
    amplitudes = np.geomspace(0.02, 1.0, 4)
    assert [q for q, *_ in asked] == pytest.approx([*amplitudes, 1.0])
    for q, odd, even, _ in asked:
        assert odd == pytest.approx(sheet.phi * q) and even == pytest.approx(sheet.even * q**2)
    assert [settled for *_, settled in asked] == [None] * 4 + [sheet_bends.AT_THE_END]
    assert found == pytest.approx(sheet.phi)
    assert [q for q, *_ in sheet(start=9.0)[1]] == pytest.approx([1.0, 1.0, 1.0])


@pytest.mark.parametrize("limit", ["found_up_to", "stretched_from"])
def test_the_last_state_of_a_sheet_that_is_found_and_does_not_stretch_is_taken(sheet, limit):
    amplitudes = np.geomspace(0.02, 1.0, 4)
    found, asked = sheet(**{limit: 0.5 * (amplitudes[1] + amplitudes[2])})
    assert found == pytest.approx(sheet.phi * amplitudes[1])
    assert [q for q, *_ in asked] == pytest.approx([*amplitudes[:3], amplitudes[1]])


def test_a_sheet_whose_first_state_is_not_found_or_stretches_has_none(sheet):
    with pytest.raises(ValueError, match="not found"):
        sheet(found_up_to=0.01)
    assert sheet(stretched_from=0.01)[0] is None


@pytest.mark.parametrize(
    ("bent", "third", "kept"), [(True, True, "bent"), (False, True, "third"), (False, False, "set")]
)
@pytest.mark.parametrize("error", [ValueError("not found"), RuntimeError("singular")])
def test_a_wide_sheet_gets_its_bend_or_the_third_derivative_at_rest_or_keeps_its_set(
    monkeypatch, bent, third, kept, error
):
    modes, asked = SimpleNamespace(held=np.arange(6), n_modes=2), []

    def sheet_bends(structure, given, start, deflection):
        assert given is modes
        asked.append((start, deflection))
        if not bent:
            raise error
        return "bent"

    def third_derivatives(structure, given, count):
        assert given is modes and count == 1
        if not third:
            raise ValueError("not found")
        return "third"

    monkeypatch.setattr(wide_sheets, "sheet_of", lambda structure: wide_sheets.Sheet(0.6, 1e-3, 0.03, 1.2))
    monkeypatch.setattr(wide_sheets, "with_sheet_bends", sheet_bends)
    monkeypatch.setattr(wide_sheets, "with_third_derivatives", third_derivatives)
    found = wide_sheets.with_own_bends(None, modes, None, None)
    assert (found is modes if kept == "set" else found == kept) and asked == [(0.03, wide_sheets.FAR * 1.2)]
    for less in (SimpleNamespace(held=np.zeros(0), n_modes=2), SimpleNamespace(held=np.arange(6), n_modes=0)):
        assert wide_sheets.with_own_bends(None, less, None, None) is less
    assert wide_sheets.with_own_bends(None, modes, None, 0.1) is modes and len(asked) == 1


def test_a_state_is_kept_where_the_tangent_has_as_many_negative_pivots_as_the_load_explains():
    """Two dofs of stiffness k with x + y = 1 held: along x - y the state is a saddle where k falls below zero."""
    for k, saddle in ((np.diag([2.0, 1.0]), False), (np.diag([2.0, -1.0]), False), (np.diag([-2.0, -1.0]), True),
                      (np.array([[1.0, 3.0], [3.0, 1.0]]), True)):  # fmt: skip
        elastic = SimpleNamespace(tangent=lambda at, k=k: sparse.csr_array(k), force=lambda at, k=k: k @ at)
        structure = SimpleNamespace(internal_force=elastic, f0=np.zeros(2), n_dof=2)
        held = LoadedStructure(structure, np.arange(2), sparse.eye_array(2).tocsr(), np.ones(2), np.zeros(2))
        x, found = held.equilibrium(np.zeros(2), np.zeros(2), 1.0, 0.0)
        curvature = np.array([1.0, -1.0]) @ k @ np.array([1.0, -1.0])
        assert found == saddle == (curvature < 0) and x.sum() == pytest.approx(1.0)
        assert (k @ x)[0] == pytest.approx((k @ x)[1])  # what is left is a multiple of the load
