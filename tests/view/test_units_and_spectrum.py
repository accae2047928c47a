"""Readable numbers, and amplitude spectra against sines whose amplitude and frequency are known."""

from __future__ import annotations

import numpy as np
import pytest

from femflex.view.spectrum import amplitude_spectrum
from femflex.view.units import ROUND, clock, colour_bar, length_unit, round_above, strain_bar


@pytest.mark.parametrize("largest", 10.0 ** np.linspace(-8, 3, 45))
def test_a_colour_bar_reaches_the_largest_value_in_few_even_round_labels(largest):
    bar = colour_bar(largest)
    assert largest * bar.factor * (1 - 1e-9) <= bar.top <= 1.7 * largest * bar.factor
    numbers = np.array([float(label) for label in bar.labels])
    assert np.allclose(np.diff(numbers), bar.top / bar.parts, rtol=1e-9) and numbers[0] == 0
    assert max(len(label) for label in bar.labels) <= 4
    assert 0.9 < largest * bar.factor < 2001


def test_lengths_are_told_in_the_unit_one_would_use():
    told = {0.5: "cm", 0.019: "mm", 0.021: "cm", 1.9: "cm", 2.0: "m", 3e-5: "µm", 2e-8: "nm"}
    assert {length: length_unit(length)[1] for length in told} == told


def test_the_clock_rolls_over_without_sixty_seconds():
    assert clock(119.96, 3000.0) == "2 min 00.0 s"
    assert clock(3599.7, 9000.0) == "1 h 00 min 00 s"
    assert clock(0.0123456, 0.05) == "0.01235 s"


@pytest.mark.parametrize("frequency", [0.83, 2.417, 7.9])
def test_a_sine_makes_a_peak_of_its_height_at_its_place(frequency):
    time = np.linspace(0, 40, 2001)
    values = 3.0 + 0.2 * time + 1.7 * np.sin(2 * np.pi * frequency * time + 0.4)
    peaks = amplitude_spectrum(time, values).peaks()
    assert len(peaks) == 1
    assert peaks[0][0] == pytest.approx(frequency, rel=2e-4)
    assert peaks[0][1] == pytest.approx(1.7, rel=2e-3)


def test_a_small_line_beside_a_large_one_is_found():
    """80 dB down: a window with higher side lobes would hide it."""
    time = np.linspace(0, 100, 4001)
    values = np.sin(2 * np.pi * 1.003 * time) + 2e-4 * np.sin(2 * np.pi * 1.517 * time)
    peaks = amplitude_spectrum(time, values).peaks()
    assert [f for f, _ in peaks] == pytest.approx([1.003, 1.517], rel=1e-3)
    assert [a for _, a in peaks] == pytest.approx([1.0, 2e-4], rel=0.02)


@pytest.mark.parametrize("slope", [0.0, 0.2, -17.0])
def test_a_straight_line_leaves_nothing_of_its_rounding(slope):
    time = np.linspace(0, 40, 2001)
    assert amplitude_spectrum(time, 3.1 + slope * time).peaks() == []
    small = amplitude_spectrum(time, 3.1 + slope * time + 1e-9 * np.sin(2 * np.pi * 2.0 * time)).peaks()
    assert len(small) == 1 and small[0] == pytest.approx((2.0, 1e-9), rel=1e-2)


@pytest.mark.parametrize("phase", np.linspace(0.0, 2.8, 8))
def test_a_peak_of_fewer_cycles_than_can_be_placed_is_not_named(phase):
    """Slow sines leave a hump at about two cycles, wherever they are; from 2.5 on it is where it says, to a tenth."""
    time = np.linspace(0, 20, 801)
    for cycles in np.arange(0.6, 3.4, 0.1):
        spectrum = amplitude_spectrum(time, np.sin(2 * np.pi * cycles / 20 * time + phase))
        places = [place * 20 for place, height in spectrum.peaks() if height > 1e-3]  # no side lobes
        assert all(place >= 2.5 * 800 / 801 and abs(place / cycles - 1) < 0.13 for place in places)
        assert len(places) == 1 or cycles < 2.6


def test_a_slow_hump_takes_no_place_among_the_highest_peaks():
    time = np.linspace(0, 20, 801)
    slow = 5.0 * np.sin(2 * np.pi * 0.05 * time)
    values = slow + 0.3 * np.sin(2 * np.pi * 1.1 * time) + 0.2 * np.sin(2 * np.pi * 2.3 * time)
    spectrum = amplitude_spectrum(time, values)
    assert [place for place, _ in spectrum.peaks(2)] == pytest.approx([1.1, 2.3], rel=1e-3)
    assert spectrum.peaks(1) == spectrum.peaks(2)[:1]


def test_uneven_times_are_evened():
    rng = np.random.default_rng(3)
    time = np.sort(np.concatenate([[0.0, 40.0], rng.uniform(0, 40, 7998)]))
    peaks = amplitude_spectrum(time, np.sin(2 * np.pi * 1.25 * time)).peaks(1)
    assert peaks[0][0] == pytest.approx(1.25, rel=1e-3) and peaks[0][1] == pytest.approx(1.0, rel=0.02)


def test_nothing_makes_no_peak_and_a_short_record_is_refused():
    assert amplitude_spectrum(np.linspace(0, 1, 64), np.zeros(64)).peaks() == []
    assert amplitude_spectrum(np.linspace(0, 1, 64), np.linspace(2, 5, 64)).amplitude.max() < 1e-12  # a trend
    with pytest.raises(ValueError, match="a spectrum needs at least 16 instants; the record has 5"):
        amplitude_spectrum(np.arange(5.0), np.arange(5.0))


@pytest.mark.parametrize(("largest", "parts"), [(2.9e-4, 2), (3.9e-4, 4), (4.9e-4, 5), (5.9e-4, 2)])
def test_a_bar_of_both_signs_has_few_parts(largest, parts):
    """Six on either side of zero would be too many: two; without a sign six stay."""
    assert strain_bar(largest, "1", True, "axial strain").parts == parts
    assert strain_bar(2.9e-4, "1", False, "axial strain").parts == 6


@pytest.mark.parametrize("power", [-9, -1, 0, 4])
def test_a_scale_ends_at_its_value_where_that_is_round(power):
    for top, parts in ROUND[:-1]:
        assert round_above(top * 10.0**power) == (pytest.approx(top * 10.0**power), parts)
    assert round_above(1.01 * 10.0**power)[0] == pytest.approx(1.2 * 10.0**power)
    assert round_above(8.5 * 10.0**power)[0] == pytest.approx(10.0 * 10.0**power)
