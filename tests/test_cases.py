"""Every shipped case runs and meets its own expectations."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest

import femflex
from femflex.case import read_case
from femflex.integrate import Esdirk4
from femflex.measures.verdicts import diagram_verdicts, expects_modes, mode_verdicts, run_verdicts
from femflex.pipeline import prepare
from femflex.pipeline.case_equilibrium import case_modes
from femflex.studies.campbell import case_campbell

CASES = sorted((Path(__file__).resolve().parents[1] / "cases").glob("*.toml"))


def _slow(path: Path) -> bool:
    return bool(tomllib.loads(path.read_text(encoding="utf-8")).get("expect", {}).get("slow", False))


ALL = [pytest.param(path, id=path.stem, marks=[pytest.mark.slow] if _slow(path) else []) for path in CASES]


@pytest.mark.parametrize("path", ALL)
@pytest.mark.filterwarnings("ignore::femflex.warning.PhysicsWarning")
def test_shipped_case_meets_its_expectations(path: Path, tmp_path: Path):
    case = read_case(path)
    with femflex.run(case, tmp_path / "run.h5") as run:
        assert run.complete and run.case_text == path.read_text(encoding="utf-8")
        verdicts = run_verdicts(case, run)
    if case.campbell is not None:
        verdicts += diagram_verdicts(case, case_campbell(case))
    if expects_modes(case):
        verdicts += mode_verdicts(case, case_modes(case))
    assert all(verdict.holds for verdict in verdicts), "\n".join(map(str, verdicts))


@pytest.mark.parametrize("path", CASES, ids=[path.stem for path in CASES])
@pytest.mark.filterwarnings("ignore::femflex.warning.PhysicsWarning")
def test_shipped_case_gives_the_source_of_its_answers(path: Path):
    case = read_case(path)
    assert case.title and len(case.source) > 20
    assert case.expect.answers, "a case has expectations"
    for name, answer in case.expect.answers.items():
        assert answer.source or answer.value is None, f"expect.{name} has no source"


@pytest.mark.slow
def test_stiff_mast_is_integrated_by_the_implicit_method(tmp_path: Path):
    prepared = prepare(CASES[0].with_name("stiff_mast.toml"), tmp_path / "run.h5")
    assert prepared.case.run.integrator == "auto" and isinstance(prepared.integrator, Esdirk4)
