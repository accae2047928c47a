"""`femflex examples`: the cases that come with femflex."""

from __future__ import annotations

import shutil
import tomllib
from collections.abc import Iterator
from importlib.metadata import files
from pathlib import Path
from typing import Annotated

import typer

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
