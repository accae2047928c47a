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
    """The page of one package: what it is for, then every exported name."""
    module = import_module(name)
    head = " ".join((module.__doc__ or "").strip().partition("\n\n")[0].split())
    parts = [f"# {name}\n\n{head}\n"]
    for exported in exports(module):
        found = getattr(module, exported)
        kind = "autoclass" if isinstance(found, type) else "autofunction" if callable(found) else None
        if kind is None:
            continue
        home = f"{name}.{exported}"
        members = "   :members:\n" if kind == "autoclass" and name != "femflex" else ""
        parts.append(f"```{{eval-rst}}\n.. {kind}:: {home}\n{members}   :no-index:\n```\n")
    return "\n".join(parts)


def exports(module: Any) -> list[str]:
    """Public names of a package: its __all__, or what it defines itself."""
    names = getattr(module, "__all__", None)
    if names is None:
        names = [
            name
            for name, found in vars(module).items()
            if not name.startswith("_") and getattr(found, "__module__", None) == module.__name__
        ]
    return sorted(name for name in names if not name.startswith("_"))


def as_text(_app: object, _what: str, _name: str, _of: object, _options: object, lines: list[str]) -> None:
    """Show a docstring as it is written: its first paragraph as text, the rest in aligned columns."""
    text = "\n".join(lines).strip("\n")
    first, _, rest = text.partition("\n\n")
    out = [escaped(" ".join(first.split())), ""]
    if rest.strip():
        out += [".. code-block:: text", "", *("   " + line for line in rest.strip("\n").split("\n")), ""]
    lines[:] = out


def escaped(text: str) -> str:
    """Plain text in reStructuredText, with `code` as literals."""
    parts = re.split(r"`+([^`]*)`+", text)
    return "".join(
        re.sub(r"([\\*|_<>:])", r"\\\1", part) if k % 2 == 0 else f"\\ ``{part}``\\ " for k, part in enumerate(parts)
    )
