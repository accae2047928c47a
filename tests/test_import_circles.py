"""No two packages of femflex import each other, nor in a longer round; deferred imports count, those for types not.

A package may import from those it stands in and from those within it.
"""

import ast
from collections import defaultdict
from pathlib import Path

PACKAGE = Path(__file__).resolve().parents[1] / "femflex"
LEFT = {  # pairs that still import each other; the list may only shrink
    ("femflex.dynamics.force_terms", "femflex.dynamics.reports"),
    ("femflex.fem.line", "femflex.fem.sections"),
}


def module_of(file):
    """Dotted name of a file."""
    parts = file.relative_to(PACKAGE.parent).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


FILES = {module_of(file): file for file in PACKAGE.rglob("*.py")}


def package_of(module):
    """The package that a module stands in."""
    return module if FILES[module].name == "__init__.py" else module.rpartition(".")[0]


def imported(file):
    """Modules of femflex that a file imports anywhere, for more than types."""
    tree = ast.parse(file.read_text())
    typing = {
        inner
        for node in ast.walk(tree)
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test)
        for branch in node.body
        for inner in ast.walk(branch)
    }
    found = set()
    for node in ast.walk(tree):
        if node in typing:
            continue
        if isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == "femflex":
            for alias in node.names:
                inside = f"{node.module}.{alias.name}"
                found.add(inside if inside in FILES else node.module)
        elif isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names if alias.name.split(".")[0] == "femflex"}
    return found & set(FILES)


def within(inner, outer):
    """Whether a package is another one or stands in it."""
    return inner == outer or inner.startswith(outer + ".")


def edges():
    """Package -> the packages that it imports from, with one module each that does."""
    out = defaultdict(dict)
    for module, file in FILES.items():
        for other in imported(file):
            a, b = package_of(module), package_of(other)
            if not (within(a, b) or within(b, a)):
                out[a].setdefault(b, f"{module} -> {other}")
    return out


def test_packages_do_not_import_each_other():
    graph = edges()
    pairs = {(a, b) for a in graph for b in graph[a] if a < b and a in graph.get(b, {})}
    told = [f"{a} and {b}: {graph[a][b]}, {graph[b][a]}" for a, b in sorted(pairs - LEFT)]
    assert not told, told
    assert pairs == LEFT, f"no longer circles, so take them off the list: {sorted(LEFT - pairs)}"


def test_there_are_no_longer_circles():
    """Packages left once those that import nothing of the rest are taken away, again and again, stand in a circle."""
    graph = {a: {b for b in graph_b if tuple(sorted((a, b))) not in LEFT} for a, graph_b in edges().items()}
    rest = set(graph) | {b for targets in graph.values() for b in targets}
    while free := {a for a in rest if not graph.get(a, set()) & rest}:
        rest -= free
    assert not rest, {a: sorted(graph[a] & rest) for a in sorted(rest)}


def test_a_circle_would_be_seen():
    """Deferred imports are found, those for types alone are not."""
    assert "femflex.dynamics.terms.ledger" in imported(FILES["femflex.dynamics.terms.by_source"])  # within a function
    assert "femflex.dynamics.model" not in imported(FILES["femflex.dynamics.terms.by_source"])  # for types
