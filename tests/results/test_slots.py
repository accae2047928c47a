"""Slots for the state of an integrator: which states a slot takes, and what it gives back."""

from __future__ import annotations

import h5py
import numpy as np

from femflex.results.resume import fits, flattened, lay_slots, write_slot


def test_a_slot_takes_states_of_its_own_entries_shapes_and_types_alone(tmp_path):
    state = flattened({"x": np.arange(3.0), "step": {"size": 0.1, "count": 4}})
    assert set(state) == {"x", "step/size", "step/count"}
    with h5py.File(tmp_path / "a.h5", "w") as file:
        lay_slots(file, state, alone=False, kept=-1)
        assert fits(file, state, 0) and fits(file, state, 1)
        less = {path: value for path, value in state.items() if path != "step/count"}
        assert not fits(file, less, 0) and not fits(file, {**state, "y": np.zeros(2)}, 0)
        assert not fits(file, {**state, "x": np.arange(4.0)}, 0)
        assert not fits(file, {**state, "x": np.arange(3)}, 0)
        write_slot(file, {**state, "x": np.array([7.0, 8.0, 9.0])}, 1)
        assert file["resume/1/x"][()].tolist() == [7.0, 8.0, 9.0] and file["resume/1/step/count"][()] == 4
        assert file["resume/0/x"][()].tolist() != [7.0, 8.0, 9.0]
