"""Which strain a body of a case gets, and what is said of stiffening that linear strain leaves out."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

import femflex
from femflex.case import read_case
from femflex.case.builders import build_body
from femflex.reduction import BeamFunctions, UniformBeam, beam_body, foreshortening_of
from femflex.warning import PhysicsWarning

FAST = ('rates = ["2 deg/s", 0, 0.01]', 'rates = [0, 0, "20 rad/s"]')
DAMPING = 'damping = { ratio = "0.5 %" }'


def built(write_case, craft, *changes):
    for old, new in changes:
        assert old in craft
        craft = craft.replace(old, new)
    return build_body(read_case(write_case(craft)), "boom")


def test_a_slow_body_stays_linear_and_a_fast_one_is_condensed(write_case, craft):
    slow, fast = built(write_case, craft), built(write_case, craft, FAST)
    some = built(write_case, craft, (FAST[0], FAST[1].replace("20", "2")))
    assert slow.strain.is_linear and slow.note.endswith("the case tells of no spin that would stiffen it")
    assert some.strain.is_linear and some.note.startswith("strain is linear: turning at 2 rad/s stiffens")
    assert len(fast.slaves) and "strain is condensed: turning at 20 rad/s may stiffen the first shape" in fast.note
    assert fast.n_modes == slow.n_modes == 4 and set(fast.kinds[4:]) == {"derivative"}


def test_a_body_that_starts_bent_is_condensed(write_case, craft):
    bend = ('displacement = [0, "10 mm", 0]', "relative = [0, 0.08, 0]")
    assert "starts bent by 8%" in built(write_case, craft, bend).note


def test_a_body_keeps_the_strain_it_asks_for(write_case, craft):
    linear = built(write_case, craft, FAST, (DAMPING, DAMPING + '\nstrain = "linear"'))
    assert linear.strain.is_linear and linear.note == "" and linear.ignored is not None
    condensed = built(write_case, craft, (DAMPING, DAMPING + '\nstrain = "condensed"'))
    assert len(condensed.slaves) and condensed.note == ""


def test_foreshortening_of_a_mesh_is_that_of_the_beam_itself(write_case, craft):
    body = built(write_case, craft, (DAMPING, DAMPING + '\nstrain = "linear"'))
    area = np.pi * (0.03**2 - 0.028**2)
    I = np.pi / 4 * (0.03**4 - 0.028**4)
    beam = UniformBeam(3.0, 70e9 * area, 70e9 * I, 70e9 * I, 1e4, 2700 * area)
    own = foreshortening_of(beam_body(beam, BeamFunctions(y=6, family="polynomial"), strain="condensed"))
    assert body.ignored == pytest.approx(own, abs=5e-3 * np.abs(own).max())  # the mesh's beam shears too
    # flap stiffening of a cantilever, mu^2 = 12.36 + 1.193 gamma^2 (one term of Rayleigh's quotient)
    scale = np.sqrt(70e9 * I / (2700 * area * 3.0**4))
    assert -own[1, 0] * 12.362 * scale**2 == pytest.approx(1.193, abs=2e-3)


def test_ignored_stiffening_is_told_with_both_numbers(write_case, craft, tmp_path):
    text = craft.replace(*FAST).replace(DAMPING, DAMPING + '\nstrain = "linear"').replace('"10 s"', '"0.2 s"')
    with pytest.warns(PhysicsWarning, match=r"'boom' turned at up to 20.01 rad/s: a stiffening of 16% of its"):
        femflex.run(write_case(text), tmp_path / "fast.h5")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        femflex.run(write_case(text.replace('strain = "linear"', 'strain = "condensed"')), tmp_path / "good.h5")
