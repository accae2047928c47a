"""What a run is compared by when it is resumed: the values read and the contents of files, not how they are written."""

import json
from dataclasses import replace

import h5py
import numpy as np
import pytest
from support.small_craft import BOOM, CRAFT

from femflex.body import rigid_body
from femflex.case import read_case
from femflex.case.model_inputs import model_values
from femflex.case.named_files import check_no_input
from femflex.mesh import read_mesh, write_mesh
from femflex.pipeline.file_digests import content_digest, file_digests
from femflex.reduction import save_body

TABLE = "time [s],tz [N m]\n0,0\n1,2\n2,0\n"
TRACK = "time [s],angle [deg]\n0,0\n1,1\n2,3\n3,4\n4,4\n"
FILES = (
    CRAFT[: CRAFT.index("[[loads]]")].replace('kind = "weld"\nparent = "hub"', 'kind = "revolute"\nparent = "hub"')
    + 'axis = "z"\nmotion.angle = { kind = "sum", parts = [{ kind = "table", file = "track.csv", column = "angle" }, '
    '{ kind = "constant", value = "1 deg" }] }\n'
    + '[[loads]]\nname = "push"\nbody = "hub"\ntable = "push.csv"\n'
    + '[bodies.box]\nkind = "file"\nfile = "box.h5"\n[[joints]]\nkind = "weld"\nparent = "hub"\nchild = "box"\n'
)


@pytest.fixture
def folder(tmp_path):
    """A case with a mesh, a load table, a motion table and a body file."""
    (tmp_path / "boom.inp").write_text(BOOM)
    (tmp_path / "push.csv").write_text(TABLE)
    (tmp_path / "track.csv").write_text(TRACK)
    save_body(tmp_path / "box.h5", rigid_body(3.0, np.eye(3)))
    (tmp_path / "craft.toml").write_text(FILES)
    return tmp_path


def inputs(folder):
    case = read_case(folder / "craft.toml")
    return model_values(case), file_digests(case)


def changed(folder):
    """Runs what is inside and says which files count as changed since."""
    before = inputs(folder)

    def after():
        values, files = inputs(folder)
        assert values == before[0]
        return {where for where in files if files[where] != before[1][where]}

    return after


KEYS = ["bodies.boom.mesh", "bodies.box.file", "joints[0].motion.angle", "loads[0].table"]


def test_every_file_is_found_under_its_key(folder):
    values, files = inputs(folder)
    names = ["boom.inp", "box.h5", "track.csv", "push.csv"]
    assert [files[key]["file"] for key in KEYS] == names and sorted(files) == KEYS
    assert json.loads(json.dumps(values)) == values


@pytest.mark.parametrize(
    ("file", "old", "new", "key"),
    [
        ("boom.inp", "4, 3.0, 0.0", "4, 3.0001, 0.0", "bodies.boom.mesh"),
        ("boom.inp", "TIP\n4", "TIP\n3", "bodies.boom.mesh"),
        ("push.csv", "1,2\n", "1,2.1\n", "loads[0].table"),
        ("push.csv", "tz [N m]", "tz [mN m]", "loads[0].table"),
        ("push.csv", "tz", "ty", "loads[0].table"),
        ("track.csv", "3,4\n", "3,4.1\n", "joints[0].motion.angle"),
        ("track.csv", "[deg]", "[rad]", "joints[0].motion.angle"),
    ],
)
def test_a_change_of_a_file_that_matters_is_seen(folder, file, old, new, key):
    after = changed(folder)
    text = (folder / file).read_text()
    assert old in text
    (folder / file).write_text(text.replace(old, new))
    assert after() == {key}


@pytest.mark.parametrize(
    ("file", "old", "new"),
    [
        ("boom.inp", "*NODE", "** a remark\n*NODE"),
        ("boom.inp", "4, 3.0, 0.0", "4,  3.00, 0"),
        ("push.csv", "0,0\n1,2\n2,0", "# a remark\n0.0,0\n1,2.0\n2,0"),
        ("push.csv", TABLE, "tz [N m],time [s]\n0,0\n2,1\n0,2\n"),
        ("track.csv", "0,0\n", "0.0,0.00\n"),
    ],
)
def test_another_way_to_write_the_same_is_no_change(folder, file, old, new):
    after = changed(folder)
    text = (folder / file).read_text()
    assert old in text
    (folder / file).write_text(text.replace(old, new))
    assert after() == set()


