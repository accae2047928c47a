"""Reference of every verb of the command line, from the same declarations as `--help`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import typer

from femflex.cli.app import app
from generate.markdown import cell, code, save, table

HEAD = """# Verbs of the command line

Every verb explains itself with `--help`. Exit codes: 0 done; 2 bad input (one sentence per problem, nothing written);
3 the numerics failed (what was computed is kept); 130 interrupted (likewise). Set `FEMFLEX_TRACEBACK=1` to see where an
error came from. `python docs/generate/reference.py` writes this page from the program.

"""


def write(target: Path) -> None:
    """Write the page verbs.md."""
    group: Any = typer.main.get_command(app)
    save(target / "verbs.md", HEAD + "\n".join(verb_section(name, command) for name, command in group.commands.items()))


def verb_section(name: str, command: Any) -> str:
    """One verb: its purpose, its usage, its arguments and options."""
    usage = " ".join(
        ["[OPTIONS]", *(_argument_usage(entry) for entry in command.params if entry.param_type_name == "argument")]
    )
    text = f"## {name}\n\n" + "\n\n".join(cell(paragraph) for paragraph in (command.help or "").split("\n\n"))
    text += f"\n\n```text\nfemflex {name} {usage}\n```\n\n"
    rows = [_parameter_row(parameter) for parameter in command.params if not getattr(parameter, "hidden", False)]
    return text + table(("argument or option", "default", "meaning"), rows) + f"\n{cell(command.epilog or '')}\n"


def _argument_usage(parameter: Any) -> str:
    label = (parameter.metavar or parameter.name or "").strip("[]{}").upper()
    return label if parameter.required else f"[{label}]..."


def _parameter_row(parameter: Any) -> list[str]:
    names = parameter.opts if parameter.param_type_name == "option" else [parameter.name or ""]
    default = parameter.default
    default_text = (
        "required" if parameter.required else code(str(default)) if default not in (None, False, (), []) else "–"
    )
    if callable(default):
        default_text = "–"
    return [", ".join(code(name) for name in names), default_text, cell(getattr(parameter, "help", None) or "")]
