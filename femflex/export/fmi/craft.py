"""Whole crafts as FMUs of FMI 3.0 for co-simulation, with Python inside, by way of pythonfmu3.

The FMU holds the case and the files that it names, a module that femflex steps, and pythonfmu3 with its libraries. The
Python that loads it needs femflex.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from hashlib import sha256
from pathlib import Path
from zipfile import ZIP_DEFLATED, ZipFile

from femflex.case import Case, read_case
from femflex.case.named_files import check_no_input, input_files
from femflex.export.fmi.description import Description, port_variables
from femflex.export.fmi.linear import identifier_of
from femflex.export.fmi.stepped import SteppedCraft
from femflex.extras import require
from femflex.writing import atomic_file, check_destination

TEMPLATE = Path(__file__).with_name("craft_module.py.txt")
KEPT = {"canGetAndSetFMUState": "true", "canSerializeFMUState": "true"}
LIBRARIES = (".so", ".dll", ".dylib")


def write_craft_fmu(
    case: Case | str | Path,
    path: str | Path,
    inputs: Sequence[str] | None = None,
    outputs: Sequence[str] | None = None,
    force: bool = False,
) -> list[str]:
    """Write the craft of a case as an FMU for co-simulation. Returns what is worth saying, as lines.

    inputs   as of `linear_model`: they add to what the case has; by default its loads and signals
    outputs  channels; by default those of `linear_model`
    Raises CaseError for a case that cannot be run, KeyError and ValueError for inputs and outputs that it has not,
    MissingExtra without pythonfmu3, and OSError.
    """
    require("fmi", "FMUs of whole crafts")
    path, case = Path(path), case if isinstance(case, Case) else read_case(case)
    check_destination(path, force)
    check_no_input(case, path)
    craft = SteppedCraft(case, inputs, outputs)
    files = [file.resolve() for file in input_files(case)]
    root = Path(os.path.commonpath([file.parent for file in files]))
    contents = {f"craft/{file.relative_to(root).as_posix()}": file.read_bytes() for file in files}
    token = sha256(b"".join(contents.values())).hexdigest()[:32]
    words = {
        "CASE": f"craft/{files[0].relative_to(root).as_posix()}",
        "INPUTS": [name for name, _ in craft.inputs],
        "OUTPUTS": [name for name, _ in craft.outputs],
    }
    module = TEMPLATE.read_text(encoding="utf-8")
    for word, value in words.items():
        module = module.replace(f"@{word}@", repr(value))
    identifier = identifier_of(path)
    description = Description(
        path.stem, identifier, token, port_variables(craft.inputs, craft.outputs, craft.frames),
        {"CoSimulation": KEPT | {"needsExecutionTool": "true", "canHandleVariableCommunicationStepSize": "true"}},
        craft.step, craft.duration,
    )  # fmt: skip
    name = f"craft_{token}"  # so that two crafts in one process are two modules
    with atomic_file(path, force) as part, ZipFile(part, "w", ZIP_DEFLATED) as archive:
        archive.writestr("modelDescription.xml", description.xml())
        archive.writestr("resources/slavemodule.txt", name)
        archive.writestr(f"resources/{name}.py", module)
        for file, data in contents.items():
            archive.writestr(f"resources/{file}", data)
        systems = _add_pythonfmu3(archive, identifier)
    return [
        f"FMI 3.0, co-simulation of the whole craft, {len(craft.inputs)} inputs, {len(craft.outputs)} outputs",
        f"for {', '.join(systems)}; the Python that loads it needs femflex",
    ]


def _add_pythonfmu3(archive: ZipFile, identifier: str) -> list[str]:
    """Add pythonfmu3 and its libraries; return the systems for which it has some."""
    import pythonfmu3

    folder, systems = Path(pythonfmu3.__file__).parent, []
    for file in sorted(folder.glob("*.py")):
        archive.write(file, f"resources/pythonfmu3/{file.name}")
    for file in sorted((folder / "resources" / "binaries").rglob("*")):
        if file.suffix in LIBRARIES:
            systems.append(file.parent.name)
            archive.write(file, f"binaries/{file.parent.name}/{identifier}{file.suffix}")
    return systems