def test_an_included_mesh_counts(folder):
    (folder / "nodes.inp").write_text(BOOM[: BOOM.index("*ELEMENT")])
    (folder / "boom.inp").write_text("*INCLUDE, INPUT=nodes.inp\n" + BOOM[BOOM.index("*ELEMENT") :])
    after = changed(folder)
    (folder / "nodes.inp").write_text((folder / "nodes.inp").read_text().replace("2, 1.0", "2, 1.1"))
    assert after() == {"bodies.boom.mesh"}


def test_a_mesh_written_as_text_and_as_binary_is_the_same(folder):
    mesh = read_mesh(folder / "boom.inp")
    (folder / "craft.toml").write_text(FILES.replace("boom.inp", "boom.msh"))
    write_mesh(folder / "boom.msh", mesh)
    after = changed(folder)
    write_mesh(folder / "boom.msh", mesh, binary=False)
    assert after() == set()
    write_mesh(folder / "boom.msh", replace(mesh, points=mesh.points * [1, 1.01, 1] + [0, 1e-3, 0]))
    assert after() == {"bodies.boom.mesh"}


def test_a_body_file_counts_by_its_numbers(folder):
    after = changed(folder)
    save_body(folder / "box.h5", rigid_body(3.0, np.eye(3)), force=True)
    with h5py.File(folder / "box.h5", "r+") as file:
        file.attrs["femflex_version"] = "0.0.9"
    assert after() == set()
    save_body(folder / "box.h5", rigid_body(3.0, np.diag([1, 1, 1 + 1e-12])), force=True)
    assert after() == {"bodies.box.file"}


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('"70 GPa"', "70e9  # in SI"),
        ("mass = 200\ninertia = [120, 100, 140]", "inertia = [120, 100, 140.0]\nmass = '200 kg'"),
        ('title = "hub with a boom"', 'title = "another"\n[pictures]\npicture = true\n'),
        ('duration = "10 s"', 'duration = "20 s"'),
        ('value = "1 deg"', "value = 0.017453292519943295"),
        ("[sections.tube]", '[expect.x]\nof = "value"\nchannel = "q"\ncomponent = 0\nbelow = 1\n[sections.tube]'),
    ],
)
def test_what_does_not_matter_in_the_text_is_no_change(folder, old, new):
    before = inputs(folder)
    assert old in FILES
    (folder / "craft.toml").write_text(FILES.replace(old, new))
    assert inputs(folder) == before


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('"70 GPa"', '"70.0000001 GPa"'),
        ("rates = [", 'frame = "inertial"\nrates = ['),
        ("modes = 4", "modes = 5"),
        ('value = "1 deg"', 'value = "1.1 deg"'),
        ("output_step = 0.05", "output_step = 0.05\nrtol = 1e-9"),
        ('damping = { ratio = "0.5 %" }', 'damping = { ratio = "0.6 %" }'),
        ('axis = "z"', 'axis = "y"'),
    ],
)
def test_every_key_of_the_model_counts(folder, old, new):
    before, _ = inputs(folder)
    assert old in FILES
    (folder / "craft.toml").write_text(FILES.replace(old, new, 1))
    assert inputs(folder)[0] != before


def test_a_file_of_the_case_is_not_written_over(folder):
    case = read_case(folder / "craft.toml")
    for name in ("boom.inp", "box.h5", "track.csv", "push.csv", "craft.toml"):
        with pytest.raises(ValueError, match=rf"{name} is an input of this case and would be lost"):
            check_no_input(case, folder / name)


def test_a_digest_tells_shapes_kinds_and_names_apart():
    one = np.arange(6.0)
    different = [one, one.reshape(2, 3), one.astype(int), one + 1e-15, {"a": one}, {"b": one}, [one], (one, one), None]
    assert len({content_digest(value) for value in different}) == len(different)
    assert content_digest({"a": 1, "b": 2}) == content_digest({"b": 2, "a": 1})
    with pytest.raises(TypeError, match="no digest of a function"):
        content_digest(test_a_digest_tells_shapes_kinds_and_names_apart)
