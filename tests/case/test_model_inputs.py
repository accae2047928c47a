"""A resumed run compares the values read and the contents of files, not their spelling."""

from dataclasses import replace

import numpy as np
import pytest
from support.small_craft import BOOM, CRAFT

from femflex.body import rigid_body
from femflex.case import read_case
from femflex.case.named_files import check_no_input, model_values
from femflex.mesh import read_mesh, write_mesh
from femflex.pipeline.file_digests import file_digests
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


def changed_files(old_inputs, new_inputs):
    """Keys of the files that count as changed."""
    assert set(new_inputs[1]) == set(old_inputs[1])
    return {key for key in new_inputs[1] if new_inputs[1][key] != old_inputs[1][key]}


MESH, TRACKED, PUSHED = "bodies.boom.mesh", "joints[0].motion.angle", "loads[0].table"


@pytest.mark.parametrize(
    ("file", "old", "new", "keys"),
    [
        ("boom.inp", "4, 3.0, 0.0", "4, 3.0001, 0.0", {MESH}),
        ("boom.inp", "TIP\n4", "TIP\n3", {MESH}),
        ("push.csv", "1,2\n", "1,2.1\n", {PUSHED}),
        ("push.csv", "tz [N m]", "tz [mN m]", {PUSHED}),
        ("push.csv", "tz", "ty", {PUSHED}),
        ("track.csv", "3,4\n", "3,4.1\n", {TRACKED}),
        ("track.csv", "[deg]", "[rad]", {TRACKED}),
        ("boom.inp", "*NODE", "** a remark\n*NODE", set()),
        ("boom.inp", "4, 3.0, 0.0", "4,  3.00, 0", set()),
        ("push.csv", "0,0\n1,2\n2,0", "# a remark\n0.0,0\n1,2.0\n2,0", set()),
        ("push.csv", TABLE, "tz [N m],time [s]\n0,0\n2,1\n0,2\n", set()),
        ("track.csv", "0,0\n", "0.0,0.00\n", set()),
    ],
)
def test_only_other_numbers_of_a_file_count(folder, file, old, new, keys):
    old_inputs = inputs(folder)
    text = (folder / file).read_text()
    assert old in text
    (folder / file).write_text(text.replace(old, new))
    new_inputs = inputs(folder)
    assert new_inputs[0] == old_inputs[0] and changed_files(old_inputs, new_inputs) == keys


def test_mesh_counts_by_its_contents_through_includes_and_in_binary(folder):
    mesh = read_mesh(folder / "boom.inp")
    old_inputs = inputs(folder)
    (folder / "nodes.inp").write_text(BOOM[: BOOM.index("*ELEMENT")].replace("2, 1.0", "2, 1.1"))
    (folder / "boom.inp").write_text("*INCLUDE, INPUT=nodes.inp\n" + BOOM[BOOM.index("*ELEMENT") :])
    assert changed_files(old_inputs, inputs(folder)) == {MESH}
    (folder / "craft.toml").write_text(FILES.replace("boom.inp", "boom.msh"))
    write_mesh(folder / "boom.msh", mesh)
    old_inputs = inputs(folder)
    write_mesh(folder / "boom.msh", mesh, binary=False)
    assert changed_files(old_inputs, inputs(folder)) == set()
    write_mesh(folder / "boom.msh", replace(mesh, points=mesh.points * [1, 1.01, 1] + [0, 1e-3, 0]))
    assert changed_files(old_inputs, inputs(folder)) == {MESH}


@pytest.mark.parametrize(
    ("old", "new", "counts"),
    [
        ('"70 GPa"', "70e9  # in SI", False),
        ("mass = 200\ninertia = [120, 100, 140]", "inertia = [120, 100, 140.0]\nmass = '200 kg'", False),
        ('title = "hub with a boom"', 'title = "another"\n[pictures]\npicture = true\n', False),
        ('duration = "10 s"', 'duration = "20 s"', False),
        ('value = "1 deg"', "value = 0.017453292519943295", False),
        ('"70 GPa"', '"70.0000001 GPa"', True),
        ("modes = 4", "modes = 5", True),
        ('value = "1 deg"', 'value = "1.1 deg"', True),
        ("output_step = 0.05", "output_step = 0.05\nrtol = 1e-9", True),
        ('axis = "z"', 'axis = "y"', True),
    ],
)
def test_only_other_values_of_the_model_count(folder, old, new, counts):
    old_inputs = inputs(folder)
    assert old in FILES
    (folder / "craft.toml").write_text(FILES.replace(old, new, 1))
    new_inputs = inputs(folder)
    assert (new_inputs[0] != old_inputs[0]) is counts and (counts or new_inputs == old_inputs)


def test_input_of_a_case_is_not_overwritten(folder):
    case = read_case(folder / "craft.toml")
    for name in ("boom.inp", "box.h5", "track.csv", "push.csv", "craft.toml"):
        with pytest.raises(ValueError):
            check_no_input(case, folder / name)
    check_no_input(case, folder / "new.h5")
