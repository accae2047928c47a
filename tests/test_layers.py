"""Who may import whom, read off the sources (see the design's section on layers)."""

from __future__ import annotations

import ast
from pathlib import Path

PACKAGE = Path(__file__).resolve().parents[1] / "femflex"
EVERYTHING = {path.stem for path in PACKAGE.iterdir() if path.suffix == ".py" or path.is_dir()} - {"__pycache__"}
ALLOWED = {
    "arrays": set(),
    "rotations": set(),
    "body": {"summary"},
    "summary": set(),
    "warning": set(),
    "worker_processes": set(),
    "kernels": set(),
    "noun": {"rotations"},
    "hydrodynamics": {"reading", "hdf5"},
    "effectors": {"noun", "kernels", "system", "body", "rotations", "summary", "hydrodynamics"},
    "reading": set(),
    "memory": set(),
    "writing": set(),
    "extras": set(),
    "notebook": {"results", "view", "report"},
    "hdf5": {"memory", "writing"},
    "mesh": {"reading", "memory", "writing", "hdf5"},
    "integrate": {"kernels", "summary"},
    "fem": {"noun", "mesh", "summary"},
    "decks": {"fem", "mesh", "body", "reading"},
    "matrices": {"noun", "decks", "fem", "mesh", "body", "reduction", "reading", "memory", "writing", "hdf5"},
    "reduction": {"noun", "fem", "body", "mesh", "reading", "memory", "kernels", "writing", "hdf5"},
    "system": {"noun", "body", "rotations", "summary"},
    "deployment": {"noun", "reduction", "fem", "system", "body", "mesh", "memory", "rotations"},
    "dynamics": {"effectors", "system", "body", "rotations", "kernels", "summary"},
    "linear": {"dynamics", "effectors", "system", "body", "rotations", "summary"},
    "results": {"noun", "body", "system", "rotations", "reading", "writing", "hdf5"},
    "view": {"results", "body", "kernels", "mesh", "rotations", "writing"},
    "export": EVERYTHING - {"cli", "report"},
    "report": EVERYTHING - {"cli", "__init__"},
    "studies": EVERYTHING - {"cli", "report", "export"},
    "disturbances": {"noun", "system"},
    "measures": {"noun", "system"},
    "starting": {"case", "assembly", "decks", "mesh", "fem", "reduction"},
    "case": {
        "measures",
        "noun",
        "fem",
        "reduction",
        "matrices",
        "deployment",
        "disturbances",
        "effectors",
        "system",
        "body",
        "mesh",
        "rotations",
        "summary",
    },
    "assembly": {
        "disturbances",
        "effectors",
        "noun",
        "case",
        "decks",
        "matrices",
        "deployment",
        "fem",
        "reduction",
        "system",
        "body",
        "mesh",
        "rotations",
        "reading",
    },
    "advice": {
        "reading",
        "dynamics",
        "linear",
        "deployment",
        "integrate",
        "reduction",
        "fem",
        "mesh",
        "system",
        "body",
        "rotations",
    },
    "pipeline": EVERYTHING - {"cli", "studies", "view", "export", "report"},
    "cli": EVERYTHING,
    "__init__": EVERYTHING,
    "__main__": {"cli"},
}
ALONE = {
    "meshio": {"mesh"},
    "pyvista": {"view", "export"},
    "vtkmodules": {"view", "export"},
    "skfem": {"fem"},
    "matplotlib": {"view"},
    "av": {"view", "cli"},
    "pint": {"noun"},
    "typer": {"cli"},
    "rich": {"cli"},
    "pydantic": {
        "noun",
        "fem",
        "reduction",
        "matrices",
        "deployment",
        "system",
        "effectors",
        "case",
        "disturbances",
        "measures",
    },
}
NOT_YET: dict[str, set[str]] = {}  # file -> layers that it imports and should not; entries may go, none may come
FILES = sorted(path for path in PACKAGE.rglob("*.py"))


def layer_of(path: Path) -> str:
    return path.relative_to(PACKAGE).parts[0].removesuffix(".py")


def imported_names(path: Path) -> set[str]:
    """Full names of the modules a file imports, at any depth of it."""
    names: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path} has a relative import"
            names |= {f"{node.module}.{alias.name}" for alias in node.names}
    return names


def test_every_part_of_the_package_has_a_rule():
    assert EVERYTHING == set(ALLOWED)


def test_files_import_only_what_their_layers_may():
    for path in FILES:
        check_imports(path)


def check_imports(path: Path) -> None:
    """Assert that a file imports only what its layer may."""
    layer = layer_of(path)
    allowed = ALLOWED[layer] | {layer, "arrays", "extras", "warning", "__version__"}
    excepted = NOT_YET.get(str(path.relative_to(PACKAGE)), set())
    exceptions = set()
    for name in imported_names(path):
        top, *inner = name.split(".")
        if top == "femflex" and inner and inner[0] not in allowed:
            assert inner[0] in excepted, f"{path.name} of {layer} imports {name}"
            exceptions.add(inner[0])
        if top in ALONE:
            assert layer in ALONE[top], f"{path.name} of {layer} imports {name}; only {ALONE[top]} may"
    assert exceptions == excepted, f"{path.name} no longer imports {excepted - exceptions}: take it out of NOT_YET"
