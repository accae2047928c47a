"""Every command of the README and of the docs runs; long ones in the slow suite."""

from __future__ import annotations

from pathlib import Path

import pytest
from support.pages import PAGES, blocks_of, copy_inputs, name_of, run_blocks

BLOCKS = {name_of(path): [block for block in blocks_of(path) if block.runs] for path in PAGES}
COMMANDS = {
    page: [block for block in blocks if block.language != "toml" or block.mark] for page, blocks in BLOCKS.items()
}
LONG = [page for page, blocks in COMMANDS.items() if any(block.slow for block in blocks)]
QUICK = [page for page, blocks in COMMANDS.items() if blocks and (page == "README.md" or page not in LONG)]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with the cases and meshes, in which commands run."""
    copy_inputs(tmp_path)
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize(
    "page", [page if page == "README.md" else pytest.param(page, marks=pytest.mark.slow) for page in QUICK]
)
@pytest.mark.filterwarnings("ignore::femflex.warning.PhysicsWarning")
def test_quick_commands_of_page_run_in_order(page: str, folder: Path):
    run_blocks([block for block in COMMANDS[page] if not block.slow], folder)


@pytest.mark.slow
@pytest.mark.parametrize("page", LONG)
@pytest.mark.filterwarnings("ignore::femflex.warning.PhysicsWarning")
def test_all_commands_of_page_run_in_order(page: str, folder: Path):
    run_blocks(COMMANDS[page], folder)
