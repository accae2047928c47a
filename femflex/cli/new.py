"""`femflex new`, `examples` and `schema`: a commented case to start from, and the cases that come with femflex."""

from __future__ import annotations

import os
import shutil
import tomllib
from collections.abc import Iterator
from importlib.metadata import files
from pathlib import Path
from typing import Annotated

import typer

from femflex.cli.options import Force
from femflex.cli.progress import Patience
from femflex.cli.tables import print_folded, print_table
from femflex.cli.verb import verb

SCHEMA = "case.schema.json"
TEMPLATES = {  # word of `femflex new --template` -> shipped case
    "panels": "panel_slew",
    "boom": "orbiter_beam",
    "deployment": "orbiter_deployment_free",
    "tether": "tethered_satellite",
    "sail": "sail_trim",
    "deck": "deck_mast",
}


def cases_folder() -> Path:
    """The folder of the shipped cases: of the checkout that is installed, or of the installed package.

    Raises FileNotFoundError where it is not there.
    """
    import femflex

    checkout = Path(femflex.__file__).parents[1] / "cases"
    if (checkout / SCHEMA).is_file():
        return checkout
    installed = (Path(str(file.locate())) for file in files("femflex") or () if file.name == SCHEMA)
    for schema in installed:
        if schema.is_file():
            return schema.resolve().parent
    raise FileNotFoundError(f"the shipped cases are neither in {checkout} nor installed; install femflex anew")


def shipped_cases() -> dict[str, str]:
    """Name -> title of every shipped case."""
    return {
        path.stem: str(tomllib.loads(path.read_text(encoding="utf-8")).get("title", ""))
        for path in sorted(cases_folder().glob("*.toml"))
    }


def files_of(name: str) -> Iterator[Path]:
    """A shipped case, the schema that it names, and the files that it refers to, absolute. Raises KeyError."""
    from femflex.case import read_case
    from femflex.case.named_files import input_files

    folder = cases_folder()
    if not (folder / f"{name}.toml").is_file():
        from femflex.noun.problems import suggestion_text

        raise KeyError(f"there is no shipped case {name!r}; {suggestion_text(name, shipped_cases())}")
    yield folder / SCHEMA
    yield from input_files(read_case(folder / f"{name}.toml"))


def copy_cases(names: list[str], target: Path) -> list[Path]:
    """Copy shipped cases with all that they need into target/cases and target/meshes. Returns the cases' paths.

    Files that are there stay as they are. Raises KeyError for a name that is not known, and OSError.
    """
    root = cases_folder().parent
    sources = dict.fromkeys(path.resolve() for name in names for path in files_of(name))
    for source in sources:
        copy = target / source.relative_to(root.resolve())
        if not copy.exists():
            copy.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(source, copy)
    return [target / "cases" / f"{name}.toml" for name in names]


@verb("femflex examples panel_slew -o my_cases")
def examples(
    names: Annotated[
        list[str] | None, typer.Argument(help="Names of cases. Default: all of them.", show_default=False)
    ] = None,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="Folder to copy cases and meshes to. Default: list them.")
    ] = None,
) -> None:
    """List the cases that come with femflex, or copy them with their meshes. Files that are there stay as they are."""

    titles = shipped_cases()
    chosen = list(dict.fromkeys(names or titles))
    for name in chosen:
        next(files_of(name))  # one that is not known is reported before anything is copied
    if output is None:
        print_table(["case", "title"], [(name, titles[name]) for name in chosen])
        print_folded(
            "next        femflex examples NAME -o FOLDER copies a case with its mesh; without names, all of them"
        )
        return
    copies = copy_cases(chosen, output)
    print(f"copied      {len(copies)} case{'s' * (len(copies) != 1)} to {output}")
    print(f"next        femflex run {copies[0]}")


@verb("femflex new my_craft.toml --deck wing.bdf --units mm-t-s")
def new(
    name: Annotated[Path, typer.Argument(help="Case file to write, such as my_craft.toml.", show_default=False)],
    mesh: Annotated[
        Path | None, typer.Option(help="Mesh of the flexible body. Default: a boom from beam theory.")
    ] = None,
    deck: Annotated[
        Path | None, typer.Option(help="Nastran or Abaqus deck of the flexible body.", show_default=False)
    ] = None,
    units: Annotated[str | None, typer.Option(help="Units of the deck, such as mm-t-s. Default: a guess.")] = None,
    template: Annotated[
        str | None, typer.Option(help=f"Start from a shipped case with its mesh: {', '.join(TEMPLATES)}.")
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
