"""Every command of the README and of the docs runs; long ones in the slow suite."""

from __future__ import annotations

from pathlib import Path

import pytest
from support.pages import PAGES, blocks_of, copy_inputs, name_of, run_blocks

BLOCKS = {name_of(path): [block for block in blocks_of(path) if block.runs] for path in PAGES}
COMMANDS = {
    page: [block for block in blocks if block.language != "toml" or block.mark] for page, blocks in BLOCKS.items()
}
QUICK = [page for page, blocks in COMMANDS.items() if any(not block.slow for block in blocks)]
LONG = [page for page, blocks in COMMANDS.items() if any(block.slow for block in blocks)]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with the cases and meshes, in which commands run."""
    copy_inputs(tmp_path)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_the_pages_have_commands():
    assert len(QUICK) >= 10 and sum(len(blocks) for blocks in COMMANDS.values()) > 40


@pytest.mark.parametrize(
    "page", [page if page == "README.md" else pytest.param(page, marks=pytest.mark.slow) for page in QUICK]
)
@pytest.mark.filterwarnings("ignore::femflex.warning.PhysicsWarning")
def test_the_quick_commands_of_a_page_work_in_their_order(page: str, folder: Path):
    run_blocks([block for block in COMMANDS[page] if not block.slow], folder)


@pytest.mark.slow
@pytest.mark.parametrize("page", LONG)
@pytest.mark.filterwarnings("ignore::femflex.warning.PhysicsWarning")
def test_all_commands_of_a_page_work_in_their_order(page: str, folder: Path):
    run_blocks(COMMANDS[page], folder)
