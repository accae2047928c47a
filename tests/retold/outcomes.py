"""What the verbs say of a craft, and the numbers that they leave: read so that two tellings can be compared.

A craft may have a folder of its own name with further files (TOML) that name its things, such as sweeps.
"""

from __future__ import annotations

import csv
import re
import shlex
import shutil
from collections import Counter
from collections.abc import Mapping, Sequence
from contextlib import chdir
from importlib import import_module
from itertools import count
from pathlib import Path
from types import MappingProxyType, SimpleNamespace
from typing import Any

import h5py
import numpy as np
import pytest
from support.compared import NUMBER, words_of
from typer.testing import CliRunner

from femflex.arrays import Array
from femflex.cli.app import app

CRAFTS = Path(__file__).parent / "crafts"
WRITTEN = re.compile(r"<!-- (.*?) -->", re.DOTALL)  # above its outlines, a text of a picture stands as it was written
POWER = re.compile(r"\$\\mathdefault\{(?:(-?[\d.]+)\\times)?10\^\{(-?\d+)\}\}\$")
PLAIN = re.compile(r"\$\\mathdefault\{(-?[\d.]+)\}\$")
CHANNEL = re.compile(r"(?<=\brun_)\S+(?=\.\w+$)", re.MULTILINE)  # in the name of a picture, with names of the craft
DIGITS = 6  # of a number in a table: those that other processors have too


def verbs_of(craft: str) -> list[str]:
    """The verbs that its file names, in lines such as "# femflex check craft.toml"."""
    lines = text_of(craft).splitlines()
    return [line.removeprefix("# femflex ") for line in lines if line.startswith("# femflex ")]


def text_of(craft: str) -> str:
    """The case of a craft."""
    return (CRAFTS / f"{craft}.toml").read_text(encoding="utf-8")


def beside(craft: str) -> dict[str, str]:
    """Further files of a craft, by name."""
    return {path.name: path.read_text(encoding="utf-8") for path in sorted((CRAFTS / craft).glob("*.toml"))}


def told(
    text: str, verbs: Sequence[str], folder: Path, further: Mapping[str, str] = MappingProxyType({})
) -> tuple[dict[str, str], dict[str, Array]]:
    """What the verbs say of a craft, by verb, and the numbers of its run; it is written to a folder of its own."""
    with chdir(folder), pytest.MonkeyPatch.context() as patch:
        patch.setattr("femflex.cli.tables.screen_width", lambda: 200)
        doubling = (2.0**k for k in count())
        clock = SimpleNamespace(perf_counter=lambda: next(doubling))
        patch.setattr(import_module("femflex.studies.strain_forms"), "time", clock)
        for file in CRAFTS.iterdir():
            if file.is_file() and file.suffix != ".toml":
                shutil.copy(file, folder)
        for name, written in {**further, "craft.toml": text}.items():
            Path(name).write_text(written, encoding="utf-8")
        return {verb: _said(shlex.split(verb)) for verb in verbs}, numbers_of(Path("run.h5")) if Path(
            "run.h5"
        ).exists() else {}


def _said(words: list[str]) -> str:
    """What a verb prints, on both channels, and what it leaves in files; it has to end well."""
    there = set(Path().iterdir())
    done = CliRunner().invoke(app, words)
    assert done.exit_code == 0, f"{' '.join(words)}: {done.stdout}{done.stderr}"
    left = sorted(path for path in set(Path().iterdir()) - there if path.suffix != ".h5")
    return "\n".join([done.stdout, done.stderr, *(f"left {path}\n{written(path)}" for path in left)])


def written(path: Path) -> str:
    """What stands in a file: the words of a picture (.svg), not where they stand, or the cells of a table (.csv)."""
    if path.suffix == ".svg":
        text = path.read_text(encoding="utf-8").replace("\N{MINUS SIGN}", "-")
        return "\n".join(PLAIN.sub(r"\1", POWER.sub(_plain_power, found)) for found in WRITTEN.findall(text))
    if path.suffix == ".csv":
        with path.open(encoding="utf-8", newline="") as lines:
            return "\n".join("  ".join(map(_cell, row)) for row in csv.reader(lines))
    return ""


def _plain_power(found: re.Match[str]) -> str:
    return f"{found[1] or 1}e{found[2]}"


def _cell(text: str) -> str:
    """A cell of a table, its number shortened; empty ones are marked."""
    return (f"{float(text):.{DIGITS}g}" if "." in text and NUMBER.fullmatch(text) else text) or "-"


def said_at_all(text: str) -> Counter[str]:
    """The words of a text, and how often it says each; numbers, stops and channels of pictures are left out."""
    text = NUMBER.sub("", CHANNEL.sub("", text)).replace(",", " ")
    return Counter(word.strip("():;.") for word in words_of(text))


def numbers_of(path: Path) -> dict[str, Array]:
    """Every table of numbers of a result file that follows time, by name."""
    found: dict[str, Array] = {}
    with h5py.File(path) as file:
        rows = len(file["time"])

        def visit(name: str, one: Any) -> None:
            follows = isinstance(one, h5py.Dataset) and one.dtype.kind == "f" and one.shape[:1] == (rows,)
            if follows and not name.startswith("model/"):
                found[name] = np.asarray(one, float)

        file.visititems(visit)
    return found
