"""The picture of a convergence study: there, not blank, and it says what the study says."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from matplotlib.image import imread

from femflex.case import Case
from femflex.studies import Convergence, Point, assessed, planned
from femflex.view.convergence import abscissa, plot_convergence

Built = Callable[..., Case]


def study(case: Case, values: list[float], over: str = "modes") -> Convergence:
    """A study of made-up values at 1, 2, 4, ... modes, or at 0, 1, 2, ... refinements."""
    levels = [2**k if over == "modes" else k for k in range(len(values))]
    counts = [level if over == "modes" else 10 * 2**level for level in levels]
    points = [Point(n, m, v, 1e-12, "m") for n, m, v in zip(levels, counts, values, strict=True)]
    return assessed(planned(case, over), points, 1e-3)  # type: ignore[arg-type]


STUDIES = {
    "law": [1.5, 1.1, 1.02, 1.004, 1.0008],
    "constant": [1.0] * 4,
    "nothing": [0.0] * 4,
    "growing": [1.0, 2.0, 4.0, 8.0],
    "swinging": [1.0, 1.2, 1.01, 1.02, 1.0199],
    "two": [1.0, 1.1],
    "one": [1.0],
}


@pytest.mark.sampled(2)
@pytest.mark.parametrize("over", ["modes", "mesh"])
@pytest.mark.parametrize("values", STUDIES.values(), ids=STUDIES)
def test_every_kind_of_study_can_be_drawn(built: Built, tmp_path: Path, values: list[float], over: str):
    path = plot_convergence(
        study(built(), values, over), tmp_path / "study.png", theme="dark" if over == "mesh" else "light", dpi=60
    )
    pixels = imread(path)[..., :3]
    assert pixels.shape == (432, 540, 3)
    background = np.abs(pixels - pixels[0, 0]).max(axis=2) < 0.02
    assert 0.6 < background.mean() < 0.97
    assert background[:, :2].all() and background[:, -2:].all()  # nothing runs out of the sides


def test_the_picture_says_quantity_law_tolerance_and_verdict(built: Built, tmp_path: Path):
    found = study(built(), STUDIES["law"], "mesh")
    text = plot_convergence(found, tmp_path / "study.svg").read_text()
    for told in ("Value of markers/beam.tip/deflection y", "tolerance 0.001", "degrees of freedom", "order 2.3"):
        assert told in text
    assert " ".join(found.verdict.split()[:6]) in text


def test_another_kind_of_file_is_refused(built: Built, tmp_path: Path):
    with pytest.raises(ValueError, match=r"written as \.png or \.svg; study\.pdf is neither"):
        plot_convergence(study(built(), [1.0, 2.0]), tmp_path / "study.pdf")
    path = plot_convergence(study(built(), [1.0, 2.0]), tmp_path / "study.png", dpi=40)
    with pytest.raises(FileExistsError, match="exists"):
        plot_convergence(study(built(), [1.0, 2.0]), path)


def test_levels_that_add_no_coordinate_stand_apart(built: Built):
    points = [Point(n, 5, v, 1e-12, "m") for n, v in zip([1, 2, 4], [1.5, 1.1, 1.02], strict=True)]
    found = assessed(planned(built(), "modes"), points, 1e-3)
    assert abscissa(found).tolist() == [1, 2, 4] and found.counts.tolist() == [5, 5, 5]
    assert abscissa(study(built(), [1.5, 1.1, 1.02], "mesh")).tolist() == [10, 20, 40]
