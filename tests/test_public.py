"""What `import femflex` gives: every name exists and is documented, and nothing heavy is loaded."""

from __future__ import annotations

import importlib
import inspect
import subprocess
import sys

import pytest

import femflex

HEAVY = (
    "numpy",
    "scipy",
    "numba",
    "pyvista",
    "vtkmodules",
    "matplotlib",
    "h5py",
    "pydantic",
    "pint",
    "meshio",
    "skfem",
    "rich",
)


def loaded_after(code: str) -> set[str]:
    """Names of modules loaded in a fresh interpreter after running the code."""
    process = subprocess.run(
        [sys.executable, "-c", f"{code}\nimport sys; print(*sys.modules)"], capture_output=True, text=True, check=True
    )
    return {name.split(".")[0] for name in process.stdout.splitlines()[-1].split()}


@pytest.mark.parametrize("name", femflex.__all__)
def test_public_name_exists_and_is_documented(name: str):
    item = getattr(femflex, name)
    assert name == "__version__" or len(inspect.getdoc(item) or "") > 20
    assert name in dir(femflex)


@pytest.mark.parametrize("package", "effectors fem mesh reduction results studies system view".split())
def test_completion_in_a_package_offers_its_public_names(package: str):
    module = importlib.import_module(f"femflex.{package}")
    assert set(dir(module)) == set(module.__all__) and all(hasattr(module, name) for name in module.__all__)


def test_importing_femflex_loads_nothing_heavy():
    assert not loaded_after("import femflex") & set(HEAVY)


def test_importing_the_command_line_loads_nothing_heavy():
    heavy = set(HEAVY) - {"rich"}  # typer's own help uses it
    assert not loaded_after("import femflex.cli.app") & heavy


def test_reading_a_case_loads_no_renderer():
    assert not loaded_after("from femflex.case import read_case") & {"pyvista", "vtkmodules", "matplotlib", "h5py"}
