"""A craft whose mesh is written in another format has the same motion."""

from pathlib import Path

import numpy as np
import pytest

import femflex
from femflex.mesh import read_mesh, write_mesh

TOP = Path(__file__).resolve().parents[1]
TIP = "markers/panel_east.corner/deflection"


def deflection(folder: Path, mesh: Path) -> np.ndarray:
    """Deflection of the panel's corner over the first two seconds of the slew, its panels read from a mesh file."""
    text = (TOP / "cases" / "panel_slew.toml").read_text().split("[pictures]")[0]
    text = text.replace("../meshes/panel.msh", str(mesh)).replace('"60 s"', '"2 s"')
    case = folder / f"{mesh.name}.toml"
    case.write_text(text)
    with femflex.run(case, case.with_suffix(".h5")) as run:
        return np.asarray(run[TIP])


@pytest.fixture(scope="module")
def expected(tmp_path_factory: pytest.TempPathFactory) -> np.ndarray:
    """The deflection with the mesh as it is shipped."""
    return deflection(tmp_path_factory.mktemp("shipped"), TOP / "meshes" / "panel.msh")


@pytest.mark.sampled(1)
@pytest.mark.parametrize("ending", ["med", "vtu", "vtk", "inp", "bdf"])
def test_run_is_the_same_for_every_format_of_its_mesh(ending, expected, tmp_path):
    other = tmp_path / f"panel.{ending}"
    write_mesh(other, read_mesh(TOP / "meshes" / "panel.msh"))
    assert np.abs(expected).max() > 0.01
    # Nastran's fields carry fewer digits than the others
    assert deflection(tmp_path, other) == pytest.approx(expected, abs=1e-9 if ending == "bdf" else 1e-12)


@pytest.mark.slow
def test_panel_of_second_order_cells_bends_as_much(expected, tmp_path):
    second = deflection(tmp_path, TOP / "meshes" / "panel6.msh")
    assert np.abs(second).max() == pytest.approx(np.abs(expected).max(), rel=0.02)  # other triangles, and coarser
