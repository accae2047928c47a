"""The pages are generated from the program, and are built without a warning."""

from __future__ import annotations

import importlib
import json
import re
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

import femflex
from femflex.case.schema import json_schema
from femflex.cli.app import app
from femflex.measures.verdicts import verdict_on

TOP = Path(__file__).resolve().parents[2]
CHANNELS = (
    "bodies/BODY/position",
    "bodies/LINE.K/delta",
    "markers/BODY.MARKER/deflection",
    "joints/JOINT/drive",
    "joints/JOINT/rotation",
    "joints/JOINT/force",
    "loops/LOOP/torque",
    "constraints/CONSTRAINT/multipliers",
    "laws/LAW/force",
    "latches/JOINT.COORDINATE/loss",
    "loads/LOAD/force",
    "effectors/EFFECTOR/CHANNEL",
    "effectors/CONTROLLER/COMMAND",
    "sights/SIGHT/error",
    "orbit/force",
    "monitors/jacobi",
    "monitors/variation_power",
    "monitors/dissipation",
    "monitors/constraint_rank",
)


@pytest.fixture
def generated(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[str], str]:
    """Generates a page by its name; returns its text."""
    monkeypatch.syspath_prepend(str(TOP / "docs"))

    def generate(name: str) -> str:
        importlib.import_module(f"generate.{name}").write(tmp_path)
        return (tmp_path / f"{name}.md").read_text(encoding="utf-8")

    return generate


