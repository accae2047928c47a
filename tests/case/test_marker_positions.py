"""Positions of markers against the mesh: how far off one is taken for a mistake."""

from __future__ import annotations

import pytest
from small_craft import CRAFT


@pytest.mark.parametrize(("share", "refused"), [(0.045, False), (0.055, True)])
def test_a_position_a_twentieth_of_the_mesh_away_is_refused(write_case, femflex, share, refused):
    """The boom is a line of 3 m, of whose points there are several."""
    off = 3.0 * share
    path = write_case(CRAFT + f'\n[bodies.boom.markers.aside]\nposition = ["3 m", "{off} m", "0 m"]\n')
    code, _, said = femflex("check", path)
    text = (
        f"bodies.boom.markers.aside.position: found [3.0, {off}, 0.0] m, {off:.4g} m from the nearest point of the mesh"
    )
    assert code == (2 if refused else 0) and (text in " ".join(said.split())) == refused
