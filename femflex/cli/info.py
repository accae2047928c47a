"""`femflex info`: the contents of a mesh, body, case or run file."""

from __future__ import annotations

import re
import warnings
from pathlib import Path
from typing import Annotated, Any

import typer

from femflex.cli.progress import Patience
from femflex.cli.tables import print_folded
from femflex.cli.verb import verb

MATRICES = (".npz", ".mat", ".op4", ".op2", ".pch", ".dmig", ".asm", ".mtx", ".sti", ".mas", ".dof")  # suffixes
LINEAR = {"A", "B", "C", "D", "states", "inputs", "outputs", "state_units"}  # members of a linear model's file
# cards that make a file a deck, and not a mesh alone
PROPERTIES = re.compile(r"^(MAT\d|P(SHELL|COMP|BAR|BEAM|ROD|SOLID|BUSH)|\*MATERIAL|\*\w[\w ]* SECTION)", re.I | re.M)


@verb("femflex info meshes/panel.msh")
def info(
    file: Annotated[Path, typer.Argument(help="Mesh, deck, body, case or run file.", show_default=False)],
    units: Annotated[str, typer.Option(help="Units of a deck, such as mm-t-s.")] = "m-kg-s",
    channels: Annotated[
        bool, typer.Option("--channels", help="List the channels that a run of the case would write.")
    ] = False,
) -> None:
    """Describe a file: groups of a mesh, cards of a deck, modes of a body, tables of a case, channels."""
    from femflex.mesh.formats import FORMATS

    kind = kind_of_hdf5(file)
    if channels and not (file.suffix == ".toml" or kind == "femflex run"):
        raise ValueError(f"--channels lists those of a case or of a run; {file} is neither: leave the option out")
    with Patience(f"reading {file.name}"):
        text = (
            _hdf5_text(file)
            if (starts_as_hdf5(file) or file.suffix.lower() in (".h5", ".hdf5")) and file.suffix.lower() not in FORMATS
            else (_channels_text if channels else _case_text)(file)
            if file.suffix == ".toml"
            else _matrices_text(file)
            if file.suffix.lower() in MATRICES or _has_matrices(file)
            else _mesh_or_deck_text(file, units)
        )
    print_folded(text)


def _has_matrices(file: Path) -> bool:
    """Whether bulk data have matrices (DMIG) and no elements."""
    if file.suffix.lower() not in (".bdf", ".nas", ".dat"):
        return False
    text = file.read_bytes().upper()
    return b"\nDMIG" in text and not re.search(rb"\nC(BAR|BEAM|ROD|TRI|QUAD|TETRA|HEXA|PENTA|BUSH|ELAS)", text)


def starts_as_hdf5(file: Path) -> bool:
    """Whether the first bytes of a file are those of HDF5."""
    with open(file, "rb") as opened:
        return opened.read(8) == b"\x89HDF\r\n\x1a\n"


def kind_of_hdf5(file: Path) -> str:
    """Return the format that an HDF5 file names, "femflex run" or "femflex body"; "" for a file that is no HDF5.

    Raises FileNotFoundError.
    """
    if not file.is_file():
        raise FileNotFoundError(
            f"{file} does not exist" if not file.exists() else f"{file} is a folder; name a file in it"
        )
    if not starts_as_hdf5(file):
        return ""
    from femflex.hdf5 import open_hdf5

    with open_hdf5(file) as opened:
        return str(opened.attrs.get("format", ""))


def _hdf5_text(file: Path) -> str:
    from femflex.hdf5 import open_hdf5

    kind = kind_of_hdf5(file)
    if kind == "femflex body":
        from femflex.reduction import load_body

        body = load_body(file)
        places = [f"  {name} ({', '.join(f'{x:.6g}' for x in m.position)}) m" for name, m in body.markers.items()]
        return "\n".join([f"{file.name}: {body!r}", *places])
    if kind == "femflex run":
        from femflex.results import open_run

        with open_run(file) as run:
            return repr(run)
    with open_hdf5(file) as opened:
        keys = set(opened)
        if LINEAR <= keys:
            return linear_text(file, *(opened[key][()] for key in ("states", "inputs", "outputs")))
    if {"problems", "percentiles", "inputs"} <= keys:
        return _sweep_text(file)
    if keys and not kind:
        return _matrices_text(file)
    raise ValueError(f"{file} is an HDF5 file, but neither a run nor a body of femflex, nor one of matrices")


