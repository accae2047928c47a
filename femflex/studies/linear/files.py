"""Linear models as files (.mat for MATLAB and Octave, .npz for numpy, .h5), and states of runs to linearise about."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from femflex.arrays import Array
from femflex.hdf5 import atomic_hdf5
from femflex.results import open_run
from femflex.studies.linear.linear_model import LinearModel, second_order
from femflex.studies.linear.space import StateSpace
from femflex.system import System
from femflex.writing import atomic_file

SUFFIXES = (".mat", ".npz", ".h5")


def save_model(model: StateSpace, path: str | Path, force: bool = False) -> Path:
    """Save A, B, C, D, and names and units of states, inputs and outputs; of a LinearModel also M, DG and K.

    Returns the path.

    DG is D + G, damping and gyroscopic, which stand there one by one too, with `turning` W, `coupling` R, `forces` Q
    and `modes` Phi (`SecondOrder`); y0 the outputs and t the time about which it holds. `input_frames` and
    `output_frames` name the axes of components, as `Channel.frame`. Raises ValueError for
    another suffix than .mat, .npz, .h5, and FileExistsError unless `force`.
    """
    path = Path(path)
    kind = path.suffix.lower()
    if kind not in SUFFIXES:
        raise ValueError(f"a linear model is written as {', '.join(SUFFIXES)}; {path.name} is neither")
    numbers = {"A": model.A, "B": model.B, "C": model.C, "D": model.D}
    if isinstance(model, LinearModel):
        numbers |= {"M": model.mass, "DG": model.damping, "K": model.stiffness, "y0": model.y0, "t": np.array(model.t)}
        form, keys = second_order(model), ("damping", "gyroscopic", "turning", "coupling", "forces", "modes")
        numbers |= {key: getattr(form, key) for key in keys}
    texts = {}
    for key in ("states", "inputs", "outputs"):
        pairs = getattr(model, key)
        texts[key] = [name for name, _ in pairs]
        texts[key.removesuffix("s") + "_units"] = [unit for _, unit in pairs]
        if key != "states":
            texts[key.removesuffix("s") + "_frames"] = [model.frames.get(name, "") for name, _ in pairs]
    if kind == ".h5":
        import h5py

        with atomic_hdf5(path, force) as file:
            for key, value in numbers.items():
                file[key] = value
            for key, words in texts.items():
                file.create_dataset(key, data=np.array(words, object), dtype=h5py.string_dtype())
        return path
    with atomic_file(path, force) as file_path:
        if kind == ".mat":
            from scipy.io import savemat

            savemat(file_path, numbers | {key: np.array(value, object) for key, value in texts.items()})
        else:
            text_arrays = {key: np.array(value, str) for key, value in texts.items()}
            np.savez(file_path, **numbers, **text_arrays)  # type: ignore[arg-type]
    return path


def state_of_run(path: str | Path, system: System, time: float) -> tuple[float, Array]:
    """Time and state (n_x,) of the row of a run nearest to a time [s].

    Raises ValueError when the run is of another craft, or does not reach that time.
    """
    with open_run(path) as run:
        names = tuple(name for key in ("q", "u", "z") if key in run for name in run.names(key))
        expected = tuple(name for name, _ in system.all_state_names())
        if names != expected:
            raise ValueError(
                f"{path} is of another craft: its state has {len(names)} numbers and that of the case {len(expected)}; "
                "take the run of this case"
            )
        times = run.time
        if not len(times) or not times[0] <= time <= times[-1]:
            reach = f"it goes from {times[0]:.6g} s to {times[-1]:.6g} s" if len(times) else "it holds no instants"
            raise ValueError(f"there is no state at {time:.6g} s in {path}; {reach}")
        k = int(np.argmin(np.abs(times - time)))
        return float(times[k]), run.states(slice(k, k + 1))[0]
