"""A uniform beam on a hub as a small case, its mesh in the same folder."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from support.straight_beam import beam_mesh

from femflex.case import Case, read_case

SAID = 'strain = "linear"\n'  # of the beam, where a test says nothing of it; its load would choose another
EI, MASS = 50.0, 0.5  # N m^2, kg/m

HUB_AND_BEAM = f"""
[run]
duration = "4 s"
output_step = "0.05 s"
rtol = 1e-10

[sections.beam]
kind = "stiffness"
EA = 1e5
EIy = {EI}
EIz = {2 * EI}
GJ = 400
mass_per_length = {MASS}
ry = 0.01
rz = 0.01

[bodies.hub]
kind = "rigid"
mass = 5
inertia = [3, 3, 3]

[bodies.beam]
kind = "flexible"
mesh = "beam.inp"
members = [{{ group = "BEAM", family = "beam", section = "beam", options = {{ rotary_inertia = false }} }}]
reduction = {{ method = "cantilever", clamp = "ROOT", modes = 4 }}
markers.tip = {{ group = "TIP" }}
strain = "linear"

[[joints]]
kind = "weld"
parent = "hub"
child = "beam"
child_marker = "ROOT"

[[loads]]
name = "pulse"
body = "hub"
torque = [[0, 0, 0], [0, 4, 8], [0, 0, 0]]
times = [0, 1, 2]

[study]
quantity = {{ of = "value", channel = "markers/beam.tip/deflection", component = "y" }}
"""


@pytest.fixture
def write_case_file(tmp_path: Path) -> Callable[..., Path]:
    """Writes the case with some of its text replaced, and its mesh; returns the case's path."""

    def write(*replaced: tuple[str, str], cells: int = 6) -> Path:
        text = HUB_AND_BEAM
        for old, new in replaced:
            assert old in text, old
            text = text.replace(old, new)
        if text.count("strain =") > 1 or "segments =" in text or 'kind = "file"' in text:
            text = "".join(text.rsplit(SAID, 1))
        (tmp_path / "beam.inp").write_text(beam_mesh(cells))
        path = tmp_path / "case.toml"
        path.write_text(text)
        return path

    return write


@pytest.fixture
def build_case(write_case_file: Callable[..., Path]) -> Callable[..., Case]:
    """The same, read."""
    return lambda *replaced, cells=6: read_case(write_case_file(*replaced, cells=cells))
