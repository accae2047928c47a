"""Ansys archives (.cdb, by CDWRITE) through mapdl-archive: components, element types, materials and sections are
groups.

These are called type_1 (number of the element type), mat_2 and real_3 (real constants or sections).
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from femflex.extras import require
from femflex.mesh.formats.contents import Contents
from femflex.mesh.formats.register import register
from femflex.mesh.formats.vtk_data import leaf_contents
from femflex.mesh.formats.vtk_process import read_leaves

NAME = "Ansys archive"
NUMBERED = {"ansys_etype": "type", "ansys_material_type": "mat", "ansys_real_constant": "real"}


def read_ansys(path: Path) -> Contents:
    """Contents of an archive. Raises MissingExtra without mapdl-archive."""
    require("ansys", f"{path.name} and other archives of Ansys")
    (leaf,) = read_leaves("ansys", path)
    if not len(leaf["kinds"]):
        raise ValueError(f"{path.name} holds no elements (EBLOCK) that mapdl-archive understands; write it by CDWRITE.")
    cell = {name: values for name, values in leaf["cell"].items() if _is_component(name, values)}
    for name, prefix in NUMBERED.items():
        values = leaf["cell"].get(name, np.zeros(0))
        cell |= {f"{prefix}_{int(value)}": values == value for value in np.unique(values)}
    points = {name: values for name, values in leaf["point"].items() if _is_component(name, values)}
    return leaf_contents({**leaf, "cell": cell, "point": points})


def _is_component(name: str, values: np.ndarray) -> bool:
    """Whether mapdl-archive made the array from a component: 1 inside and 0 outside."""
    named_by_user = not name.startswith(("ansys_", "vtkOriginal", "_")) and name not in (
        "origid",
        "VTKorigID",
        "angles",
    )
    return named_by_user and values.ndim == 1 and values.dtype.kind in "iub"


register(NAME, (".cdb",), read_ansys)
