"""Runs that end before their first row leave no file, whatever ends them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from support.known_run import CHANNELS, known_arrays, known_bodies

from femflex.results import RunWriter


@pytest.mark.parametrize("blocks", [0, 2])
@pytest.mark.parametrize("complete", [True, False])
def test_a_run_that_ends_before_its_first_row_leaves_no_file(tmp_path: Path, blocks: int, complete: bool):
    none = np.zeros(0)
    with RunWriter(tmp_path / "run.h5", CHANNELS, known_bodies(), {}) as writer:
        for k in range(blocks):
            writer.write_block(none, known_arrays(none), resume={"steps": k})
        writer.finish(complete=complete, ended="at once", statistics={"steps": 0})
    assert list(tmp_path.iterdir()) == []


def test_a_run_that_an_error_ends_before_its_first_row_leaves_no_file(tmp_path: Path):
    with (
        pytest.raises(ZeroDivisionError),
        RunWriter(tmp_path / "run.h5", CHANNELS, known_bodies(), {}) as writer,
    ):
        writer.write_block(np.zeros(0), known_arrays(np.zeros(0)))
        raise ZeroDivisionError
    assert list(tmp_path.iterdir()) == []
