"""No module, and no package, imports itself by way of others; imports inside functions count, those for types do not.

A package may import from those it stands in and from those within it.
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
    left = [tree]
    while left:
        for child in ast.iter_child_nodes(left.pop()):
            if isinstance(child, ast.stmt | ast.ExceptHandler | ast.match_case) and not is_for_types(child):
                yield child
                left.append(child)


@cache
def named_imports(name: str) -> frozenset[str]:
    """Names of femflex that a module imports; what a package hands on counts as the package."""
    found: set[str] = set()
    for node in statements(ast.parse(MODULES[name].read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            inner = {f"{node.module}.{alias.name}" for alias in node.names}
            found |= {full if full in MODULES else node.module for full in inner}
    return frozenset(full for full in found if full.partition(".")[0] == "femflex")


def imported(name: str) -> set[str]:
    """The modules of femflex that a module imports."""
    return {full for full in named_imports(name) if full in MODULES}


def package_of(name: str) -> str:
    """The package that a module stands in."""
    return name if MODULES[name].name == "__init__.py" else name.rpartition(".")[0]


def is_within(inner: str, outer: str) -> bool:
    """Return whether a package is another one or a part of it."""
    return inner == outer or inner.startswith(outer + ".")


def package_imports() -> dict[str, dict[str, str]]:
    """Package -> the packages outside it that it imports from, with one pair of modules each."""
    out: dict[str, dict[str, str]] = {}
    for name in MODULES:
        for other in imported(name):
            a, b = package_of(name), package_of(other)
            if not (is_within(a, b) or is_within(b, a)):
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
            at = stack.index(name)
            out.append(frozenset(stack[at:]))
            del stack[at:]

    for name in edges:
        if name not in index:
            visit(name)
    return [group for group in out if len(group) > 1 or group <= edges[next(iter(group))]]


def test_modules_have_no_import_cycle():
    assert not circles({name: imported(name) for name in MODULES})


def test_imported_modules_exist():
    for name in MODULES:
        unknown = {full for full in named_imports(name) if full not in MODULES}
        assert not unknown, f"{name} imports {sorted(unknown)}"


def test_layers_have_no_import_cycle():
    edges: dict[str, set[str]] = {name.split(".")[1]: set() for name in MODULES if "." in name}
    for name in MODULES:
        if name != "femflex":  # which hands on what all others hold
            layer = name.split(".")[1]
            edges[layer] |= {other.split(".")[1] for other in imported(name) if "." in other} - {layer}
    assert not circles(edges)


def test_packages_do_not_import_each_other():
    graph = package_imports()
    pairs = sorted((a, b) for a in graph for b in graph[a] if a < b and a in graph.get(b, {}))
    assert not pairs, [f"{a} and {b}: {graph[a][b]}, {graph[b][a]}" for a, b in pairs]


def test_package_imports_have_no_long_cycle():
    graph = package_imports()
    edges = {a: set(targets) for a, targets in graph.items()}
    for targets in graph.values():
        for b in targets:
            edges.setdefault(b, set())
    assert not circles(edges)


def test_deferred_imports_are_found_and_those_for_types_are_not():
    assert "femflex.dynamics.terms.ledger" in imported("femflex.dynamics.terms.by_source")  # within a function
    assert "femflex.dynamics.model" not in imported("femflex.dynamics.terms.by_source")  # for types


def test_cycle_is_found():
    assert circles({"a": {"b"}, "b": {"c"}, "c": {"b"}, "d": {"d"}}) == [frozenset("bc"), frozenset("d")]
    assert not circles({"a": {"b", "c"}, "b": {"c"}, "c": set()})
