"""Bodies that start far from their undeformed shape: told of once, where their strain is linear."""

import warnings
from pathlib import Path

import pytest

from femflex import build_system
from femflex.case import parse_case

CASE = """
title = "drawn aside"
[run]
duration = 1
[bodies.boom]
kind = "analytic"
length = 2
EA = 1e6
EIy = 100
EIz = 100
GJ = 10
mass_per_length = 1
functions = {{ y = 2 }}
{strain}
initial = {{ marker = "tip", displacement = [0, {displacement}, 0] }}
[[joints]]
kind = "weld"
child = "boom"
child_marker = "root"
"""


@pytest.mark.parametrize(
    ("strain", "displacement", "told"),
    [("linear", 0.3, True), ("linear", 0.1, False), ("condensed", 0.3, False), (None, 0.3, False)],
)
def test_linear_bodies_that_start_far_from_rest_are_told_of_once(strain: str | None, displacement: float, told: bool):
    given = "" if strain is None else f'strain = "{strain}"'
    case = parse_case(CASE.format(strain=given, displacement=displacement), Path("boom.toml"))
    with warnings.catch_warnings(record=True) as seen:
        warnings.simplefilter("always")
        build_system(case)
    texts = [str(one.message) for one in seen if "initial displacement" in str(one.message)]
    assert len(texts) == told
    if told:
        assert "of marker 'tip' of body 'boom' is 0.3 m, 15% of the length 2 m (limit 10%)" in texts[0]
        assert "give it strain = 'condensed', or displace it less" in texts[0]
