"""Every case file that is shipped runs and meets its own expectations."""

from __future__ import annotations

import tomllib
import warnings
from pathlib import Path

import pytest
from support.compared import differing, same_words
from support.recorded_cases import done, known

import femflex
from femflex.case import read_case
from femflex.case.verdicts import expects_modes, judged, judged_diagram, judged_modes
from femflex.pipeline.balanced import case_modes
from femflex.studies.campbell import case_campbell

OTHER_PROCESSORS = 1e-5  # of the largest number of a channel, by which it may differ there; two were seen 2e-6 apart
CASES = sorted((Path(__file__).resolve().parents[1] / "cases").glob("*.toml"))


def _slow(path: Path) -> bool:
    return bool(tomllib.loads(path.read_text(encoding="utf-8")).get("expect", {}).get("slow", False))


ALL = [pytest.param(path, id=path.stem, marks=[pytest.mark.slow] if _slow(path) else []) for path in CASES]


def test_there_are_cases():
    assert {"orbiter_beam", "orbiter_pitch30"} <= {path.stem for path in CASES}


@pytest.mark.parametrize("path", ALL)
@pytest.mark.filterwarnings("ignore::femflex.warning.PhysicsWarning")
def test_a_shipped_case_meets_its_expectations_and_runs_as_recorded(path: Path, tmp_path: Path):
    case = read_case(path)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        run = femflex.run(case, tmp_path / "run.h5")
    with run:
        assert run.complete and run.case_text == path.read_text(encoding="utf-8")
        verdicts = judged(case, run)
        words, numbers = done(run)
    if case.campbell is not None:
        verdicts += judged_diagram(case, case_campbell(case))
    if expects_modes(case):
        verdicts += judged_modes(case, case_modes(case))
    assert all(verdict.holds for verdict in verdicts), "\n".join(map(str, verdicts))
    if not _slow(path):
        said, channels, values = known(path.stem)
        assert same_words("\n".join(sorted(str(one.message) for one in caught)), "\n".join(said)) == ""
        assert words == channels
        assert differing(numbers, values, OTHER_PROCESSORS) == []


@pytest.mark.parametrize("path", CASES, ids=[path.stem for path in CASES])
@pytest.mark.filterwarnings("ignore::femflex.warning.PhysicsWarning")
def test_a_shipped_case_says_where_its_numbers_and_answers_come_from(path: Path):
    case = read_case(path)
    assert case.title and len(case.source) > 20
    assert case.expect.answers, "a case has expectations"
    for name, answer in case.expect.answers.items():
        assert answer.source or answer.value is None, f"expect.{name} says no source"
