"""Every value of every shipped case, replaced by one it should not have: `check` ends in time, without a traceback."""

from __future__ import annotations

import random
import warnings
from pathlib import Path
from typing import Any

import pytest
from support.mutations import CASES, VALUES, mutated, mutation_folder, places, raw_case, renamed, toml

from femflex.cli.check import examine_case
from femflex.cli.verb import meaning

KEYS = ["", ".", "a/b", "\x00", "\u00e9", "x" * 3000, "a b", "kind"]


def changed_copies(name: str, values: list[Any]) -> list[dict[str, Any]]:
    """All copies of a case with one value or key changed."""
    raw = raw_case(name)
    renamings = [
        renamed(raw, key_path, key) for key_path in places(raw) if isinstance(key_path[-1], str) for key in KEYS
    ]
    return [mutated(raw, key_path, value) for key_path in places(raw) for value in values] + renamings


def check_all(name: str, folder: Path, copies: list[dict[str, Any]]) -> None:
    """Every changed case is sound, refused, without equilibrium or beyond the eigen-solver (3); lines are printable."""
    path = folder / name
    for raw in copies:
        path.write_text(toml(raw), encoding="utf-8")
        code, text = 0, ""
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            try:
                examine_case(path)
            except Exception as error:
                code, sentences = meaning(error)
                text = "\n".join(sentences)
                assert text
        # as under a force of 1e30 N, and with a density of 1e30 kg/m^3
        is_insoluble = code == 3 and ("no equilibrium was found" in text or "many orders apart" in text)
        assert code in (0, 2) or is_insoluble, f"{name}: {text}"
        assert all(line.isprintable() and len(line) < 4000 for line in text.split("\n")), repr(text)


@pytest.mark.parametrize("name", ["panel_slew.toml", "four_bar.toml", "gimbal_antenna.toml"])
def test_wrong_types_are_refused(name: str, tmp_path: Path):
    copies = changed_copies(name, [True, [[]], {"kind": []}, 1e300])
    check_all(name, mutation_folder(tmp_path), random.Random(21).sample(copies, 8))


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(path.name for path in CASES.glob("*.toml")))
def test_cases_with_one_value_changed_are_answered(name: str, tmp_path: Path):
    copies = changed_copies(name, VALUES)
    check_all(name, mutation_folder(tmp_path), random.Random(22).sample(copies, min(len(copies), 400)))
