"""A body through a file and back, bit for bit; files that are none."""

from __future__ import annotations

import os
from dataclasses import replace

import h5py
import numpy as np
import pytest
from support.reduction_examples import bent_boom

from femflex.body import Marker, StrainTensors, rigid_body
from femflex.reduction import ModalDamping, cantilever_modes, load_body, reduce_structure, save_body


@pytest.fixture(scope="module")
def body():
    structure = bent_boom()
    made = reduce_structure(
        structure, cantilever_modes(structure, "start", 4), {"b/c %2F.x": "end"}, ModalDamping(0.01)
    )
    turned = Marker(np.ones(3), np.ones((3, 4)), np.zeros((3, 4)), np.eye(3)[[1, 2, 0]])
    omega = made.omega.copy()
    omega[2] = np.nan
    kinds = ("vibration", "vibration", "constraint", "vibration")
    rng = np.random.default_rng(5)
    strain = StrainTensors(made.strain.V1, rng.normal(size=4), rng.normal(size=20), rng.normal(size=35))
    return replace(made, strain=strain, markers={"zeta": turned, **made.markers}, omega=omega, kinds=kinds)


def same(a, b):
    return a.dtype == b.dtype and a.shape == b.shape and a.tobytes() == b.tobytes()


def test_a_body_comes_back_bit_for_bit(body, tmp_path):
    found = load_body(save_body(tmp_path / "boom.h5", body))
    assert found.moments.mass == body.moments.mass
    pairs = [
        (found.moments.first, body.moments.first),
        (found.moments.second, body.moments.second),
        (found.strain.V1, body.strain.V1),
        (found.strain.f0, body.strain.f0),
        (found.strain.V2, body.strain.V2),
        (found.strain.V3, body.strain.V3),
        (found.damping, body.damping),
        (found.omega, body.omega),
        (found.skin.points, body.skin.points),
        (found.skin.shapes, body.skin.shapes),
    ]
    assert all(same(a, np.ascontiguousarray(b)) for a, b in pairs)
    assert found.kinds == body.kinds
    assert list(found.markers) == list(body.markers)
    for name, marker in body.markers.items():
        for part in ("position", "phi", "psi", "orientation"):
            assert same(getattr(found.markers[name], part), np.ascontiguousarray(getattr(marker, part)))
    assert list(found.skin.cells) == list(body.skin.cells)
    assert all(np.array_equal(found.skin.cells[kind], rows) for kind, rows in body.skin.cells.items())


def test_a_rigid_body_without_a_skin_comes_back(tmp_path):
    found = load_body(save_body(tmp_path / "hub.h5", rigid_body(3.0, np.diag([1.0, 2, 2.5]))))
    assert found.n_modes == 0 and found.skin is None and found.kinds == () and found.omega.shape == (0,)
    assert np.array_equal(found.moments.inertia(), np.diag([1.0, 2, 2.5]))
    assert list(found.markers) == ["origin"]


def test_a_file_of_the_first_format_is_a_linear_body(body, tmp_path):
    path = save_body(tmp_path / "old.h5", body)
    with h5py.File(path, "a") as file:
        file.attrs["format_version"] = 1
        del file["strain/V2"], file["strain/V3"]
    assert load_body(path).strain.is_linear
    assert not body.strain.is_linear


def test_the_file_explains_itself(body, tmp_path):
    with h5py.File(save_body(tmp_path / "boom.h5", body)) as file:
        assert file.attrs["format"] == "femflex body" and file.attrs["format_version"] == 2
        assert list(file.attrs["kinds"]) == list(body.kinds)
        bare = []
        file.visititems(
            lambda name, item: (
                bare.append(name)
                if isinstance(item, h5py.Dataset)
                and "cells/" not in name
                and not {"units", "description"} <= set(item.attrs)
                else None
            )
        )
        assert bare == []


def test_an_existing_file_is_kept_unless_forced(body, tmp_path):
    path = tmp_path / "boom.h5"
    path.write_text("precious")
    with pytest.raises(FileExistsError, match=r"boom.h5 exists already; give another name, or force"):
        save_body(path, body)
    assert path.read_text() == "precious"
    save_body(path, body, force=True)
    assert load_body(path).n_modes == 4


def test_a_failure_on_the_way_leaves_nothing_behind(body, tmp_path, monkeypatch):
    def broken(*_):
        raise OSError("disk full")

    monkeypatch.setattr(os, "replace", broken)
    with pytest.raises(OSError, match="disk full"):
        save_body(tmp_path / "boom.h5", body)
    assert list(tmp_path.iterdir()) == []


def test_a_missing_folder_or_file_is_named(body, tmp_path):
    with pytest.raises(FileNotFoundError, match=r"folder .*nowhere does not exist; make it"):
        save_body(tmp_path / "nowhere" / "boom.h5", body)
    with pytest.raises(FileNotFoundError, match=r"body file .*boom.h5 does not exist; make one with `femflex body`"):
        load_body(tmp_path / "boom.h5")


def test_files_that_are_no_bodies_are_refused(body, tmp_path):
    text, other, later, torn = (tmp_path / name for name in ("text.h5", "other.h5", "later.h5", "torn.h5"))
    text.write_text("hello")
    with h5py.File(other, "w") as file:
        file.attrs["format"] = "femflex run"
    save_body(later, body)
    with h5py.File(later, "a") as file:
        file.attrs["format_version"] = 99
    save_body(torn, body)
    with h5py.File(torn, "a") as file:
        del file["moments/second"]
    with pytest.raises(ValueError, match=r"text.h5 is not a femflex body file: it is not HDF5"):
        load_body(text)
    with pytest.raises(ValueError, match=r"other.h5 is not a femflex body file: its format is 'femflex run'"):
        load_body(other)
    with pytest.raises(ValueError, match="has body format 99, and this femflex reads up to 2; use a newer femflex"):
        load_body(later)
    with pytest.raises(ValueError, match=r"torn.h5 is a femflex body file with parts missing"):
        load_body(torn)


def test_a_file_has_what_its_body_has_and_nothing_empty(body, tmp_path):
    places = {place: place.replace("%", "%25").replace("/", "%2F").replace(".", "%2E") for place in body.markers}
    marker = {"axis", "orientation", "phi", "position", "psi", "stretch"}
    part = {"elastic", "fibres", "first", "lever", "linear", "places", "quadratic", "rows", "stress", "weight"}
    rigid = {"damping", "omega", *(f"moments/{name}" for name in ("first", "mass", "second"))}
    rigid |= {f"strain/{name}" for name in ("V1", "V2", "V3", "f0")} | {f"markers/origin/{name}" for name in marker}
    whole = rigid | {f"markers/{place}/{name}" for place in places.values() for name in marker}
    whole |= {f"strain_field/{k}/{name}" for k in range(len(body.strain_field)) for name in part}
    whole |= {"skin/points", "skin/shapes", *(f"skin/cells/{kind}" for kind in body.skin.cells)}
    shortening = {"ignored/mass", *(f"ignored/at/{places[place]}" for place in body.foreshortening.at)}
    bodies = {
        "rigid": (rigid_body(2.0, np.eye(3)), rigid),
        "whole": (body, whole | shortening),
        "bare": (replace(body, foreshortening=None), whole),
    }
    for name, (one, wanted) in bodies.items():
        save_body(tmp_path / f"{name}.h5", one)
        found = set()
        with h5py.File(tmp_path / f"{name}.h5") as file:
            file.visititems(lambda path, item, found=found: found.add(path) if isinstance(item, h5py.Dataset) else None)
        assert found == wanted, name
