"""Linear models as C, compiled here: against the matrices, exponentials of scipy, and runs of the linear equations."""

from __future__ import annotations

import ctypes
import shutil
import subprocess

import numpy as np
import pytest
from scipy.io import loadmat
from scipy.linalg import expm

import femflex
from femflex.export.linear import write_c
from femflex.studies.linear import linear_model, modal_truncation, save_model

COMPILER = shutil.which("cc") or shutil.which("gcc")
needs_compiler = pytest.mark.skipif(COMPILER is None, reason="there is no C compiler")
STRICT = ("-std=c90", "-pedantic", "-Wall", "-Wextra", "-Werror", "-Wno-overlength-strings")
SLEW = (["loads/slew/torque:y"], ["bodies/hub/rate:y", "markers/panel_east.corner/deflection:z"])
CRAFTS = {  # case -> changed values, inputs and outputs
    "eccentric_pitch": ({"orbit.eccentricity": 0}, ["markers/orbiter.origin/torque"], ["attitude/angles"]),
    "cmg_manoeuvre": ({}, ["markers/craft.origin/torque"], ["attitude/angles"]),
}


def model_of(name):
    values, inputs, outputs = CRAFTS[name]
    case = femflex.with_values(femflex.read_case(f"cases/{name}.toml"), values)
    return linear_model(femflex.build_system(case), inputs, outputs)


@pytest.fixture(scope="module")
def slew(slewed):
    return linear_model(slewed, *SLEW)


class Library:
    """The functions of a compiled model, over arrays."""

    def __init__(self, folder, name):
        path = folder / f"{name}.so"
        subprocess.run([COMPILER, *STRICT, "-shared", "-fPIC", folder / f"{name}.c", "-o", path], check=True)
        self.name, self.library = name, ctypes.CDLL(str(path))

    def __call__(self, function, *arrays):
        pointers = [ctypes.c_double(a) if isinstance(a, float) else a.ctypes.data_as(ctypes.c_void_p) for a in arrays]
        getattr(self.library, f"{self.name}_{function}")(*pointers)

    def step_matrices(self, h, n, n_in):
        transition, columns = np.zeros((n, n)), np.zeros((n, n_in))
        self("discretise", h, transition, columns, np.zeros(4 * (n + n_in) ** 2 + 1))
        return transition, columns


@needs_compiler
@pytest.mark.parametrize("name", ["panel_slew", *CRAFTS])
def test_compiled_model_is_the_linear_model(name, slew, tmp_path):
    model = slew if name == "panel_slew" else model_of(name)
    write_c(model, tmp_path / "craft.c")
    library, (n, n_in), n_q = Library(tmp_path, "craft"), model.B.shape, len(model.mass)
    rng = np.random.default_rng(1)
    x, u, rate, y = rng.normal(size=n), rng.normal(size=n_in), np.zeros(n), np.zeros(len(model.outputs))
    library("rate", x, u, rate)
    library("output", x, u, y)
    assert rate == pytest.approx(model.A @ x + model.B @ u, rel=1e-12, abs=1e-13 * np.abs(model.A).max())
    assert y == pytest.approx(model.y0 + model.C @ x + model.D @ u, rel=1e-12, abs=1e-12)
    q, v, z = np.split(x, [n_q, 2 * n_q])
    q_rate, v_rate = np.zeros(n_q), np.zeros(n_q)
    library("coordinate_rate", q, v, z.copy() if len(z) else np.zeros(1), u, q_rate, v_rate)
    size = np.abs(model.A).max()
    assert np.concatenate([q_rate, v_rate]) == pytest.approx(rate[: 2 * n_q], rel=1e-9, abs=1e-11 * size)
    modes = np.ctypeslib.as_array((ctypes.c_double * n_q**2).in_dll(library.library, "craft_modes")).reshape(n_q, n_q)
    assert modes.T @ model.mass @ modes == pytest.approx(np.eye(n_q), abs=1e-9)
    eta, nu, eta_rate, nu_rate = *np.linalg.solve(modes, np.column_stack([q, v])).T.copy(), q_rate * 0, v_rate * 0
    library("modal_rate", eta.copy(), nu.copy(), z.copy() if len(z) else np.zeros(1), u, eta_rate, nu_rate)
    assert modes @ nu_rate == pytest.approx(v_rate, rel=1e-8, abs=1e-10 * size)
    assert modes @ eta_rate == pytest.approx(q_rate, rel=1e-8, abs=1e-10)
    wide = np.zeros((n + n_in, n + n_in))
    wide[:n] = np.hstack([model.A, model.B])
    for h in (1e-3, 0.5):
        expected = expm(h * wide)[:n]
        found = np.hstack(library.step_matrices(h, n, n_in))
        assert found == pytest.approx(expected, rel=1e-9, abs=1e-12 * np.abs(expected).max())


