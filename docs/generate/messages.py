"""Every text that a user can meet, on one page: errors, warnings and reports, read off the sources."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

from generate.markdown import cell, save, table

PACKAGE = Path(__file__).resolve().parents[2] / "femflex"
WORDS = 4  # shorter texts are names and units

HEAD = """# Messages

Errors, warnings, reports and help texts of femflex, by the module that writes them. A word in ‹angle quotes› stands for
a value. Search this page for a part of a message that you met. An error says what was found, what is allowed, and what
to change. A warning of the physics says which body or joint, the computed value, the limit, and the remedy. This page
is generated from the program.

"""


def write(target: Path) -> None:
    """Write the page messages.md."""
    parts = []
    for path in sorted(PACKAGE.rglob("*.py")):
        if rows := sorted(set(texts(path))):
            name = path.relative_to(PACKAGE.parent).as_posix()
            parts.append(f"## {name}\n\n" + table(["line", "text"], [[str(line), cell(text)] for line, text in rows]))
    save(target / "messages.md", HEAD + "\n".join(parts))


def texts(path: Path) -> Iterator[tuple[int, str]]:
    """Line and text of texts of a source file with at least WORDS words, without docstrings and patterns of `re`."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    nodes = list(ast.walk(tree))
    inner = {id(part) for node in nodes if isinstance(node, ast.JoinedStr) for part in ast.walk(node)}
    inner -= {id(node) for node in nodes if isinstance(node, ast.JoinedStr)}
    docs = {id(node.value) for node in nodes if isinstance(node, ast.Expr)}
    docs |= {id(node) for call in nodes if _of_re(call) for node in ast.walk(call)}
    for node in nodes:
        if isinstance(node, (ast.Constant, ast.JoinedStr)) and id(node) not in docs:
            text = _text(node)
            if text and len(text.split()) >= WORDS and (isinstance(node, ast.JoinedStr) or id(node) not in inner):
                yield node.lineno, text


def _of_re(node: ast.AST) -> bool:
    """Whether a node is a call such as re.compile(...)."""
    if not (isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute)):
        return False
    return isinstance(node.func.value, ast.Name) and node.func.value.id == "re"


def _text(node: ast.Constant | ast.JoinedStr) -> str:
    if isinstance(node, ast.Constant):
        return node.value if isinstance(node.value, str) else ""
    parts = (str(v.value) if isinstance(v, ast.Constant) else f"‹{ast.unparse(v)[1:-1]}›" for v in node.values)
    return "".join(parts)
