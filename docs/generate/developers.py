"""Write the map of the developers' guide: what each package and folder holds, and what it imports, read off the tree.

Run it from the top of a clone after a change of a package:  python docs/generate/developers.py
"""

from __future__ import annotations

import ast
import re
import sys
from pathlib import Path

DOCS = Path(__file__).resolve().parents[1]
PACKAGE = DOCS.parent / "femflex"
GUIDE = "developers.md"
START, END = "<!-- map: written by docs/generate/developers.py -->", "<!-- end of the map -->"
EVERYWHERE = {"arrays", "warning", "extras"}  # which every package may import
MOST = 8  # maximum number of packages that are named in a row


def write(target: Path) -> None:
    """Write the developers' guide, with its map made anew, into a folder."""
    from generate.markdown import code, save, table

    before, _, rest = (DOCS / GUIDE).read_text(encoding="utf-8").partition(START)
    lines = table(["package", "holds", "imports"], [[code(name), *cells] for name, *cells in rows()])
    save(target / GUIDE, f"{before}{START}\n\n{lines}\n{END}{rest.partition(END)[2]}")


def rows() -> list[tuple[str, str, str]]:
    """Name, content and imports of each package, of the folders in it, and of each single module."""
    found = []
    for path in sorted(PACKAGE.iterdir()):
        if (path / "__init__.py").exists():
            found.append((path.name, content(path / "__init__.py"), imports(path)))
            folders = sorted(file.parent for file in path.glob("*/__init__.py"))
            found += [(f"{path.name}/{folder.name}", content(folder / "__init__.py"), "") for folder in folders]
        elif path.suffix == ".py" and not path.name.startswith("__"):
            found.append((path.stem, content(path), imports(path)))
    return found


def content(file: Path) -> str:
    """The first sentence of a file's docstring, as one cell of a table."""
    from generate.markdown import cell

    text = " ".join((ast.get_docstring(ast.parse(_text(file))) or "").split())
    return cell(re.split(r"(?<=\.) (?=[A-Z])", text)[0].rstrip("."))


def imports(path: Path) -> str:
    """The other packages that a package or module imports, at any depth, as a text."""
    files = [path] if path.is_file() else sorted(path.rglob("*.py"))
    found = set(re.findall(r"^\s*(?:from|import) femflex\.(\w+)", "\n".join(map(_text, files)), re.MULTILINE))
    found -= {path.stem, *EVERYWHERE}
    return ", ".join(sorted(found)) if len(found) <= MOST else f"{len(found)} others"


def _text(path: Path) -> str:
    return path.read_text(encoding="utf-8")


if __name__ == "__main__":
    sys.path.insert(0, str(DOCS))
    write(DOCS)
