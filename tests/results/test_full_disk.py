"""A disk that gets full while a file is written: one sentence, exit code 3, nothing half-written left."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from support.known_run import CHANNELS, known_arrays, known_bodies

from femflex.results import RunWriter

EXPORTS = [
    *(f"mesh.write_mesh('square.{suffix}', square)" for suffix in ("msh", "vtu", "vtk", "med", "inp", "bdf")),
    *(f"matrices.write_matrices(springs, 'springs.{suffix}')" for suffix in ("npz", "h5", "mat", "op4", "bdf")),
    *(f"save_model(space, 'space.{suffix}')" for suffix in ("npz", "h5", "mat")),
    "reduction.save_body('hub.h5', femflex.rigid_body(1.0, np.eye(3)))",
    "results.RunWriter('new.h5', {}, {}, rows=50).write_block(np.arange(50.0), {})",
    "results.add_channels('run.h5', {'terms/x': (system.Channel('N', 'a force'), np.zeros(50))})",
    "plot_histories(run, 'pitch.svg', ['attitude/angles'])",
]
LIMITED = f"""
import resource
import numpy as np
from scipy.sparse import csr_array
import femflex
from femflex import matrices, mesh, reduction, results, system
from femflex.cli.verb import meaning
from femflex.studies.linear import StateSpace, save_model
from femflex.view import plot_histories
square = mesh.rectangle(1.0, 1.0, 20, 20)
random = np.random.default_rng(1).normal(size=(60, 60))
dofs = np.stack([np.repeat(np.arange(1, 21), 3), np.tile([1, 2, 3], 20)], axis=1)
springs = [csr_array(A) for A in (np.eye(60), random @ random.T)]
springs = matrices.MatrixModel("springs", np.arange(1, 21), np.arange(60.0).reshape(20, 3), dofs, *springs)
space = StateSpace(*4 * [random], *3 * [tuple((f"x{{k}}", "m") for k in range(60))])
run = results.open_run("run.h5")
resource.setrlimit(resource.RLIMIT_FSIZE, (600, resource.RLIM_INFINITY))
for export in {EXPORTS}:
    try:
        eval(export)
        print("written", export)
    except Exception as error:
        print(*meaning(error), sep="|")
"""


@pytest.mark.skipif(sys.platform == "win32", reason="needs a limit of file size")
def test_exports_that_do_not_fit_leave_no_file(tmp_path: Path):
    times = np.arange(50.0)
    with RunWriter(tmp_path / "run.h5", CHANNELS, known_bodies()) as writer:
        writer.write_block(times, known_arrays(times))
        writer.finish(complete=True)
    contents = (tmp_path / "run.h5").read_bytes()
    process = subprocess.run([sys.executable, "-c", LIMITED], cwd=tmp_path, capture_output=True, text=True, timeout=120)
    assert (process.returncode, process.stderr) == (0, "")
    for export, printed in zip(EXPORTS, process.stdout.splitlines(), strict=True):
        name = export.partition("'")[2].partition("'")[0]
        assert printed.startswith("3|") and name in printed, printed
    assert [path.name for path in tmp_path.iterdir()] == ["run.h5"]
    assert (tmp_path / "run.h5").read_bytes() == contents
