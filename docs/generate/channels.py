"""Reference of every channel of a result file, from two small crafts that have one of each."""

from __future__ import annotations

import re
import warnings
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

import femflex
from femflex import system as nouns
from generate.markdown import cell, code, save, table

HERE = Path(__file__).resolve().parent
HEAD = """# Channels of a result file

A channel is an array over time in the result file. `femflex info run.h5` lists those of a run, and `femflex plot` draws
them. Every channel carries its unit, meaning, column names and axes as attributes. Capital words stand for the names in
your case. Channels marked "orbit" need an orbit, those marked "ground" need a case without one.
`python docs/generate/reference.py` writes this page from the program.

LINE is a body cut into segments, LINE.K its segment K.

"""
KINDS = {"ground": "channels_ground.toml", "orbit": "channels_orbit.toml"}
NUMBERED = re.compile(r"([A-Z]{4,})\d+")
COORDINATE = re.compile(r"JOINT\.(?:slide|angle)\d*")
SEGMENT = re.compile(r"LINE\.\d+")
END = re.compile(r"BODY\.(?:root|tip)")
REPEATED = ("markers/LINE", "joints/LINE")  # as those of other bodies


def write(target: Path) -> None:
    """Write the page channels.md."""
    channels = {kind: channels_of(model_of(HERE / name)) for kind, name in KINDS.items()}
    save(target / "channels.md", HEAD + channel_tables(channels) + terms_page())


def _act(inputs: Any, outputs: Any) -> None:
    outputs.zdot[0] = -inputs.z[0]


def _law(_t: float, _sensors: Any, memory: Any) -> tuple[float, Any]:
    return 0.0, memory


CONTROLLER = nouns.Controller("CONTROLLER", _law, 1.0, commands={"COMMAND": "N"})
EFFECTOR = nouns.Effector(
    "EFFECTOR",
    _act,
    markers=(("BODY", "MARKER"),),
    freedoms=("JOINT1.angle",),
    states={"STATE": "N"},
    channels={"CHANNEL": "m"},
    accounts=("energy", "dissipation", "supplied", "mass_flow"),
)


def _write(_t: float, _z: Any, _numbers: Any, _block: Any) -> None:
    return


VARIATION = nouns.Variation(_write, ("mass", "growth"))


def model_of(path: Path) -> Any:
    """The compiled model of a case; the one on the ground also has parts that only Python can make."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        system = femflex.build_system(femflex.read_case(path))
        if system.orbit is None:
            rows = nouns.velocity_rows("CONSTRAINT1", 1, _no_rows(len(system.velocity_names())))
            python_parts = {
                "effectors": (*system.effectors, EFFECTOR, CONTROLLER),
                "varying": {**system.varying, "BODY5": VARIATION},
            }
            system = replace(system, constraints=(*system.constraints, rows), **python_parts)
        return femflex.compile_system(system)


def _no_rows(n_u: int) -> Any:
    def rows(*_: Any) -> tuple[np.ndarray, np.ndarray]:
        A = np.zeros((1, n_u))
        A[0, 0] = 1.0
        return A, np.zeros(1)

    return rows


def without_numbers(text: str) -> str:
    """The text with numbered names replaced by their common name."""
    without = NUMBERED.sub(r"\1", SEGMENT.sub("LINE.K", text))
    return END.sub("BODY.MARKER", COORDINATE.sub("JOINT.COORDINATE", without))


def channels_of(model: Any) -> dict[str, list[Any]]:
    """Path -> channels of that kind, numbered names replaced by their common name."""
    channels: dict[str, list[Any]] = {}
    for path, channel in model.channels.items():
        if not path.startswith(REPEATED):
            channels.setdefault(without_numbers(path), []).append(channel)
    return channels


def channel_tables(channels_by_kind: dict[str, dict[str, list[Any]]]) -> str:
    """Tables of all channels, one for each first part of the path."""
    paths = dict.fromkeys(path for channels in channels_by_kind.values() for path in channels)
    groups: dict[str, list[list[str]]] = {}
    for path in sorted(paths, key=lambda path: (path.partition("/")[0], path)):
        kinds = [kind for kind in channels_by_kind if path in channels_by_kind[kind]]
        path_channels = [channel for kind in kinds for channel in channels_by_kind[kind][path]]
        meaning = "; ".join(dict.fromkeys(without_numbers(channel.description) for channel in path_channels))
        only = (
            ""
            if len(kinds) == len(channels_by_kind) or path.split("/")[0] not in ("monitors", "orbit", "sights")
            else kinds[0]
        )
        varied = (
            len({channel.shape for channel in path_channels}) > 1
            or path in ("q", "u", "z")
            or path.endswith(("delta", "drive", "multipliers"))
        )
        size = "one per column" if varied else " x ".join(str(n) for n in path_channels[0].shape) or "1"
        unit = "of the column" if path in ("q", "u", "z") else " or ".join(dict.fromkeys(c.unit for c in path_channels))
        row = [code(path), size, cell(unit), path_channels[0].frame, only, cell(meaning)]
        groups.setdefault(path.partition("/")[0], []).append(row)
    head = ("channel", "numbers", "unit", "axes", "only", "meaning")
    return "\n".join(f"## {name}\n\n{table(head, rows)}" for name, rows in groups.items())


def terms_page() -> str:
    """Names of the terms of the equations of motion."""
    names: dict[str, None] = {}
    for case in KINDS.values():
        model = model_of(HERE / case)
        for name in model.terms(np.zeros(1), model.x0[None]):
            names.setdefault(without_numbers(name))
    text = "\n## Terms\n\n`femflex terms run.h5 --keep` adds every term of the equations of motion as `terms/NAME`, "
    text += "one column per quasi-velocity. The same names, without the part before the slash, go to "
    text += "`femflex run --without`. "
    text += "Bodies with nonlinear or condensed strain also have `elastic_K2` and `elastic_K3`. "
    return text + "The terms sum to zero to rounding.\n\n" + ", ".join(code(name) for name in names) + "\n"
