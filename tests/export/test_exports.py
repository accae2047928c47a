"""Exported runs as other readers see them: VTK's glTF and VTKHDF readers, scipy, pyarrow and h5py."""

from __future__ import annotations

import csv
import xml.etree.ElementTree as ElementTree

import h5py
import numpy as np
import pytest
from support.small_craft import BOOM, CRAFT

import femflex
from femflex.export import export_run
from femflex.results import open_run

SHAPED = "markers.left = { position = [0.5, 0, 0] }\nshapes = [{ kind = 'box', size = [1, 1, 1] }]"


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """Two seconds of a hub that turns with a boom that swings."""
    folder = tmp_path_factory.mktemp("export")
    (folder / "boom.inp").write_text(BOOM)
    text = CRAFT.replace("markers.left = { position = [0.5, 0, 0] }", SHAPED).replace('"10 s"', '"2 s"')
    (folder / "craft.toml").write_text(text)
    femflex.run(folder / "craft.toml", folder / "craft.h5")
    with open_run(folder / "craft.h5") as opened:
        yield opened


def tip_of(points, rest):
    """Mean of the points that stand at the end of the boom at rest, 3.5 m from the hub's centre."""
    return points[np.abs(rest[:, 0] - 3.5) < 1e-6].mean(axis=0)


def gltf_points(path, t):
    """Points of the boom and of the hub in Z-up axes, as VTK's reader moves and deforms them."""
    import pyvista as pv
    from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline
    from vtkmodules.vtkIOGeometry import vtkGLTFReader

    reader = vtkGLTFReader()
    reader.SetFileName(str(path))
    reader.UpdateInformation()
    reader.EnableAnimation(0)
    reader.UpdateInformation()
    information = reader.GetOutputInformation(0)
    assert information.Has(vtkStreamingDemandDrivenPipeline.TIME_RANGE())
    reader.UpdateTimeStep(t)
    blocks = pv.wrap(reader.GetOutput()).combine(merge_points=False).points
    return blocks @ np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])


def test_gltf_moves_and_bends_as_the_run(run, tmp_path):
    """The tip's ring stands around the marker at every instant, also where the reader interpolates none."""
    path = tmp_path / "craft.glb"
    said = export_run(run, path, camera="fixed")
    assert any("instants" in line for line in said)
    tip, first = run["markers/boom.tip/position"], run["bodies/hub/position"][0]
    straight = gltf_points(path, 0.0)
    x0 = tip[0] - first
    ring = np.linalg.norm(straight - tip[0], axis=1) < 0.031
    assert ring.sum() >= 8 and np.linalg.norm(x0 - [3.5, 0, 0]) < 0.02
    for k in (7, 23, 40):
        moved = gltf_points(path, float(run.time[k]))
        np.testing.assert_allclose(moved[ring].mean(axis=0), tip[k], atol=2e-6)
    assert np.abs(run["markers/boom.tip/deflection"]).max() > 5e-3


def test_paraview_files_hold_the_motion(run, tmp_path):
    import pyvista as pv
    from vtkmodules.vtkIOHDF import vtkHDFReader

    tip = run["markers/boom.tip/position"]
    export_run(run, tmp_path / "craft.vtkhdf", camera="fixed")
    export_run(run, tmp_path / "craft.pvd", camera="fixed", instants=5)
    reader = vtkHDFReader()
    reader.SetFileName(str(tmp_path / "craft.vtkhdf"))
    reader.UpdateInformation()
    assert reader.GetNumberOfSteps() == len(run)
    for k in (0, 17, 40):
        reader.SetStep(k)
        reader.Modified()
        reader.Update()
        grid = pv.wrap(reader.GetOutput())
        ring = (grid["body"] == 0) & (np.linalg.norm(grid.points - tip[0], axis=1) < 0.031)
        np.testing.assert_allclose((grid.points + grid["displacement"])[ring].mean(axis=0), tip[k], atol=2e-6)
    with h5py.File(tmp_path / "craft.vtkhdf") as file:
        assert len(file["VTKHDF/Points"]) == grid.n_points  # the grid stands once in the file
    instants = ElementTree.parse(tmp_path / "craft.pvd").getroot().findall(".//DataSet")
    assert [float(each.get("timestep")) for each in instants] == [0.0, 0.5, 1.0, 1.5, 2.0]
    last = pv.read(tmp_path / instants[-1].get("file"))
    np.testing.assert_allclose(last.points + last["displacement"], (grid.points + grid["displacement"]), atol=1e-6)
    stress = last["von_mises_stress"][last["body"] == 0]
    bent = run["markers/boom.tip/deflection"][-1]
    assert np.nanmax(stress) > 1e3 and np.linalg.norm(bent) > 1e-4


def test_tables_give_every_number_back(run, tmp_path):
    from scipy.io import loadmat

    parquet = pytest.importorskip("pyarrow.parquet", reason="pyarrow is not installed")
    pytest.importorskip("h5netcdf", reason="h5netcdf is not installed")
    paths = ["bodies/hub/rate", "monitors/energy"]
    for end in (".csv", ".parquet", ".mat", ".nc"):
        export_run(run, tmp_path / f"craft{end}", paths)
    with open(tmp_path / "craft.csv", newline="") as file:
        rows = list(csv.reader(file))
    heads = ["time [s]", *(f"bodies/hub/rate:{axis} [rad/s]" for axis in "xyz"), "monitors/energy [J]"]
    exact = np.column_stack([run.time, run[paths[0]], run[paths[1]]])
    assert rows[0] == heads
    np.testing.assert_array_equal(np.array(rows[1:], float), exact)
    table = parquet.read_table(tmp_path / "craft.parquet")
    assert table.column_names == heads
    np.testing.assert_array_equal(np.column_stack([table[head].to_numpy() for head in heads]), exact)
    mat = loadmat(tmp_path / "craft.mat", simplify_cells=True)
    np.testing.assert_array_equal(mat["bodies_hub_rate"], exact[:, 1:4])
    assert mat["units"]["bodies_hub_rate"] == "rad/s" and list(mat["names"]["bodies_hub_rate"]) == ["x", "y", "z"]
    with h5py.File(tmp_path / "craft.nc") as file:
        np.testing.assert_array_equal(file["monitors.energy"], exact[:, 4])


@pytest.mark.parametrize(
    ("name", "options", "words"),
    [
        ("craft.xyz", {}, ("craft.xyz", ".glb", ".vtkhdf", ".csv")),
        ("craft.glb", {"channels": ["q"]}, (".glb", "no channels", "q")),
        ("craft.csv", {"camera": "fixed"}, (".csv", "--camera", "scenes")),
        ("craft.glb", {"camera": "orbital"}, ("orbital", "orbit", "fixed")),
        ("craft.csv", {"channels": ["bodies/hub/rates"]}, ("bodies/hub/rates", "bodies/hub/rate")),
    ],
)
def test_exports_that_are_refused(run, tmp_path, name, options, words):
    with pytest.raises((ValueError, KeyError)) as caught:
        export_run(run, tmp_path / name, **options)
    assert all(word in str(caught.value) for word in words)
    assert not list(tmp_path.iterdir())
