"""Benchmarks: a page each, of the case that the tests run and the numbers that it gives.

`python docs/generate/benchmarks.py [NAME ...]` runs all or the named ones and writes docs/benchmarks. The numbers are
kept in numbers.json, so that the pages can be compared with the cases without a run.
"""

from __future__ import annotations

import json
import sys
import tempfile
import tomllib
from pathlib import Path
from typing import Any

TOP = Path(__file__).resolve().parents[2]
PAGES = TOP / "docs" / "benchmarks"
NUMBERS = PAGES / "numbers.json"
ENTRIES: dict[str, dict[str, Any]] = tomllib.loads((TOP / "docs" / "benchmarks.toml").read_text(encoding="utf-8"))
NOTE = "<!-- Written by docs/generate/benchmarks.py from the case. -->\n"
HEAD = f"""# Benchmarks

Each page has a problem with a known answer: its source, a picture, what femflex gives, and how the error falls with
refinement. The answers are those of the case file, which `pytest tests/test_cases.py` checks. The
[table of all comparisons](../generated/validation.md) has many more. [One deck in two programs](calculix.md) compares
with CalculiX.

{NOTE}
"""


def case_of(name: str) -> Any:
    """The case of a benchmark."""
    from femflex import read_case

    return read_case(TOP / "cases" / f"{name}.toml")


def measured(case: Any) -> dict[str, Any]:
    """Measured value and unit of every answer of a case, by name."""
    import femflex
    from femflex.measures.verdicts import expects_modes, mode_verdicts, run_verdicts
    from femflex.pipeline.case_equilibrium import case_modes

    with tempfile.TemporaryDirectory() as folder, femflex.run(case, Path(folder) / "run.h5") as run:
        verdicts = run_verdicts(case, run)
    if expects_modes(case):
        verdicts += mode_verdicts(case, case_modes(case))
    return {verdict.name: [float(f"{verdict.measured:.12g}"), verdict.unit] for verdict in verdicts}


def numbers_of(name: str) -> dict[str, Any]:
    """What the runs of a benchmark give: all answers, and the followed one at every level."""
    from femflex import with_values

    entry, case = ENTRIES[name], case_of(name)
    levels = [(level, with_values(case, {entry["key"]: level})) for level in entry["levels"]]
    return {
        "answers": measured(case),
        "levels": [[level, measured(changed)[entry["answer"]][0]] for level, changed in levels],
    }


def difference(value: float, expected: float | None) -> str:
    """Difference from the expected value, relative where that is not zero; empty where a limit is expected."""
    if expected is None:
        return ""
    return f"{value / expected - 1:.1e}" if expected else f"{value:.1e}"


def page(name: str, numbers: dict[str, Any]) -> str:
    """Text of the page of a benchmark."""
    from femflex.measures.verdicts import verdict_on
    from generate.gallery import case_pictures, quantity_text
    from generate.markdown import cell, code, table

    entry, case = ENTRIES[name], case_of(name)
    verdicts = {key: verdict_on(key, about, *numbers["answers"][key]) for key, about in case.expect.answers.items()}
    rows = []
    for key, about in case.expect.answers.items():
        verdict = verdicts[key]
        unit = "" if verdict.unit in ("", "1") else f" {verdict.unit}"
        quantity = f"{key.replace('_', ' ')}: {quantity_text(about)}"
        measured_text = f"{verdict.measured:.10g}{unit}"
        off = difference(verdict.measured, verdict.value)
        rows.append([cell(quantity), cell(verdict.expected), cell(measured_text), off, cell(about.source)])
    followed = verdicts[entry["answer"]]
    levels = [[f"{level:g}", f"{value:.10g}", difference(value, followed.value)] for level, value in numbers["levels"]]
    picture = case_pictures(name)[0]
    tests = ", ".join(f"[{path}](../../{path})" for path in ["tests/test_cases.py", *entry["tests"]])
    heads = ("quantity", "answer from outside", "femflex", "difference", "source")
    parts = [
        f"# {entry['subject']}: {name}\n",
        f"![{cell(case.title)}](../gallery/{name}/{picture.name})\n",
        f"## Problem\n\n**{cell(case.title)}.** {cell(case.description)}\n",
        f"Case: [cases/{name}.toml](../../cases/{name}.toml)\n",
        f"## Source\n\n{cell(case.source)}\n",
        f"## Answers\n\n{table(heads, rows)}",
        "Differences are relative where the answer is not zero.\n",
        f"## Refinement\n\nThe key {code(entry['key'])} is varied. The quantity is in {followed.unit or 'SI'}.\n",
        table((entry["what"], entry["answer"].replace("_", " "), "difference"), levels),
        f"## Tests\n\n{tests}. Run the case with `femflex run cases/{name}.toml`.\n",
        NOTE,
    ]
    return "\n".join(parts)


def index(numbers: dict[str, Any]) -> str:
    """Text of the page that lists the benchmarks."""
    from femflex.measures.verdicts import verdict_on
    from generate.markdown import cell, table

    rows = []
    for name, entry in ENTRIES.items():
        about = case_of(name).expect.answers[entry["answer"]]
        verdict = verdict_on(entry["answer"], about, *numbers[name]["answers"][entry["answer"]])
        link = f"[{entry['subject']}]({name}.md)"
        off = difference(verdict.measured, verdict.value)
        rows.append([link, cell(f"{entry['answer'].replace('_', ' ')}: {verdict.expected}"), off, cell(about.source)])
    contents = "\n".join(["```{toctree}", ":hidden:", "", *ENTRIES, "calculix", "```"])
    return HEAD + table(("benchmark", "answer from outside", "difference", "source"), rows) + f"\n{contents}\n"


def pages() -> dict[str, str]:
    """Text of every page by its file name, from the stored numbers."""
    numbers = json.loads(NUMBERS.read_text(encoding="utf-8"))
    return {f"{name}.md": page(name, numbers[name]) for name in ENTRIES} | {"index.md": index(numbers)}


def main(names: list[str]) -> None:
    """Run the named benchmarks, or all, and write the pages."""
    from generate.markdown import save

    numbers = json.loads(NUMBERS.read_text(encoding="utf-8")) if NUMBERS.exists() else {}
    for name in names or ENTRIES:
        print(name, flush=True)
        numbers[name] = numbers_of(name)
    save(NUMBERS, json.dumps({name: numbers[name] for name in ENTRIES}, indent=1) + "\n")
    for file, text in pages().items():
        save(PAGES / file, text)


if __name__ == "__main__":
    sys.path[:0] = [str(TOP / "docs"), str(TOP)]
    main(sys.argv[1:])
