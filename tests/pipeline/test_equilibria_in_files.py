"""An equilibrium in a result file: one row, with the stress resultants of statics at the points that a case names."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.small_craft import BOOM

from femflex.case import Case, CaseError, read_case
from femflex.dynamics.equilibria.equilibrium import Equilibrium
from femflex.pipeline.balanced import balanced, case_modes, decided_at_rest, keep
from femflex.pipeline.decisions import Decided
from femflex.pipeline.recovered import recovered
from femflex.results import open_run

FORCE = np.array([5.0, -0.3, 0.7])  # N at the tip, 3 m from the root
NODAL = """
title = "a boom at rest"
[run]
duration = 3
[materials.aluminium]
E = 70e9
nu = 0.25
density = 2700
[sections.tube]
kind = "tube"
outer_radius = 0.03
thickness = 0.002
[bodies.hub]
kind = "rigid"
mass = 2
inertia = [3, 4, 5]
[bodies.boom]
kind = "flexible"
mesh = "boom.inp"
members = [{ group = "BOOM", family = "beam", section = "tube", material = "aluminium" }]
reduction = { method = "nodal", clamp = "ROOT" }
strain = "linear"
markers.tip = { group = "TIP" }
recovery.middle = { position = [1.4, 0, 0.1], quantities = ["moment_z", "axial_force"] }
recovery.all = { position = [2.2, 0, 0] }
[[joints]]
kind = "weld"
child = "hub"
[[joints]]
kind = "revolute"
parent = "hub"
child = "boom"
child_marker = "ROOT"
name = "hinge"
axis = "x"
stiffness = 40
[[loads]]
name = "tug"
body = "boom"
marker = "tip"
force = [5, -0.3, 0.7]
"""
TWIST = """
[[loads]]
name = "twist"
body = "boom"
marker = "tip"
torque = [[0, 0, 0], [4, 0, 0]]
times = [0, 2]
"""


@pytest.fixture(scope="module")
def kept(tmp_path_factory: pytest.TempPathFactory) -> tuple[Case, Decided, Equilibrium, Path]:
    """The case, what was decided of it, its equilibrium, and the file of that."""
    folder = tmp_path_factory.mktemp("rest")
    (folder / "boom.inp").write_text(BOOM)
    (folder / "craft.toml").write_text(NODAL)
    case = read_case(folder / "craft.toml")
    decided = decided_at_rest(case)
    found = balanced(decided)
    keep(found, case, folder / "out.h5", decided=decided)
    return case, decided, found, folder / "out.h5"


def test_recovered_resultants_are_those_of_statics(kept: tuple[Case, Decided, Equilibrium, Path]):
    """N = F_x, M_y = -F_z (L - x), M_z = F_y (L - x), V_y = F_y, V_z = F_z at the points that are nearest."""
    with open_run(kept[-1]) as run:
        own = {path.removeprefix("recovery/boom."): run[path] for path in run if path.startswith("recovery/")}
        assert {path for path in own if path.startswith("middle")} == {"middle/moment_z", "middle/axial_force"}
        assert all(value.shape == (1,) for value in own.values())
        about = {path: run.channels[f"recovery/boom.{path}"] for path in own}
        x = {path: float(one.description.split("(")[1].split(",")[0]) for path, one in about.items()}
        for path, expected in (
            ("axial_force", lambda x: FORCE[0]),
            ("moment_y", lambda x: -FORCE[2] * (3 - x)),
            ("moment_z", lambda x: FORCE[1] * (3 - x)),
            ("shear_force_y", lambda x: FORCE[1]),
            ("shear_force_z", lambda x: FORCE[2]),
        ):
            for place, at in (("middle", 1.4), ("all", 2.2)):
                name = f"{place}/{path}"
                if name in own:
                    assert own[name][0] == pytest.approx(expected(x[name]), rel=1e-3), name
                    assert x[name] == pytest.approx(at, abs=0.3), name
                    assert about[name].description.startswith(f"{path} of boom at (")
                    assert about[name].description.endswith(") m of its frame")
        units = {path: one.unit for path, one in about.items()}
        assert (units["middle/moment_z"], units["all/axial_force"], units["all/fibre_stress"]) == ("N m", "N", "Pa")


def test_the_file_of_an_equilibrium_says_what_it_is(kept: tuple[Case, Decided, Equilibrium, Path], tmp_path: Path):
    case, decided, found, path = kept
    with open_run(path) as run:
        assert run.time.tolist() == [0.0] and run.complete and run.title == "a boom at rest"
        assert run.ended == f"equilibrium, {found.verdict}" and run.case_text == NODAL
        attributes = run.attributes
        assert attributes["case_path"] == str(case.path) and attributes["integrator"] == "equilibrium"
        assert attributes["frame"] == "N inertial; attitude from the inertial frame" and run.without == ()
        assert run.statistics == {"iterations": found.iterations, "residual": found.residual}
        np.testing.assert_array_equal(run["q"][0], found.q)
        assert set(run) == set(found.model.channels) | set(recovered(case, decided.system).channels)
        assert sorted(run.bodies()) == ["boom", "hub"]
    with pytest.raises(FileExistsError):
        keep(found, case, path)
    shutil.copy(path, tmp_path / "out.h5")
    keep(found, case, tmp_path / "out.h5", force=True, ended="it turned over")
    with open_run(tmp_path / "out.h5") as run:
        assert not run.complete and run.ended == "it turned over"


def test_an_equilibrium_is_that_of_the_loads_at_its_time(write_case: Any):
    """The hinge resists the twist alone: 2 N m / 40 N m at half the time of its rise.

    A craft that starts in equilibrium is not asked to be there at the start: with the twist there is none without a
    time.
    """
    decided = decided_at_rest(read_case(write_case(NODAL + TWIST + '[initial]\nfrom = "equilibrium"\n')))
    assert decided.case.initial is None
    with pytest.raises(ValueError, match="load 'twist' changes over time"):
        balanced(decided)
    found = case_modes(decided, 1.0)
    assert float(found.about.q[0]) == pytest.approx(0.05, rel=2e-3) and found.left_out == ()


@pytest.mark.parametrize(
    ("old", "new", "where", "text"),
    [
        (
            '"moment_z", "axial_force"', '"moment_z", "force_x"', "bodies.boom.recovery.middle",
            "found the quantity 'force_x', which the body does not have; it has ['axial_force', ",
        ),
        (
            '{ method = "nodal", clamp = "ROOT" }', '{ method = "rigid" }', "bodies.boom.recovery.middle",
            "found a body without elements or functions that strain; take it out",
        ),
    ],
)  # fmt: skip
def test_what_cannot_be_recovered_is_refused(write_case: Any, old: str, new: str, where: str, text: str):
    changed = NODAL.replace(old, new)
    if "rigid" in new:
        changed = changed.replace('strain = "linear"', "markers.ROOT = {}")
    with pytest.raises(CaseError) as caught:
        decided_at_rest(read_case(write_case(changed)))
    found = caught.value.problems
    assert found[0].where == where and found[0].text.startswith(text), str(caught.value)
    assert len(found) == (2 if "rigid" in new else 1)
