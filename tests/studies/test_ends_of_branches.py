"""Where a branch of free vibrations ends and why, and the far side of a tongue, of equations made up for it."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from femflex.studies import arc, internal_resonance
from femflex.studies.arc import Place
from femflex.studies.branch import POINTS, Branch, _begun, _ended, _other, followed
from femflex.studies.harmonic_balance import Vibration
from femflex.studies.internal_resonance import _nearest, first_share

MASS = np.array([[2.0, 0.5], [0.5, 1.0]])
PROBLEM = SimpleNamespace(motion=SimpleNamespace(mass=np.pad(MASS, (0, 1), constant_values=7.0)))


def place(amplitude: float, first: float = 1.0, third: float = 0.0, omega: float = 4 * np.pi) -> Place:
    """A motion with these parts of the first and the third harmonic, and a mean that does not count."""
    harmonics = np.array([[9.0, 9.0], [first, 0.0], [0.0, 0.0], [0.0, third]])
    return Place(Vibration(amplitude, omega, harmonics), np.zeros(9), np.zeros(9))


def test_the_share_of_the_first_harmonic_is_weighed_by_mass_without_the_mean():
    assert first_share(PROBLEM, place(1.0, 2.0, 3.0)) == pytest.approx(2 * 4 / (2 * 4 + 9))
    assert first_share(PROBLEM, place(1.0)) == 1.0


@pytest.mark.parametrize(
    ("to", "peak", "count", "said"),
    [
        (None, 1.0, 9, "no periodic solution is found beyond it (possibly an internal resonance with another mode)"),
        (place(1.0, 1.0, 2.0), 1.0, 9, "the next solution, at 2 Hz, is another motion: its first harmonic has a share "
         "of 0.33 (limit 0.5)"),
        (place(1.0, 1.0, 1.4), 1.0, 9, ""),
        (place(0.49), 1.0, 9, "the branch turns back there, to 0.49 m at 2 Hz"),
        (place(0.51), 1.0, 9, ""),
        (place(0.51), 1.0, POINTS - 1, ""),
        (place(0.51), 1.0, POINTS, f"it was followed over {POINTS} steps"),
    ],
)  # fmt: skip
def test_a_place_that_does_not_belong_to_a_branch_is_said_to_be_so(to, peak, count, said):
    assert _other(PROBLEM, to, peak, count) == said


def test_the_last_place_of_a_branch_is_reported_or_that_it_is_rest():
    begin = "no free vibration with an amplitude of 3 m was found; the branch was followed up to "
    assert _ended(3.0, place(2.0).at, "why") == begin + "2 m at 2 Hz: why. Request smaller amplitudes"
    assert _ended(3.0, place(0.0).at, "why") == begin + "rest: why. Request smaller amplitudes"


def test_a_branch_begins_where_the_motion_is_still_that_of_the_mode():
    """The frequency rises by a tenth per metre, and the shape turns by a twentieth: at half a metre both are small."""
    mode, tried = np.array([[0.0, 0.0], [3.0, 4.0]]), []

    def balanced(start):
        tried.append(start.amplitude)
        a = start.amplitude
        return Vibration(a, start.omega * (1 + 0.1 * a), start.harmonics + a * 0.05 * a * mode)

    problem = SimpleNamespace(balanced=balanced, tangent=lambda at, row: np.append(row[:-1], 1.0), **vars(PROBLEM))
    rest = Vibration(0.0, 5.0, 0 * mode)
    found = _begun(problem, rest, mode, 8.0)
    assert tried == [8.0, 4.0, 2.0, 1.0, 0.5] and found.at.amplitude == 0.5
    assert found.row @ found.tangent == pytest.approx(1.0)
    np.testing.assert_allclose(found.tangent / found.tangent[-1], np.append(mode.ravel(), 1.0))
    problem.balanced = lambda start: None
    assert _begun(problem, rest, mode, 8.0) is None
    nothing = followed(problem, rest, mode, [8.0, 9.0])
    said = "no free vibration with an amplitude of 8 m was found; the branch was followed up to rest: no periodic "
    said += "solution is found beyond it. Request smaller amplitudes"
    assert nothing == Branch([], [], [], said)


@pytest.mark.parametrize(
    ("brink", "amplitude", "nearest"),
    [(1.0, 0.9, 1.0), (1.0, 1.3, 1.3), (1.0, 5.0, 1.0), (1.2, 1.1, 1.2)],
)
def test_the_far_side_of_a_tongue_is_approached_down_to_its_brink_or_to_a_requested_amplitude(
    monkeypatch, brink, amplitude, nearest
):
    """The tongue begins at 1 m; beyond it motions are found down to the brink, in steps of 0.3 m at most."""

    def nearer(problem, here, to):
        return place(to) if here.at.amplitude - to <= 0.3 and to >= brink else None

    monkeypatch.setattr(internal_resonance, "nearer", nearer)
    found = _nearest(PROBLEM, 1.0, place(2.0), amplitude).at.amplitude
    assert found >= nearest and found == pytest.approx(nearest, abs=2 * internal_resonance.LEAST)
    if nearest in (1.0, amplitude):
        assert found == nearest


@pytest.mark.parametrize(("most", "to"), [(9.0, 1.4), (1.3, 1.3), (1.45, 1.4)])
def test_a_step_ends_at_an_amplitude_that_comes_before_its_length(monkeypatch, most, to):
    """From 1 m on by 0.2 along a tangent of 2 m; a step past the amplitude is taken back to it."""
    here, asked = place(1.0), []
    problem = SimpleNamespace(rate=lambda at, tangent: 2.0)

    def found(problem, here, length, amplitude):
        asked.append((length, amplitude))
        return place(here.at.amplitude + 2.0 * length if amplitude is None else amplitude)

    monkeypatch.setattr(arc, "_found", found)
    assert arc.stepped(problem, here, 0.2, most).at.amplitude == pytest.approx(to)
    assert asked == [(0.2, None)] if to == 1.4 else asked == [(pytest.approx(0.15), 1.3)]
    assert arc.nearer(problem, here, 0.6).at.amplitude == 0.6 and asked[-1] == (pytest.approx(-0.2), 0.6)
    problem.rate = lambda at, tangent: -2.0
    assert arc.nearer(problem, here, 0.6) is None
    problem.rate = lambda at, tangent: 0.5  # the tangent promises 1.1 m, and 1.4 m are found
    assert arc.stepped(problem, here, 0.2, 1.2).at.amplitude == 1.2 and asked[-1] == (pytest.approx(-0.4), 1.2)
