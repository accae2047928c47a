"""Body files that are damaged: a ValueError that names the file."""

from __future__ import annotations

import random
from pathlib import Path

import numpy as np
import pytest

from femflex.body import rigid_body
from femflex.reduction import load_body, save_body


def test_a_damaged_body_file_is_refused_or_read(tmp_path: Path):
    path, generator, refused = tmp_path / "hub.h5", random.Random(3), 0
    save_body(path, rigid_body(1.0, np.eye(3)))
    whole = path.read_bytes()
    for k in range(200):
        changed = bytearray(whole)
        if k % 2:
            changed[generator.randrange(len(whole))] ^= 1 << generator.randrange(8)
        else:
            del changed[generator.randrange(len(whole)) :]
        path.write_bytes(changed)
        try:
            load_body(path)
        except ValueError as error:
            refused += 1
            assert "hub.h5" in str(error)
    assert refused > 50


def test_parts_of_the_wrong_kind_are_told(tmp_path: Path):
    import h5py

    path = tmp_path / "hub.h5"
    save_body(path, rigid_body(1.0, np.eye(3)))
    with h5py.File(path, "r+") as file:
        file.attrs["format_version"] = "newest"
    with pytest.raises(ValueError, match=r"hub.h5 could not be read as femflex body file: .* Make it again"):
        load_body(path)
