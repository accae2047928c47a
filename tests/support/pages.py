"""Code blocks of Markdown pages, and a folder in which their commands run in order."""

from __future__ import annotations

import re
import shlex
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

TOP = Path(__file__).resolve().parents[2]
PAGES = [TOP / "README.md", *sorted(path for path in (TOP / "docs").rglob("*.md") if "generated" not in path.parts)]
BLOCK = re.compile(
    r"(?:^<!-- (?P<mark>[^>]*?) -->\n)?^```(?P<language>\w+)\n(?P<text>.*?)^```", re.DOTALL | re.MULTILINE
)
ELSEWHERE = {"run command", "test command"}  # of the README, run by tests/test_readme.py
RUN = {"sh", "python", "toml"}


@dataclass(frozen=True)
class Block:
    """A code block of a page.

    language  sh, python, toml or text
    mark      words of the comment above it: "slow", "file: NAME", "not run: REASON", or ""
    """

    page: str
    language: str
    mark: str
    text: str

    @property
    def slow(self) -> bool:
        """Whether only the slow suite runs it."""
        return self.mark == "slow"

    @property
    def runs(self) -> bool:
        """Whether it is run at all."""
        return self.language in RUN and not self.mark.startswith("not run:") and self.mark not in ELSEWHERE


def name_of(path: Path) -> str:
    """The page's path inside the repository."""
    return path.relative_to(TOP).as_posix()


def blocks_of(path: Path) -> list[Block]:
    """The code blocks of a page, in their order."""
    text = path.read_text(encoding="utf-8")
    return [Block(name_of(path), m["language"], m["mark"] or "", m["text"]) for m in BLOCK.finditer(text)]


def copy_inputs(folder: Path) -> None:
    """Put the cases and meshes of the repository into a folder."""
    for name in ("cases", "meshes"):
        shutil.copytree(TOP / name, folder / name)


def run_blocks(blocks: list[Block], folder: Path) -> None:
    """Run the blocks of a page in their order inside a folder; AssertionError where one fails."""
    names: dict[str, Any] = {"__name__": "page"}
    for block in blocks:
        if block.language == "python":
            exec(compile(block.text, block.page, "exec", dont_inherit=True), names)  # as a user's file
        elif block.language == "toml" and block.mark.startswith("file: "):
            (folder / block.mark.removeprefix("file: ")).write_text(block.text, encoding="utf-8")
        elif block.language == "sh":
            for line in block.text.splitlines():
                if line.strip() and not line.startswith("#"):
                    run_line(line, folder, block.page)


def run_line(line: str, folder: Path, page: str) -> None:
    """Run one command line: femflex in this process, anything else in a shell."""
    if line.startswith("femflex "):
        from typer.testing import CliRunner

        from femflex.cli.app import app

        done = CliRunner().invoke(app, shlex.split(line, comments=True)[1:])
        if done.exception is not None and not isinstance(done.exception, SystemExit):
            raise done.exception
        assert done.exit_code == 0, f"{page}: {line}\n{done.stdout}\n{done.stderr}"
    else:
        line = re.sub(r"^python ", f"{shlex.quote(sys.executable)} ", line)
        found = subprocess.run(line, shell=True, cwd=folder, capture_output=True, text=True, check=False)
        assert found.returncode == 0, f"{page}: {line}\n{found.stdout}\n{found.stderr}"
