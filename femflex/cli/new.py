"""`femflex new`: a commented case to start from."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated

import typer

from femflex.cli.examples import TEMPLATES, cases_folder, files_of
from femflex.cli.options import Force
from femflex.cli.progress import Patience
from femflex.cli.tables import print_folded
from femflex.cli.verb import verb


@verb("femflex new my_craft.toml --deck wing.bdf --units mm-t-s")
def new(
    name: Annotated[Path, typer.Argument(help="Case file to write, such as my_craft.toml.", show_default=False)],
    mesh: Annotated[
        Path | None, typer.Option("--mesh", help="Mesh of the flexible body. Default: a boom from beam theory.")
    ] = None,
    deck: Annotated[
        Path | None, typer.Option("--deck", help="Nastran or Abaqus deck of the flexible body.", show_default=False)
    ] = None,
    units: Annotated[
        str | None, typer.Option("--units", help="Units of the deck, such as mm-t-s. Default: a guess.")
    ] = None,
    template: Annotated[
        str | None,
        typer.Option("--template", help=f"Start from a shipped case with its mesh: {', '.join(TEMPLATES)}."),
    ] = None,
    force: Force = False,
) -> None:
    """Write a commented case to start from, and the schema by which editors complete and check its keys."""
    from femflex.case.schema import schema_text
    from femflex.starting.case_text import starting_case
    from femflex.writing import atomic_file, check_destination

    target = name if name.suffix else name.with_suffix(".toml")
    if target.suffix != ".toml":
        raise ValueError(f"{target.name}: found the suffix {target.suffix!r}; a case ends in .toml")
    check_destination(target, force)
    if sum(each is not None for each in (deck, mesh, template)) > 1:
        raise ValueError("found two of --mesh, --deck and --template; give one of them")
    if units is not None and deck is None:
        raise ValueError("found --units without --deck; it is the set of units of a deck")
    if template is not None:
        copy_template(template, target, force)
        return
    mesh_data, file, facts = None, "", None
    if mesh is not None:
        from femflex.mesh import read_mesh

        mesh_data, file = read_mesh(mesh), Path(os.path.relpath(mesh, target.parent)).as_posix()
    if deck is not None:
        from femflex.starting.deck_facts import deck_facts

        with Patience(f"reading {deck.name}"):
            facts = deck_facts(deck, units, Path(os.path.relpath(deck, target.parent)).as_posix())
    schema = target.with_name("case.schema.json")
    if mesh_data is None:
        text, notes = starting_case(target.name, schema=schema.name, deck=facts)
    else:
        from femflex.starting.mesh_choice import starting_case_of_mesh

        with Patience(f"building the body of {Path(file).name}"):
            text, notes = starting_case_of_mesh(target, mesh_data, file, schema.name)
    with atomic_file(target, force) as draft:
        draft.write_text(text, encoding="utf-8")
    print(f"case        {target}")
    if not schema.exists():
        with atomic_file(schema) as draft:
            draft.write_text(schema_text(), encoding="utf-8")
        print(f"schema      {schema}, for editors")
    if facts is not None:
        size = f"{facts.mass:.4g} kg, {facts.extent:.4g} m"
        print_folded(f"deck        {facts.file}, {facts.solver}, {facts.units}: {size}")
        if facts.frequencies:
            print(f"modes       {', '.join(f'{f:.4g}' for f in facts.frequencies)} Hz")
    for note in notes:
        print_folded(f"look at     {note}")
    print(f"next        femflex check {target}")


def copy_template(word: str, target: Path, force: bool) -> None:
    """Copy the shipped case of a template to a path, and the files that it needs beside it, where there are none.

    Raises ValueError for another word, and OSError.
    """
    import shutil

    from femflex.noun.problems import suggestion_text
    from femflex.writing import atomic_file

    if word not in TEMPLATES:
        raise ValueError(f"--template: found {word!r}; {suggestion_text(word, TEMPLATES)}")
    case = cases_folder() / f"{TEMPLATES[word]}.toml"
    text, copied = case.read_text(encoding="utf-8"), []
    for source in files_of(TEMPLATES[word]):
        if source.name == case.name:
            continue
        written = Path(os.path.relpath(source, case.parent)).as_posix()
        text = text.replace(f'"{written}"', f'"{source.name}"')
        if not (copy := target.with_name(source.name)).exists():
            shutil.copyfile(source, copy)
            copied.append(copy)
    with atomic_file(target, force) as draft:
        draft.write_text(text, encoding="utf-8")
    print(f"case        {target}, from the shipped case {TEMPLATES[word]}")
    for copy in copied:
        print(f"file        {copy}")
    print(f"next        femflex run {target}")


@verb("femflex schema -o case.schema.json")
def schema(
    output: Annotated[Path | None, typer.Option("-o", "--output", help="JSON file. Default: standard output.")] = None,
    force: Force = False,
) -> None:
    """Print the JSON Schema of case files; `unit` names the SI unit of plain numbers."""
    import json

    from femflex.case.schema import json_schema
    from femflex.writing import atomic_file

    text = json.dumps(json_schema(), indent=1)
    if output is None:
        print(text)
        return
    with atomic_file(output, force) as draft:
        draft.write_text(text + "\n", encoding="utf-8")
    print(f"schema      {output}")