def _sweep_text(file: Path) -> str:
    """Lines about the results of a sweep."""
    from femflex.studies.sweep import open_sweep

    results = open_sweep(file)
    failed = sum(bool(text) for text in results.problems)
    lines = [f"{file.name}: sweep, {len(results.problems)} runs, of which {failed} failed"]
    lines += [
        f"input   {name}: {v.min():.6g} to {v.max():.6g} {results.units.get(name, '')}"
        for name, v in results.inputs.items()
    ]
    for name, (mean, sigma, least, largest) in results.statistics().items():
        v, unit = results.outputs[name], results.units.get(name, "")
        lines.append(
            f"output  {name}: mean {mean:.6g}, sigma {sigma:.6g}, {v[least]:.6g} (run {least}) to {v[largest]:.6g} "
            f"(run {largest}) {unit}"
        )
    return "\n".join([*lines, *(f"history {name} [{results.units.get(name, '')}]" for name in results.histories)])


def linear_text(file: Path, states: Any, inputs: Any, outputs: Any) -> str:
    """Lines about a linear model that `femflex linearize` wrote, by the names in it."""
    import numpy as np

    names = [
        [n.decode() if isinstance(n, bytes) else str(np.ravel(n)[0]) for n in np.ravel(group)]
        for group in (states, inputs, outputs)
    ]
    lines = [f"{file.name}: linear model of femflex, dx/dt = A x + B u, y = C x + D u"]
    for head, group in zip(("states", "inputs", "outputs"), names, strict=True):
        lines.append(f"{head:8}{len(group)}: {', '.join(group) or 'none'}")
    return "\n".join(lines)


def _case_text(file: Path) -> str:
    from femflex.case import read_case

    case = read_case(file)
    names = [(kind, [item.name for item in getattr(case, kind)]) for kind in ("constraints", "springs", "loads")]
    names.append(("expect", list(case.expect.answers)))
    return "\n".join([repr(case), *(f"  {kind}: {', '.join(each)}" for kind, each in names if each)])


def _channels_text(file: Path) -> str:
    """The channels that a run of a case would write."""
    from femflex.case import read_case
    from femflex.pipeline.compiled import compiled
    from femflex.pipeline.decisions import resolve_choices
    from femflex.pipeline.recovery_channels import recovery_channels
    from femflex.results.layout import channel_lines

    case = read_case(file)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # `check` and `run` report them
        system = resolve_choices(case).system
        channels = compiled(system).channels | recovery_channels(case, system).channels
    head = f"{file.name}: {len(channels)} channels at n instants"
    return "\n".join(
        [head, *channel_lines({path: channels[path] for path in sorted(channels, key=lambda path: path.split("/"))})]
    )


def _mesh_or_deck_text(file: Path, units: str) -> str:
    """Lines about a mesh, and about the deck where the file is one."""
    from femflex.decks import READERS, read_deck
    from femflex.decks.report import describe
    from femflex.decks.units import units_of

    declared = units_of(units)
    if not any(file.suffix.lower() in reader.suffixes for reader in READERS.values()):
        return _mesh_text(file)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # said by `describe`
            deck = describe(read_deck(file, declared))
    except ValueError as error:
        try:
            mesh = _mesh_text(file)
        except ValueError as mesh_error:  # coordinate systems of its own, say
            raise ValueError(f"{error}\n\nas a mesh: {mesh_error}") from None
        if not PROPERTIES.search(file.read_text(encoding="utf-8", errors="replace")):
            return f"{mesh}\n\nas a deck: {error}"
        print_folded(mesh)
        raise ValueError(f"as a deck: {error}") from None
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return f"{deck}\n\n{_mesh_text(file)}"
    except ValueError:  # elements of other coordinate systems, masses alone
        return deck


def _matrices_text(file: Path) -> str:
    import numpy as np
    from scipy.io import loadmat

    if file.suffix.lower() in (".mat", ".npz"):
        try:
            arrays = np.load(file) if file.suffix.lower() == ".npz" else loadmat(file)
            if set(arrays) >= LINEAR:
                return linear_text(file, *(arrays[key] for key in ("states", "inputs", "outputs")))
        except (OSError, ValueError, NotImplementedError):  # damaged, or of another version: its reader says so
            pass
    from femflex.matrices.read import describe_matrices

    return describe_matrices(file)


def _mesh_text(file: Path) -> str:
    from femflex.mesh import describe, read_mesh

    return f"{file.name}: mesh\n{describe(read_mesh(file, strict=False))}"
