"""Cases with known answers, and a finished run of the small craft that is made once."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
from support.small_craft import BOOM, CRAFT

HUB_AND_BEAM = """
title = "hub and beam"

[run]
duration = "0.1 s"
samples = 3

[bodies.hub]
kind = "rigid"
mass = 0.5
inertia = [1, 1, 0.1]
markers.rim = {{ position = [0.1, 0, 0] }}

[bodies.beam]
kind = "analytic"
length = 1
EA = 1e4
EIy = 10
EIz = 1
GJ = 10
mass_per_length = 1
rotary_inertia = false
strain = "linear"
functions = {{ y = {modes}, z = 0 }}
damping = {{ ratio = {damping} }}

[[joints]]
kind = "weld"
parent = "hub"
parent_marker = "rim"
child = "beam"
child_marker = "root"

[study]
quantity = {{ of = "system_frequency", branch = "bending 1" }}
modes = [2, 4, 8]
tolerance = 1e-2

[[loads]]
name = "push"
body = "hub"
torque = [0, 0, 1]
"""
UPRIGHT = """
title = "a pendulum of J = 3 kg m^2 that stands on its hinge: m g l = 19.62 N m"
run = { duration = 1 }
environment = { gravity = 9.81 }
bodies.rod = { kind = "rigid", mass = 2, inertia = [1, 1, 1], markers.foot = { position = [0, 0, -1] } }
[[joints]]
kind = "revolute"
name = "hinge"
child = "rod"
child_marker = "foot"
axis = [0, 1, 0]
"""


@pytest.fixture(scope="session")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of a case, its mesh and its complete run run.h5."""
    import femflex

    folder = tmp_path_factory.mktemp("finished")
    (folder / "boom.inp").write_text(BOOM)
    (folder / "craft.toml").write_text(CRAFT)
    femflex.run(folder / "craft.toml", folder / "run.h5").close()
    return folder


@pytest.fixture
def run_folder(finished: Path, tmp_path: Path) -> Path:
    """The working folder, with copies of these files."""
    shutil.copytree(finished, tmp_path, dirs_exist_ok=True)
    return tmp_path


@pytest.fixture
def hub_and_beam(tmp_path: Path) -> Callable[..., Path]:
    """Writes a free hub with a beam of n shapes (2 or more) and damping ratio, whose frequencies are known exactly."""

    def write(modes: int = 8, damping: float = 0.01) -> Path:
        path = tmp_path / "craft.toml"
        path.write_text(HUB_AND_BEAM.format(modes=modes, damping=damping))
        return path

    return write


@pytest.fixture
def upright(tmp_path: Path) -> Callable[..., Path]:
    """Writes an upright pendulum, with more keys of its joint."""

    def write(joint_keys: str = "") -> Path:
        path = tmp_path / "up.toml"
        path.write_text(UPRIGHT + joint_keys)
        return path

    return write
