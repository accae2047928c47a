"""A finished run of the small craft, made once, copied into the folder of each test that needs it."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from support.small_craft import BOOM, CRAFT


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
