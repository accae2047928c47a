"""What a run says of axial forces in deploying beams: left out by linear strain, or near buckling."""

from pathlib import Path

import numpy as np
import pytest

from femflex import run
from femflex.advice.deployed_bending import AxialForceWatch, axial_gain, mean_force
from femflex.case import parse_case
from femflex.dynamics import compile_system
from femflex.pipeline.decisions import build_system
from femflex.warning import PhysicsWarning

MAST = """
title = "a mast that grows under its weight"
source = "numbers of no meaning"
[run]
duration = "20 s"
output_step = "0.5 s"
[environment]
gravity = [-3, 0, 0]
[bodies.mast]
kind = "deploying"
family = "beam"
length = { kind = "smooth_step", from = 3, to = 4, start = 0, end = 20 }
stock = 4
mass_per_length = MASS
EIy = 20
EIz = 30
functions = { y = 2, z = 2 }
strain = "linear"
[[joints]]
kind = "weld"
child = "mast"
"""
FALLING = 7.837  # EI/L^3, the weight per length that buckles a standing mast (Greenhill)


def grown(tmp_path, weight, strain="linear"):
    text = MAST.replace("MASS", f"{weight * FALLING * 20 / 4**3 / 3:.12g}").replace('"linear"', f'"{strain}"')
    return run(parse_case(text, Path("mast.toml")), tmp_path / f"{weight}.h5")


def sections_of_mast():
    (watch,) = [AxialForceWatch(compile_system(build_system(parse_case(MAST.replace("MASS", "1"), Path("mast.toml")))))]
    return watch._sections["mast"]


def test_a_uniform_force_counts_as_its_part_of_eulers_load():
    sections, euler = sections_of_mast(), np.pi**2 * 20 / (4 * 2.5**2)
    force = np.full((1, len(sections.stations)), -0.3 * euler)
    assert axial_gain(sections, force, np.array([2.5])) == pytest.approx(-0.3, rel=1e-6)
    assert mean_force(sections, force[0]) == pytest.approx(-0.3 * euler)


def test_linear_strain_under_weight_is_warned_of_with_the_change_of_frequency(tmp_path):
    """Greenhill's weight lowers the frequency to zero; sqrt(1 - 1/4) leaves 13 %."""
    with pytest.warns(
        PhysicsWarning, match=r"body 'mast' carries .* N along its axis at t = 20 s \(length 4 m\)"
    ) as found:
        grown(tmp_path, 0.25).close()
    (said,) = [str(w.message) for w in found if "carries" in str(w.message)]
    assert "lowers its first frequency by 13% (limit 2%)" in said or "by 12% (limit 2%)" in said
    assert said.endswith("linear strain leaves this out. Give it strain = 'condensed'")


def test_condensed_strain_is_warned_of_near_buckling_alone(tmp_path, recwarn):
    grown(tmp_path, 0.2, "condensed").close()
    assert not [w for w in recwarn if "buckles" in str(w.message)]
    with (
        pytest.warns(PhysicsWarning, match=r"body 'mast' is compressed by the prel.* (7[0-9])% of its buckling load"),
        pytest.warns(
            PhysicsWarning, match=r"body 'mast' is compressed by \S+ N.*: (7[0-9])% of its buckling load as a"
        ),
    ):
        grown(tmp_path, 0.8, "condensed").close()
