"""Linear models as FMUs of FMI 3.0, in C without Python: model exchange and co-simulation.

The sources are in the FMU. Where a compiler is found, the library of this machine is too.
"""

from __future__ import annotations

import os
import platform
import re
import shutil
import subprocess
import sys
import tempfile
from hashlib import sha256
from pathlib import Path
from xml.etree.ElementTree import Element, SubElement, tostring
from zipfile import ZIP_DEFLATED, ZipFile

from femflex.export.fmi.description import Description, Variable, port_variables
from femflex.export.linear.c_source import c_texts, check_constant
from femflex.studies.linear import LinearModel, StateSpace
from femflex.writing import atomic_file

WRAPPER = Path(__file__).with_name("fmi3.c")
COMPILERS = ("cc", "gcc", "clang")
FLAGS = ("-std=c99", "-O2", "-shared", "-fPIC", "-fvisibility=hidden")
LIBRARIES = {"linux": ".so", "darwin": ".dylib", "win32": ".dll"}  # endings by system
STATE = {"canGetAndSetFMUState": "true", "canSerializeFMUState": "true"}
DERIVATIVES = {"providesDirectionalDerivatives": "true", "providesAdjointDerivatives": "true"}


def write_linear_fmu(model: StateSpace, path: str | Path, force: bool = False) -> list[str]:
    """Write a linear model as an FMU. Returns what is worth saying, as lines.

    Its inputs and outputs have the names of the model. A step of its co-simulation is exact, with inputs constant over
    it. Raises ValueError for a craft that changes over time, and OSError.
    """
    path = Path(path)
    if isinstance(model, LinearModel):
        check_constant(model)
    sources = c_texts(model, "model")
    del sources["model_test.c"]
    token = sha256(sources["model.c"].encode()).hexdigest()[:32]
    sources["fmi3.c"] = f'#define TOKEN "{token}"\n' + WRAPPER.read_text(encoding="utf-8")
    identifier = identifier_of(path)
    description = Description(
        path.stem, identifier, token, _variables(model),
        {"ModelExchange": STATE | DERIVATIVES,
         "CoSimulation": STATE | DERIVATIVES | {"canHandleVariableCommunicationStepSize": "true"}},
    )  # fmt: skip
    library, said = _compiled(sources, identifier)
    with atomic_file(path, force) as part, ZipFile(part, "w", ZIP_DEFLATED) as archive:
        archive.writestr("modelDescription.xml", description.xml())
        archive.writestr("sources/buildDescription.xml", _build(identifier))
        for name, text in sources.items():
            archive.writestr(f"sources/{name}", text)
        if library is not None:
            archive.writestr(f"binaries/{tuple_of_platform()}/{identifier}{LIBRARIES[sys.platform]}", library)
    return [
        f"FMI 3.0, model exchange and co-simulation, {len(model.inputs)} inputs, {len(model.outputs)} outputs",
        said,
    ]


def identifier_of(path: Path) -> str:
    """The name of a file as a word in C."""
    word = re.sub(r"\W", "_", path.stem, flags=re.ASCII)
    return word if re.match("[A-Za-z]", word) else f"fmu_{word}"


def tuple_of_platform() -> str:
    """The name of this machine's kind in FMI, such as x86_64-linux."""
    machine = {"amd64": "x86_64", "arm64": "aarch64"}.get(platform.machine().lower(), platform.machine().lower())
    return f"{machine}-{ {'win32': 'windows'}.get(sys.platform, sys.platform) }"


def _variables(model: StateSpace) -> list[Variable]:
    """Inputs, outputs, states and their rates, in the order that fmi3.c takes them in."""
    taken = {name for name, _ in (*model.inputs, *model.outputs)}
    states = [(f"state {name}" if name in taken else name, unit) for name, unit in model.states]
    return [
        *port_variables(model.inputs, model.outputs, model.frames),
        *(Variable(name, unit, "local", "departure from the equilibrium", start=0.0) for name, unit in states),
        *(Variable(f"der({name})", _rate(unit), "local", derivative=name) for name, unit in states),
    ]


def _rate(unit: str) -> str:
    """The unit of a rate of what has this unit."""
    stem, _, power = unit.partition("/s")
    if not power and "/s" in unit:
        return f"{stem}/s^2"
    if re.fullmatch(r"\^\d+", power):
        return f"{stem}/s^{int(power[1:]) + 1}"
    return f"{unit}/s"


def _build(identifier: str) -> bytes:
    """The file buildDescription.xml."""
    root = Element("fmiBuildDescription", fmiVersion="3.0")
    files = SubElement(
        SubElement(root, "BuildConfiguration", modelIdentifier=identifier), "SourceFileSet", language="C99"
    )
    for name in ("model.c", "fmi3.c"):
        SubElement(files, "SourceFile", name=name)
    return tostring(root, encoding="utf-8", xml_declaration=True)


def _compiled(sources: dict[str, str], identifier: str) -> tuple[bytes | None, str]:
    """The library of this machine, or None, and what is worth saying of it."""
    compiler = next(
        (path for name in (os.environ.get("CC", ""), *COMPILERS) if name and (path := shutil.which(name))), None
    )
    if compiler is None or sys.platform not in LIBRARIES:
        return None, "no C compiler was found, so that it has sources alone; a program that takes FMUs compiles them"
    with tempfile.TemporaryDirectory() as folder:
        for name, text in sources.items():
            (Path(folder) / name).write_text(text, encoding="utf-8")
        target = Path(folder) / f"{identifier}{LIBRARIES[sys.platform]}"
        command = [compiler, *FLAGS, "model.c", "fmi3.c", "-o", str(target)]
        process = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
        if process.returncode:
            return None, f"sources alone, as {compiler} failed: {process.stderr.strip().splitlines()[-1:]}"
        return target.read_bytes(), f"compiled for {tuple_of_platform()}, with its sources"
