"""Result files that were edited or damaged: every verb ends with a sentence and exit code 2, or does what it can."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pytest

import femflex
from femflex.results import open_run

READERS = ("info run.h5", "plot run.h5 q -o q.png", "render run.h5 -o p.png --size 96x64", "stress run.h5")
RESUME = "run craft.toml -o run.h5 --resume --no-pictures"


def remove(path: str) -> Callable[[h5py.File], None]:
    return lambda file: file.pop(path) and None


def replace(path: str, change: Callable[[np.ndarray], np.ndarray]) -> Callable[[h5py.File], None]:
    def edit(file: h5py.File) -> None:
        values, attributes = change(file[path][()]), dict(file[path].attrs)
        del file[path]
        file[path] = values
        file[path].attrs.update(attributes)

    return edit


def set_attribute(path: str, key: str, value: object = None) -> Callable[[h5py.File], None]:
    return lambda file: file[path].attrs.__delitem__(key) if value is None else file[path].attrs.update({key: value})


def link_elsewhere(file: h5py.File) -> None:
    del file["q"]
    file["q"] = h5py.ExternalLink("other.h5", "/q")


def store_outside(file: h5py.File) -> None:
    del file["q"]
    file.create_dataset("q", (201, 11), "f8", external=[("q.raw", 0, 201 * 88)])


def add_huge_array(file: h5py.File) -> None:
    file.create_dataset("z", (201, 10**9), "f8", chunks=(1, 10**6))


# edit, verbs, a word of the sentence
EDITS = {
    "no time": (remove("time"), READERS, "/time"),
    "no progress": (remove("progress"), READERS, "/progress"),
    "too many rows": (replace("progress", lambda a: a + 1000), READERS, "1201 rows"),
    "time not rising": (replace("time", lambda t: t[::-1]), READERS, "/time"),
    "no q": (remove("q"), READERS, "channel q"),
    "short q": (replace("q", lambda q: q[:9]), READERS, "9 rows"),
    "q of whole numbers": (replace("q", lambda q: q.astype(int)), READERS, "int64"),
    "narrow q": (replace("q", lambda q: q[:, :4]), READERS, "11 names"),
    "no unit": (set_attribute("q", "unit"), READERS, "'unit'"),
    "renamed group": (lambda file: file.move("bodies", "body"), READERS, "bodies/boom/position"),
    "no model": (remove("model"), READERS, "/model"),
    "no case text": (set_attribute("/", "case_text"), READERS, "'case_text'"),
    "inputs cut": (set_attribute("/", "inputs", "{"), READERS, "'inputs'"),
    "layout of text": (set_attribute("/", "layout", "one"), READERS, "layout"),
    "no state": (remove("resume"), READERS, "/resume"),
    "external link": (link_elsewhere, READERS, "link"),
    "raw storage": (store_outside, READERS, "outside"),
    "size": (add_huge_array, READERS, "unfolds"),
    "fewer shapes": (replace("model/boom/shapes", lambda a: a[:2]), READERS, "'shapes'"),
    "cells": (replace("model/boom/cells/quad", lambda a: a + 9999), READERS[2:], "points"),
    "no strain rows": (remove("model/boom/strain_field/0/rows"), READERS[2:], "lacks rows"),
    "position is nan": (replace("bodies/boom/position", lambda a: a * np.nan), READERS[2:3], "not finite"),
    "delta is nan": (replace("bodies/boom/delta", lambda a: a * np.nan), READERS[3:], "not finite"),
    "q is nan": (replace("q", lambda a: a * np.nan), (RESUME, "plot run.h5 q --spectrum"), "finite"),
    "another case": (set_attribute("/", "case_text", "[run]\nduration = 3"), (RESUME,), "case text"),
    "another mass": (set_attribute("model/boom", "mass", 7.0), (RESUME,), "mass"),
    "other shapes": (replace("model/boom/shapes", lambda a: 2 * a), (RESUME,), "shapes"),
    "other names": (set_attribute("q", "names", [f"x{k}" for k in range(11)]), (RESUME,), "channel q"),
    "other method": (set_attribute("/", "integrator", "magic"), (RESUME,), "magic"),
}


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a finished run, and its case, which now is longer."""
    from support.small_craft import BOOM, CRAFT

    folder = tmp_path_factory.mktemp("finished")
    (folder / "boom.inp").write_text(BOOM)
    (folder / "craft.toml").write_text(CRAFT)
    femflex.run(folder / "craft.toml", folder / "run.h5").close()
    (folder / "craft.toml").write_text(CRAFT.replace('"10 s"', '"10.5 s"'))
    return folder


@pytest.mark.sampled(15)
@pytest.mark.parametrize("name", EDITS)
def test_edited_result_is_refused_with_what_is_wrong(name, finished, tmp_path, femflex):
    edit, verbs, word = EDITS[name]
    shutil.copytree(finished, tmp_path, dirs_exist_ok=True)
    with h5py.File("run.h5", "r+") as file:
        edit(file)
    for verb in verbs:
        code, out, err = femflex(*verb.split())
        assert code == 2 and word in err and "fault" not in err, (verb, out, err)
    assert not [path for path in tmp_path.iterdir() if path.suffix in (".png", ".raw")]


@pytest.mark.parametrize("keep", [0, 3000, 200_000])
def test_file_that_is_cut_short_is_refused(keep, finished, tmp_path, femflex):
    (tmp_path / "run.h5").write_bytes((finished / "run.h5").read_bytes()[:keep])
    for verb in READERS:
        code, _, err = femflex(*verb.split())
        assert code == 2 and "run.h5" in err and "damaged" in err, err


def test_plot_of_a_row_that_is_not_finite_has_a_gap(finished, tmp_path, femflex):
    shutil.copytree(finished, tmp_path, dirs_exist_ok=True)
    with h5py.File("run.h5", "r+") as file:
        file["q"][50] = np.nan
    assert femflex("plot", "run.h5", "q", "-o", "q.png")[0] == 0
    with open_run("run.h5") as run, pytest.raises(ValueError, match=r"t = 2\.5 s"):
        run.finite("q")