@needs_compiler
def test_program_finds_the_responses_and_a_wrong_number(slew, tmp_path):
    """Of the whole model and of one with fewer modes, which has no second-order form."""
    for name, model in (("whole", slew), ("slow", modal_truncation(slew, 10.0))):
        write_c(model, tmp_path / f"{name}.c")
        text = (tmp_path / f"{name}.c").read_text()
        for wrong in (False, True):
            if wrong:
                head, _, tail = text.partition(f"{name}_D[] = {{")
                (tmp_path / f"{name}.c").write_text(f"{head}{name}_D[] = {{ 1.0 + {tail.lstrip()}")
            sources = [tmp_path / f"{name}.c", tmp_path / f"{name}_test.c"]
            subprocess.run([COMPILER, *STRICT, *sources, "-lm", "-o", tmp_path / name], check=True)
            process = subprocess.run([tmp_path / name], capture_output=True, text=True, check=False)
            assert process.returncode == wrong and ("failed" if wrong else "passed") in process.stdout


@needs_compiler
def test_steps_of_the_slew_are_those_of_a_linearised_run(slew, tmp_path):
    case = femflex.with_values(femflex.read_case("cases/panel_slew.toml"), {"run.duration": 20})
    run = femflex.run(case, tmp_path / "run.h5", linearised=True)
    write_c(slew, tmp_path / "craft.c")
    library, x, y, rows = Library(tmp_path, "craft"), np.zeros(len(slew.A)), np.zeros(2), []
    transition, columns = library.step_matrices(0.05, *slew.B.shape)
    with run:
        for t in run.time:
            torque = np.array([40.0 if t < 5.0 - 1e-9 else -40.0 if t < 10.0 - 1e-9 else 0.0])
            library("output", x, torque, y)
            rows.append(y.copy())
            library("step", transition, columns, torque, x)
        expected = [run["bodies/hub/rate"][:, 1], run["markers/panel_east.corner/deflection"][:, 2]]
    for found, values in zip(np.transpose(rows), expected, strict=True):
        assert found == pytest.approx(values, abs=1e-7 * np.abs(values).max())


def test_matlab_file_names_units_and_frames(slew, tmp_path):
    data = loadmat(save_model(slew, tmp_path / "model.mat"), simplify_cells=True)
    assert data["inputs"] == "loads/slew/torque:y" and data["input_units"] == "N m" and data["input_frames"] == "body"
    assert list(data["outputs"]) == SLEW[1] and list(data["output_units"]) == ["rad/s", "m"]
    assert list(data["output_frames"]) == ["body", "body"]
    n = len(data["M"])
    DG, Q, Phi = data["damping"] + data["gyroscopic"], data["forces"], data["modes"]
    assert DG == pytest.approx(data["DG"]) and Phi.T @ data["M"] @ Phi == pytest.approx(np.eye(n), abs=1e-9)
    assert data["M"] @ data["B"][n : 2 * n] == pytest.approx(np.ravel(Q), abs=1e-9)
