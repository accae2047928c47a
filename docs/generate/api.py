"""Pages of the Python API: one per package, from the names that it exports."""

from __future__ import annotations

import re
from importlib import import_module
from pathlib import Path
from typing import Any

from generate.markdown import save

HEAD = """# Python API

Names that femflex exports, by package. Docstrings state shapes and units.
Start with [the how-to page](../howto/api.md).

```{toctree}
:maxdepth: 1

"""
PACKAGES = (
    "femflex",
    "femflex.mesh",
    "femflex.fem",
    "femflex.fem.sections",
    "femflex.reduction",
    "femflex.matrices",
    "femflex.body",
    "femflex.system",
    "femflex.dynamics",
    "femflex.integrate",
    "femflex.results",
    "femflex.case",
    "femflex.pipeline",
    "femflex.studies",
    "femflex.studies.campbell",
    "femflex.studies.linear",
    "femflex.studies.stability",
    "femflex.studies.sweep",
    "femflex.view",
    "femflex.rotations",
)


def write(target: Path) -> None:
    """Write the page api.md and one page for each package."""
    save(target / "api.md", HEAD + "\n".join(f"api/{name}" for name in PACKAGES) + "\n```\n")
    for name in PACKAGES:
        save(target / "api" / f"{name}.md", page(name))


def page(name: str) -> str:
    """The page of one package: its purpose, then every exported name."""
    module = import_module(name)
    head = " ".join((module.__doc__ or "").strip().partition("\n\n")[0].split())
    sections = [f"# {name}\n\n{head}\n"]
    for exported in exports(module):
        item = getattr(module, exported)
        kind = "autoclass" if isinstance(item, type) else "autofunction" if callable(item) else None
        if kind is None:
            continue
        home = f"{name}.{exported}"
        members = "   :members:\n" if kind == "autoclass" and name != "femflex" else ""
        sections.append(f"```{{eval-rst}}\n.. {kind}:: {home}\n{members}   :no-index:\n```\n")
    return "\n".join(sections)


def exports(module: Any) -> list[str]:
    """Public names of a package: its __all__, or the names that it defines itself."""
    names = getattr(module, "__all__", None)
    if names is None:
        names = [
            name
            for name, item in vars(module).items()
            if not name.startswith("_") and getattr(item, "__module__", None) == module.__name__
        ]
    return sorted(name for name in names if not name.startswith("_"))


def as_text(_app: object, _what: str, _name: str, _of: object, _options: object, lines: list[str]) -> None:
    """Show a docstring as it is written: its first paragraph as text, the rest in aligned columns."""
    text = "\n".join(lines).strip("\n")
    summary, _, details = text.partition("\n\n")
    shown_lines = [escaped(" ".join(summary.split())), ""]
    if details.strip():
        shown_lines += [".. code-block:: text", "", *("   " + line for line in details.strip("\n").split("\n")), ""]
    lines[:] = shown_lines


def escaped(text: str) -> str:
    """Plain text in reStructuredText, with `code` as literals."""
    pieces = re.split(r"`+([^`]*)`+", text)
    return "".join(
        re.sub(r"([\\*|_<>:])", r"\\\1", piece) if k % 2 == 0 else f"\\ ``{piece}``\\ "
        for k, piece in enumerate(pieces)
    )
