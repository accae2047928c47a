"""The same craft with other names, its tables in reverse order and other units: the same motion and the same modes."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.rewriting import in_other_units, names_of, renamed, reordered, similar_names

import femflex
from femflex.case import read_case
from femflex.pipeline.case_equilibrium import case_modes

CRAFTS = Path(__file__).with_name("crafts")
pytestmark = pytest.mark.filterwarnings("ignore::femflex.warning.PhysicsWarning")
ROUNDING = 1e-6  # of the largest number of a channel; units and orders of sums round otherwise
BY_ORDER = {"q", "u", "z", "momenta"}  # their entries follow the order of the tables


def run_numbers(text: str, folder: Path) -> dict[str, Any]:
    """Every channel of the run of a case, with the frequencies of its bodies and of the craft."""
    shutil.copytree(CRAFTS, folder, ignore=shutil.ignore_patterns("*.toml"))
    path = folder / "craft.toml"
    path.write_text(text, encoding="utf-8")
    with femflex.run(path, folder / "run.h5") as run:
        values_by_name: dict[str, Any] = {name: np.asarray(run[name], float) for name in run.channels}
        values_by_name |= {f"{name}: frequencies": body.omega for name, body in run.bodies().items()}
    values_by_name["craft: frequencies"] = case_modes(read_case(path)).frequencies
    return values_by_name


@pytest.mark.parametrize(
    "craft", ["linkages", *(pytest.param(c, marks=pytest.mark.slow) for c in ("actuators", "taut"))]
)
def test_other_names_order_and_units_leave_run_and_modes_unchanged(craft: str, tmp_path: Path):
    text = (CRAFTS / f"{craft}.toml").read_text(encoding="utf-8")
    names = similar_names(names_of(text))
    original_names = {other: name for name, other in names.items()}
    other_text = renamed(reordered(in_other_units(text)), names)
    expected = run_numbers(text, tmp_path / "one")
    rewritten = {
        renamed(name, original_names): values for name, values in run_numbers(other_text, tmp_path / "other").items()
    }
    assert set(rewritten) == set(expected)
    for name, values in expected.items():
        other = rewritten[name]
        if name in BY_ORDER:
            values, other = np.sort(values), np.sort(other)
        np.testing.assert_allclose(
            other, values, rtol=0, atol=ROUNDING * (np.nanmax(np.abs(values), initial=0) + 1e-3), err_msg=name
        )
