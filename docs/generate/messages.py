"""Errors and warnings on one page, by the part of the work in which they occur, read from the sources."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

from generate.markdown import cell, save, table

PACKAGE = Path(__file__).resolve().parents[2] / "femflex"
TEMPLATE = re.compile(r"\{([A-Za-z]\w*)(?:[:!.\[][^{}\s]*)?\}")  # a value of str.format, with its format
WORDS = 4  # shorter texts are names and units
WARNINGS = {"PhysicsWarning", "warn", "doubt", "note"}
SUBJECTS = {  # package -> what a reader was doing
    "case": "The case file",
    "assembly": "From the case to bodies and joints",
    "mesh": "Meshes",
    "decks": "Nastran and Abaqus decks",
    "matrices": "Matrices of other programs",
    "fem": "Members, sections and materials",
    "reduction": "Modes and reduction",
    "body": "Bodies",
    "deployment": "Deploying members",
    "system": "Joints, loads and effectors",
    "dynamics": "Equations of motion and equilibria",
    "integrate": "Integration",
    "advice": "Advice on strain, buckling and truncation",
    "pipeline": "Runs",
    "results": "Result files",
    "view": "Pictures",
    "studies": "Studies",
    "cli": "The command line",
}

HEAD = """# Messages

Errors and warnings of femflex, by what you were doing. A word in ‹angle quotes› stands for a name or number of your
input. Search this page for a part of a message that you met. An error states what was found, what is allowed, and what
to change; the exit code is then 2, or 3 where the numerics failed. A warning names the body or joint, the computed
value, the limit and the remedy; the run goes on. This page is generated from the program.

"""


def write(target: Path) -> None:
    """Write the page messages.md."""
    sections = []
    for package, title in SUBJECTS.items():
        pairs = {pair for path in (PACKAGE / package).rglob("*.py") for pair in messages(path)}
        rows = [[kind, cell(text)] for kind, text in sorted(pairs, key=lambda pair: (pair[0], pair[1].lower()))]
        sections.append(f"## {title}\n\n" + table(["kind", "message"], rows))
    save(target / "messages.md", HEAD + "\n".join(sections))


def messages(path: Path) -> Iterator[tuple[str, str]]:
    """Kind and text of the messages that a source file raises, lists as a problem, or warns of."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Raise) and isinstance(node.exc, ast.Call):
            yield from (("error", text) for text in texts(node.exc))
        elif isinstance(node, ast.Call):
            name = getattr(node.func, "id", getattr(node.func, "attr", ""))
            kind = "warning" if name in WARNINGS else "error" if name == "Problem" or name.endswith("Error") else ""
            yield from ((kind, text) for text in texts(node) if kind)


def texts(call: ast.Call) -> Iterator[str]:
    """The sentences among the arguments of a call."""
    for node in (*call.args, *(keyword.value for keyword in call.keywords)):
        text = expression_text(node)
        if len(text.split()) >= WORDS:
            yield text


def expression_text(node: ast.expr) -> str:
    """The text of an expression, with the names of values in place of them."""
    if isinstance(node, ast.Constant):
        return TEMPLATE.sub(r"‹\1›", node.value) if isinstance(node.value, str) else ""
    if isinstance(node, ast.JoinedStr):
        return "".join(
            expression_text(value) if isinstance(value, ast.Constant) else placeholder(value) for value in node.values
        )
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add):
        return expression_text(node.left) + expression_text(node.right)
    return ""


def placeholder(node: ast.expr) -> str:
    """The name of a value in angle quotes."""
    inner = node.value if isinstance(node, ast.FormattedValue) else node
    while isinstance(inner, ast.Call) and inner.args:
        inner = inner.args[0]
    if isinstance(inner, ast.Subscript):
        inner = inner.value
    name = getattr(inner, "id", getattr(inner, "attr", ""))
    return f"‹{name.strip('_').replace('_', ' ') or 'value'}›"
