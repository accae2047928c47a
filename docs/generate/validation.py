"""Comparisons with answers from outside: the rows of docs/validation.toml, and all answers of the shipped cases."""

from __future__ import annotations

import tomllib
from pathlib import Path

from femflex import read_case
from generate.gallery import expected_answers, expected_text, quantity_text, shipped_cases
from generate.markdown import cell, code, save, table

DATA = Path(__file__).resolve().parents[1] / "validation.toml"
HEAD = """# Validation

Every row compares femflex with an answer from outside: a closed form, a published number, another program, or the full
finite elements. The command of a row reproduces it. `pytest -m ""` includes slow tests.

"""
TITLES = {"multibody": "Multibody systems and mechanisms"}  # where a subject's name is not its title


def validation_rows() -> dict[str, list[dict[str, str]]]:
    """The rows of validation.toml by subject."""
    return tomllib.loads(DATA.read_text(encoding="utf-8"))


def title_of(subject: str) -> str:
    """Heading of a subject."""
    return TITLES.get(subject, subject.replace("_", " ").capitalize())


def write(target: Path) -> None:
    """Write the page validation.md."""
    sections = [HEAD]
    for subject, entries in validation_rows().items():
        cells = [[cell(e["what"]), cell(e["answer"]), cell(e["femflex"]), code(e["command"])] for e in entries]
        sections.append(
            f"## {title_of(subject)}\n\n{table(('what', 'answer from outside', 'femflex', 'command'), cells)}"
        )
    sections.append(
        "## Every expected answer of the shipped cases\n\nEach is checked by `pytest tests/test_cases.py`.\n"
    )
    answer_rows = []
    for path in shipped_cases():
        case = read_case(path)
        for name, about in expected_answers(case):
            row = [
                code(path.stem),
                cell(name.replace("_", " ")),
                cell(quantity_text(about)),
                cell(expected_text(about)),
            ]
            answer_rows.append([*row, cell(about.source)])
    sections.append(table(("case", "name", "quantity", "expected", "source"), answer_rows))
    save(target / "validation.md", "\n".join(sections))
