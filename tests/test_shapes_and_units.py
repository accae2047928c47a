"""Docstrings of public functions that take or return arrays state shapes and units."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

PACKAGE = Path(__file__).resolve().parents[1] / "femflex"
# Kernel packages have tables of shapes and units of their own.
KERNELS = {"kernels", "effectors", "dynamics", "system", "body", "integrate", "rotations.py", "summary.py"}
ARRAY = re.compile(r"\b(Array|ArrayLike|NDArray|Single|Index|csr_array|spmatrix)\b")
SHAPE = re.compile(
    r"\((\d|n|k\b|p\b|q\b|t\b|e\b|m\b|\.\.\.|count|members|runs)[^()]*|\(\)|\d x \d|shapes? ", re.IGNORECASE
)
UNIT = re.compile(
    r"\[[^\]]*\]|\bunits?\b|\bSI\b|\bm\b|\brad\b|\bnumbers?\b|\bratio\b|\bind(ex|ices)\b|\brows\b|rotation|Euler|"
    r"cosines|\bwhich of\b",
    re.IGNORECASE,
)
LEAST = 0.97


def array_functions(path: Path) -> Iterator[str]:
    """Docstrings of the public functions of a file with arrays in their signature; a protocol's are its class's."""

    def visit(body: list[ast.stmt], of_class: str) -> Iterator[str]:
        for node in body:
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                yield from visit(node.body, ast.get_docstring(node) or "")
            elif isinstance(node, ast.FunctionDef) and not node.name.startswith("_"):
                given = [a.annotation for a in (*node.args.args, *node.args.kwonlyargs)]
                if any(ARRAY.search(ast.unparse(one)) for one in (*given, node.returns) if one is not None):
                    yield ast.get_docstring(node) or of_class

    yield from visit(ast.parse(path.read_text(encoding="utf-8")).body, "")


def test_public_array_functions_state_shapes_and_units():
    paths = [path for path in sorted(PACKAGE.rglob("*.py")) if path.relative_to(PACKAGE).parts[0] not in KERNELS]
    texts = [text for path in paths for text in array_functions(path)]
    assert len(texts) > 500
    for pattern in (SHAPE, UNIT):
        assert sum(bool(pattern.search(text)) for text in texts) > LEAST * len(texts), pattern.pattern
