"""No module and no package imports itself by way of others; imports inside functions count, those for types do not.

A package may import from the packages that contain it and from those inside it.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from functools import cache
from pathlib import Path

PACKAGE = Path(__file__).resolve().parents[1] / "femflex"
MODULES = {
    ".".join(("femflex", *path.relative_to(PACKAGE).with_suffix("").parts)).removesuffix(".__init__"): path
    for path in sorted(PACKAGE.rglob("*.py"))
}


def is_for_types(node: ast.AST) -> bool:
    return isinstance(node, ast.If) and isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING"


def statements(tree: ast.AST) -> Iterator[ast.AST]:
    """All statements of a tree but those that are read for types alone."""
    todo = [tree]
    while todo:
        for child in ast.iter_child_nodes(todo.pop()):
            if isinstance(child, ast.stmt | ast.ExceptHandler | ast.match_case) and not is_for_types(child):
                yield child
                todo.append(child)


@cache
def named_imports(name: str) -> frozenset[str]:
    """Names of femflex that a module imports; a name that a package re-exports counts as the package."""
    names: set[str] = set()
    for node in statements(ast.parse(MODULES[name].read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            inner = {f"{node.module}.{alias.name}" for alias in node.names}
            names |= {full if full in MODULES else node.module for full in inner}
    return frozenset(full for full in names if full.partition(".")[0] == "femflex")


def imported(name: str) -> set[str]:
    """The modules of femflex that a module imports."""
    return {full for full in named_imports(name) if full in MODULES}


def package_of(name: str) -> str:
    """The package that contains a module."""
    return name if MODULES[name].name == "__init__.py" else name.rpartition(".")[0]


def is_inside(inner: str, outer: str) -> bool:
    """Whether the packages are the same, or the outer one contains the inner one."""
    return inner == outer or inner.startswith(outer + ".")


def package_imports() -> dict[str, dict[str, str]]:
    """Package -> the packages outside it that it imports from, with one pair of modules each."""
    out: dict[str, dict[str, str]] = {}
    for name in MODULES:
        for other in imported(name):
            a, b = package_of(name), package_of(other)
            if not (is_inside(a, b) or is_inside(b, a)):
                out.setdefault(a, {}).setdefault(b, f"{name} -> {other}")
    return out


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
            first = stack.index(name)
            out.append(frozenset(stack[first:]))
            del stack[first:]

    for name in edges:
        if name not in index:
            visit(name)
    return [group for group in out if len(group) > 1 or group <= edges[next(iter(group))]]


def test_modules_have_no_import_cycle():
    assert not circles({name: imported(name) for name in MODULES})


def test_every_import_names_an_existing_module():
    for name in MODULES:
        unknown = {full for full in named_imports(name) if full not in MODULES}
        assert not unknown, f"{name} imports {sorted(unknown)}"


def test_layers_have_no_import_cycle():
    edges: dict[str, set[str]] = {name.split(".")[1]: set() for name in MODULES if "." in name}
    for name in MODULES:
        if name != "femflex":  # which re-exports names of all others
            layer = name.split(".")[1]
            edges[layer] |= {other.split(".")[1] for other in imported(name) if "." in other} - {layer}
    assert not circles(edges)


def test_packages_do_not_import_each_other():
    graph = package_imports()
    pairs = sorted((a, b) for a in graph for b in graph[a] if a < b and a in graph.get(b, {}))
    assert not pairs, [f"{a} and {b}: {graph[a][b]}, {graph[b][a]}" for a, b in pairs]


def test_packages_have_no_longer_import_cycle():
    graph = package_imports()
    edges = {a: set(targets) for a, targets in graph.items()}
    for targets in graph.values():
        for b in targets:
            edges.setdefault(b, set())
    assert not circles(edges)


def test_deferred_imports_count_and_type_imports_do_not():
    assert "femflex.dynamics.ledger.ledger" in imported("femflex.dynamics.ledger.by_source")  # within a function
    assert "femflex.dynamics.model" not in imported("femflex.dynamics.ledger.by_source")  # for types


def test_import_cycle_is_detected():
    assert circles({"a": {"b"}, "b": {"c"}, "c": {"b"}, "d": {"d"}}) == [frozenset("bc"), frozenset("d")]
    assert not circles({"a": {"b", "c"}, "b": {"c"}, "c": set()})
