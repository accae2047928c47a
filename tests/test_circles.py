"""No module imports itself by way of others; imports inside functions count, those for types alone do not."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

PACKAGE = Path(__file__).resolve().parents[1] / "femflex"
MODULES = {
    ".".join(("femflex", *path.relative_to(PACKAGE).with_suffix("").parts)).removesuffix(".__init__"): path
    for path in sorted(PACKAGE.rglob("*.py"))
}
NOT_YET = {  # modules that are still in circles; entries may go, none may come
    *("mesh.merge", "mesh.mesh", "mesh.refine", "mesh.summary", "integrate.driver", "integrate.events"),
    *("dynamics.joints.drive_report", "dynamics.model", "dynamics.constraints.correction"),
    *("dynamics.constraints.residual", "dynamics.motion.correction", "dynamics.motion.residual"),
    *("dynamics.motion.second_order", "dynamics.terms.by_source", "dynamics.terms.without"),
    *("dynamics.terms.reduced", "dynamics.terms.reduced_constrained_correction"),
    *("dynamics.terms.reduced_constraints", "dynamics.terms.reduced_correction", "case.case", "case.crosscheck"),
    *("case.diagrams", "case.magnitudes", "case.model_inputs", "case.named_files", "case.named_markers"),
    *("case.outline", "case.read", "case.suspicion", "case.tree", "pipeline.rebuilt", "pipeline.resumed"),
}


def is_for_types(node: ast.stmt) -> bool:
    return isinstance(node, ast.If) and isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING"


def statements(tree: ast.AST) -> Iterator[ast.AST]:
    """All nodes of a tree but those that are read for types alone."""
    for child in ast.iter_child_nodes(tree):
        if not (isinstance(child, ast.stmt) and is_for_types(child)):
            yield child
            yield from statements(child)


def imported(path: Path) -> set[str]:
    """The modules of femflex that a file imports; what a package hands on counts as the package."""
    found: set[str] = set()
    for node in statements(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            inner = {f"{node.module}.{alias.name}" for alias in node.names}
            found |= {name if name in MODULES else node.module for name in inner}
    return {name for name in found if name in MODULES}


def circles(edges: dict[str, set[str]]) -> list[frozenset[str]]:
    """Sets of modules of which each reaches all others (Tarjan)."""
    index: dict[str, int] = {}
    low: dict[str, int] = {}
    stack: list[str] = []
    out: list[frozenset[str]] = []

    def visit(name: str) -> None:
        index[name] = low[name] = len(index)
        stack.append(name)
        for other in edges[name]:
            if other not in index:
                visit(other)
                low[name] = min(low[name], low[other])
            elif other in stack:
                low[name] = min(low[name], index[other])
        if low[name] == index[name]:
            at = stack.index(name)
            out.append(frozenset(stack[at:]))
            del stack[at:]

    for name in edges:
        if name not in index:
            visit(name)
    return [group for group in out if len(group) > 1 or group <= edges[next(iter(group))]]


def test_no_module_imports_itself_by_way_of_others():
    found = circles({name: imported(path) for name, path in MODULES.items()})
    known = {f"femflex.{name}" for name in NOT_YET}
    new = sorted(sorted(group) for group in found if not group <= known)
    assert not new, f"modules that import each other: {new}"


def test_every_import_names_a_module_that_is_there():
    for path in MODULES.values():
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ImportFrom) and node.module and node.module.startswith("femflex"):
                assert node.module in MODULES, f"{path.name} imports {node.module}"


def test_no_package_imports_itself_by_way_of_others():
    edges: dict[str, set[str]] = {name.split(".")[1]: set() for name in MODULES if "." in name}
    for name, path in MODULES.items():
        if name != "femflex":  # which hands on what all others hold
            layer = name.split(".")[1]
            edges[layer] |= {other.split(".")[1] for other in imported(path) if "." in other} - {layer}
    assert not circles(edges)


def test_a_circle_is_found_where_there_is_one():
    assert circles({"a": {"b"}, "b": {"c"}, "c": {"b"}, "d": {"d"}}) == [frozenset("bc"), frozenset("d")]
    assert not circles({"a": {"b", "c"}, "b": {"c"}, "c": set()})