def stored(name: str) -> str:
    """A page of the reference as it is in the repository."""
    return (TOP / "docs" / "reference" / f"{name}.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("name", ["case_keys", "verbs", pytest.param("channels", marks=pytest.mark.slow)])
def test_the_stored_reference_is_that_of_the_program(name: str, generated: Callable[[str], str]):
    assert generated(name) == stored(name), "docs/reference is stale: run python docs/generate/reference.py"


def test_the_map_of_the_packages_is_that_of_the_tree(generated: Callable[[str], str]):
    guide = (TOP / "docs" / "developers.md").read_text(encoding="utf-8")
    assert generated("developers") == guide, "the map is stale: run python docs/generate/developers.py"


def test_every_table_of_a_case_has_an_example():
    sections = re.split(r"^#+ (.*)$", stored("case_keys"), flags=re.MULTILINE)[1:]
    without = [name for name, text in zip(sections[::2], sections[1::2], strict=True) if "```toml" not in text]
    tables = [name for name in without if "| key |" in dict(zip(sections[::2], sections[1::2], strict=True))[name]]
    assert tables == ["Top of the file"]


def test_the_reference_has_every_key_of_a_case():
    page = stored("case_keys")
    schema = json_schema()
    for name, table in {"case": schema, **schema["$defs"]}.items():
        for key, about in table.get("properties", {}).items():
            if name == "case" and f"[{key}" in page:
                continue
            assert f"| `{key}` |" in page, f"{name}.{key}"
            beginning = " ".join(about.get("description", "").split())[:30].split("|")[0].split("<")[0].split("*")[0]
            assert beginning in page, f"{name}.{key}: {beginning}"


def test_the_reference_has_every_verb():
    page = stored("verbs")
    names = [command.callback.__name__ for command in app.registered_commands if command.callback]
    assert len(names) >= 12
    for name in names:
        assert f"\n## {name}\n" in page


def test_the_reference_has_every_kind_of_channel_and_term():
    page = stored("channels")
    assert not [path for path in CHANNELS if f"| `{path}` |" not in page]
    assert all(f"`{term}`" in page for term in ("inertia", "elastic", "gravity_gradient", "loads/LOAD", "loops/LOOP"))


@pytest.mark.slow
@pytest.mark.parametrize("name", ["unfolding_array", "gimbal_antenna"])
@pytest.mark.filterwarnings("ignore::femflex.warning.PhysicsWarning")
def test_every_channel_of_a_shipped_case_is_in_the_reference(name: str):
    templates = re.findall(r"^\| `([^`]+)` \|", stored("channels"), re.MULTILINE)
    documented = re.compile("|".join(re.sub(r"[A-Z]{3,}", "[^/]+", re.escape(template)) for template in templates))
    model = femflex.compile_system(femflex.build_system(femflex.read_case(TOP / "cases" / f"{name}.toml")))
    assert not [path for path in model.channels if not documented.fullmatch(path)]


def test_the_validation_has_every_subject(generated: Callable[[str], str]):
    page = generated("validation")
    assert all(f"\n## {title}\n" in page for title in ("Finite elements", "Tethers and membranes", "Snap through"))
    assert "Multibody systems and mechanisms" in page and page.count("\n| ") > 150


BENCHMARKS = tomllib.loads((TOP / "docs" / "benchmarks.toml").read_text(encoding="utf-8"))
FAST = ("orbiter_pitch30",)


@pytest.fixture
def benchmarks(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    monkeypatch.syspath_prepend(TOP / "docs")
    return importlib.import_module("generate.benchmarks")


def test_the_stored_benchmarks_are_those_of_the_cases(benchmarks: ModuleType):
    folder = TOP / "docs" / "benchmarks"
    stored_pages = {path.name: path.read_text(encoding="utf-8") for path in folder.glob("*.md")}
    del stored_pages["calculix.md"]
    assert stored_pages == benchmarks.pages(), "docs/benchmarks is stale: run python docs/generate/benchmarks.py"
    numbers = json.loads((folder / "numbers.json").read_text(encoding="utf-8"))
    for name, entry in BENCHMARKS.items():
        assert all((TOP / path).exists() for path in entry["tests"])
        answers = benchmarks.case_of(name).expect.answers
        assert all(verdict_on(key, answers[key], *pair).holds for key, pair in numbers[name]["answers"].items()), name


@pytest.mark.parametrize("name", [pytest.param(n, marks=[] if n in FAST else pytest.mark.slow) for n in BENCHMARKS])
@pytest.mark.filterwarnings("ignore::femflex.warning.PhysicsWarning")
def test_a_benchmark_gives_the_stored_numbers(name: str, benchmarks: ModuleType):
    stored_numbers = json.loads((TOP / "docs" / "benchmarks" / "numbers.json").read_text(encoding="utf-8"))[name]
    assert np.array(benchmarks.numbers_of(name)["levels"]) == pytest.approx(
        np.array(stored_numbers["levels"]), rel=1e-5
    )


@pytest.mark.skipif(shutil.which("ccx") is None, reason="ccx (CalculiX) is not installed")
@pytest.mark.filterwarnings("ignore::femflex.warning.PhysicsWarning")
def test_a_deck_of_bricks_has_the_frequencies_of_calculix(benchmarks: ModuleType):
    calculix = importlib.import_module("generate.calculix")
    source = calculix.bracket(1)
    by_femflex = calculix.femflex_frequencies(source)
    assert by_femflex == pytest.approx(calculix.calculix_frequencies(source), rel=1e-6)
    page = (TOP / "docs" / "benchmarks" / "calculix.md").read_text(encoding="utf-8")
    assert " | ".join(f"{frequency:.5g}" for frequency in by_femflex) in page


def test_the_gallery_is_that_of_the_cases(generated: Callable[[str], str]):
    page = generated("gallery")
    for path in (TOP / "cases").glob("*.toml"):
        assert f"## {path.stem}\n" in page
    stored_page = (TOP / "docs" / "gallery.md").read_text(encoding="utf-8")
    assert page == stored_page, "docs/gallery.md is older than the cases: run python docs/generate/pictures.py"


@pytest.mark.slow
def test_the_pages_are_built_without_a_warning(tmp_path: Path):
    pytest.importorskip("sphinx", reason='needs pip install ".[docs]"')
    words = [sys.executable, "-m", "sphinx", "-E", "-W", "--keep-going", "-b", "html", "docs", str(tmp_path)]
    done = subprocess.run(words, cwd=TOP, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "reference" / "case_keys.html").stat().st_size > 100_000


@pytest.mark.slow
def test_pictures_of_the_gallery_are_made(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.syspath_prepend(str(TOP / "docs"))
    pictures = importlib.import_module("generate.pictures")
    monkeypatch.setattr(pictures, "PICTURES", tmp_path)
    pictures.draw_case(TOP / "cases" / "chaplygin_sleigh.toml")
    assert len(pictures.case_pictures("chaplygin_sleigh")) >= 3
    assert max(path.stat().st_size for path in pictures.case_pictures("chaplygin_sleigh")) < 60_000


def test_the_citation_names_the_version_and_the_licence():
    """Lines, not YAML: no reader of YAML is installed for the tests alone."""
    lines = (TOP / "docs" / "CITATION.cff").read_text(encoding="utf-8").splitlines()
    assert f"version: {femflex.__version__}" in lines and "license: BSD-3-Clause" in lines
    assert any("Modi" in line for line in lines)


FORGE = {"matplotlib": "matplotlib-base"}  # names on conda-forge that differ from those on PyPI


def test_the_recipe_has_the_version_and_the_requirements_of_the_package():
    project = tomllib.loads((TOP / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    recipe = (TOP / "docs" / "packaging" / "meta.yaml").read_text(encoding="utf-8")
    assert f'version = "{femflex.__version__}"' in recipe and project["version"] == femflex.__version__
    core, view = (part.split("    test:\n")[0] for part in recipe.split("      run:\n")[1:])
    for part, listed in ((core, project["dependencies"]), (view, project["optional-dependencies"]["view"])):
        wanted = {re.sub(r"^[\w-]+", lambda match: FORGE.get(match[0], match[0]), name) for name in listed}
        found = re.findall(r"^        - ([\w-]+) (\S+)$", part, re.MULTILINE)
        assert {"".join(pair) for pair in found if pair[0] != "python"} == wanted
