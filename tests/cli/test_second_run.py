"""The second run of a case, without one of its terms: as far as it gets, dashed in the plots."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from matplotlib.image import imread
from typer.testing import CliRunner

from femflex.cli.app import app
from femflex.results import open_run

CASES = Path(__file__).parents[2] / "cases"


@pytest.fixture
def spin_up(tmp_path: Path) -> Path:
    """Kane's beam with two bending coordinates, past the time at which linear strain diverges, no scene drawn."""
    text = (CASES / "spin_up.toml").read_text()
    head, _, _ = text.partition("[study]")
    for old, new in (
        ('duration = "20 s"', 'duration = "14 s"'),
        ("samples = 1001", "samples = 141"),
        ("y = 6, axial = 3", "y = 2"),
        ('times = ["6.76 s"]\n', ""),
    ):
        assert old in head, old
        head = head.replace(old, new)
    (tmp_path / "spin_up.csv").write_bytes((CASES / "spin_up.csv").read_bytes())
    path = tmp_path / "case.toml"
    path.write_text(head)
    return path


def run(case: Path, *more: str):
    return CliRunner().invoke(app, ["run", str(case), "-o", str(case.with_name("run.h5")), *more])


@pytest.mark.slow
def test_linear_strain_runs_away_in_the_same_plot_and_the_run_is_done_all_the_same(spin_up: Path):
    done = run(spin_up)
    assert done.exit_code == 0, done.stderr
    said = " ".join(done.stdout.split())
    assert "compared without nonlinear_strain:" in said and "where it diverges" in said
    with open_run(spin_up.with_name("run.h5")) as first, open_run(spin_up.with_name("run_without.h5")) as second:
        assert second.without == ("nonlinear_strain",) and not second.complete and first.complete
        bend, away = (one["markers/beam.tip/deflection"][:, 1] for one in (first, second))
        assert 9.0 < second.time[-1] < 12.0 and np.abs(away).max() > 100 * np.abs(bend).max()
        np.testing.assert_allclose(away[:30], bend[:30], atol=0.02)  # at first they agree
    assert np.ptp(imread(spin_up.with_name("run_markers_beam.tip_deflection.png"))) > 0.5


@pytest.mark.slow
def test_a_run_without_something_has_no_second_one_and_files_in_the_way_are_told_before_any_work(spin_up: Path):
    away = spin_up.with_name("run_without.h5")
    assert run(spin_up, "--no-pictures").exit_code == 0
    assert not away.exists()
    away.write_bytes(b"")
    spin_up.with_name("run.h5").unlink()
    done = run(spin_up)
    assert done.exit_code == 2 and "run_without.h5 exists" in " ".join(done.stderr.split())
    away.unlink()
    assert run(spin_up, "--without", "K3").exit_code == 0
    assert not away.exists()


@pytest.mark.slow
def test_what_cannot_be_left_out_is_told_with_what_can(spin_up: Path):
    spin_up.write_text(spin_up.read_text().replace('"nonlinear_strain"', '"nonlinear"'))
    done = run(spin_up)
    assert done.exit_code == 2
    assert "'nonlinear' is not something that can be switched off; did you mean 'nonlinear_strain'?" in " ".join(
        done.stderr.split()
    )
    assert not spin_up.with_name("run.h5").exists()
