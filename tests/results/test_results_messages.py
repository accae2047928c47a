"""Every refusal of the results layer says what was found, what is known and what to do."""

from __future__ import annotations

import h5py
import numpy as np
import pytest
from support.known_run import CHANNELS, known_arrays, known_bodies, write_known_run

from femflex.results import RunWriter, open_run, resume_point

TIMES = np.arange(4.0)


@pytest.fixture
def written(tmp_path):
    return write_known_run(tmp_path / "run.h5")


def test_an_existing_file_is_refused(written):
    with pytest.raises(FileExistsError, match=r"run\.h5 exists; choose another name, or force to overwrite it"):
        RunWriter(written, CHANNELS, known_bodies())


def test_a_folder_that_does_not_exist_is_named(tmp_path):
    with pytest.raises(FileNotFoundError, match=r"nowhere does not exist; make it, or choose another for run\.h5"):
        RunWriter(tmp_path / "nowhere" / "run.h5", CHANNELS, known_bodies())


def test_a_folder_in_place_of_a_file_is_refused(tmp_path):
    with pytest.raises(IsADirectoryError, match="is a folder; give the name of a file"):
        RunWriter(tmp_path, CHANNELS, known_bodies(), force=True)


def test_wrong_blocks_are_refused_and_nothing_is_written(tmp_path):
    path = tmp_path / "run.h5"
    with RunWriter(path, CHANNELS, known_bodies()) as writer:
        arrays = known_arrays(TIMES)
        del arrays["q"]
        with pytest.raises(ValueError, match=r"lacks the channels \['q'\]; of what it has, \['p'\] are not channels"):
            writer.write_block(TIMES, {**arrays, "p": TIMES})
        with pytest.raises(ValueError, match=r"channel 'q' of the block has shape \(4, 3\); expected \(4, 2\)"):
            writer.write_block(TIMES, {**arrays, "q": np.zeros((4, 3))})
        with pytest.raises(ValueError, match="times of the block do not increase"):
            writer.write_block(TIMES[::-1], known_arrays(TIMES))
        with pytest.raises(ValueError, match=r"entry 'method' of the integrator's state is 'bdf'; only numbers"):
            writer.write_block(TIMES, known_arrays(TIMES), resume={"method": "bdf"})
        assert not path.exists()
        writer.write_block(TIMES, known_arrays(TIMES))
        with pytest.raises(ValueError, match="or do not follow those in the file"):
            writer.write_block(TIMES, known_arrays(TIMES))
        writer.finish(complete=True)
        with pytest.raises(ValueError, match="is finished; nothing more can be written to it"):
            writer.write_block(TIMES + 4, known_arrays(TIMES + 4))


def test_names_and_attributes_that_cannot_be_kept_are_refused(tmp_path):
    with pytest.raises(ValueError, match="attribute 'solver' is None; a result file keeps text, numbers and arrays"):
        RunWriter(tmp_path / "run.h5", CHANNELS, known_bodies(), {"solver": None})
    with pytest.raises(ValueError, match="found the name 'left/panel' of a body; a name holds letters"):
        RunWriter(tmp_path / "run.h5", CHANNELS, {"left/panel": known_bodies()["hub"]})


def test_an_unknown_path_lists_the_near_ones(written):
    with open_run(written) as run:
        with pytest.raises(KeyError, match=r"'atitude/angle' is not in .*; near it are \['attitude/angles'\]"):
            run["atitude/angle"]
        with pytest.raises(KeyError, match=r"near it are \['bodies/hub/position'\]"):
            run["position"]
        with pytest.raises(KeyError, match=r"it holds \['time', "):
            run["zzz"]
    with pytest.raises(ValueError, match="has been closed; open the run again"):
        run["q"]


def test_what_is_not_a_run_is_said_to_be_none(tmp_path):
    text, other, newer = tmp_path / "a.txt", tmp_path / "b.h5", tmp_path / "c.h5"
    text.write_text("hello")
    with h5py.File(other, "w") as file:
        file["x"] = 1
    with h5py.File(newer, "w") as file:
        file.attrs.update({"format": "femflex run", "layout": 2, "femflex_version": "9.1"})
        file["progress"] = [0, -1]
    with pytest.raises(FileNotFoundError, match=r"result file .*none\.h5 does not exist"):
        open_run(tmp_path / "none.h5")
    with pytest.raises(ValueError, match=r"a\.txt is not a result file: it is not in the HDF5 format"):
        open_run(text)
    with pytest.raises(ValueError, match=r"b\.h5 is an HDF5 file, but not a result file: its attribute `format`"):
        open_run(other)
    with pytest.raises(ValueError, match=r"has layout 2, written by femflex 9\.1; this version reads layouts up to 1"):
        open_run(newer)


def test_a_run_without_a_state_cannot_go_on(tmp_path):
    with RunWriter(tmp_path / "run.h5", CHANNELS, known_bodies()) as writer:
        writer.write_block(TIMES, known_arrays(TIMES))
    with pytest.raises(ValueError, match="holds no state of the integrator to go on from; start the run anew"):
        resume_point(tmp_path / "run.h5")
