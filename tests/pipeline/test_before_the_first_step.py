"""What is looked at before a run begins: files and names, models kept for the next who asks, large initial bends."""

from __future__ import annotations

import warnings
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from support.random_systems import random_body

from femflex.body import Marker, rigid_body
from femflex.case import parse_case, read_case
from femflex.case.initial import InitialTable
from femflex.pipeline import prepare
from femflex.pipeline.compiled import compiled
from femflex.pipeline.decisions import _large_displacements, build_system, decided
from femflex.system import System, weld
from femflex.warning import PhysicsWarning

HUB = """
[run]
duration = 4
samples = 5
[bodies.hub]
kind = "rigid"
mass = 2
inertia = [3, 4, 5]
[[loads]]
name = "push"
body = "hub"
force = [1, 0, 0]
"""


def test_a_model_is_kept_for_the_system_that_was_asked_for_last():
    one = build_system(parse_case(HUB))
    other = replace(one, loads=())
    model = compiled(one)
    assert compiled(one) is model and model.system is one
    assert compiled(other).system is other and compiled(one) is not model


def test_an_unknown_name_comes_before_a_file_that_is_in_the_way(tmp_path: Path):
    case, output = parse_case(HUB), tmp_path / "a.h5"
    output.write_text("here before")
    for without in ([], ["push"]):
        with pytest.raises(FileExistsError, match=r"a\.h5"):
            prepare(case, output, without=without)
    with pytest.raises(ValueError, match=r"'pusch'.*did you mean '(loads/)?push'"):
        prepare(case, output, without=["push", "pusch"])
    with pytest.raises(ValueError, match="'gravity' cannot be switched off: this system has none"):
        prepare(case, output, without=["gravity"])
    assert prepare(case, output, without=["push"], force=True).model.omitted == ("loads/push",)
    assert output.read_text() == "here before"


def test_what_cannot_be_resumed_is_refused_at_once(tmp_path: Path):
    case = parse_case(HUB)
    with pytest.raises(ValueError) as caught:
        prepare(case, resume=True)
    assert str(caught.value) == "a run is resumed from its file; say which one (`output`)"
    with pytest.raises(ValueError) as caught:
        prepare(case, tmp_path / "a.h5", resume=True, linearised=True)
    assert str(caught.value) == "found resume and linearised; a linearised run is not resumed, so run it anew"


def test_a_prepared_run_has_the_times_and_the_terms_that_were_asked_for():
    found = prepare(parse_case(HUB))
    assert found.times.tolist() == [0, 1, 2, 3, 4] and found.given == () and found.model.omitted == ()
    assert found.moved == [] and found.taken_up == [] and found.recovered.channels == {}
    less = prepare(parse_case(HUB), without=["push"])
    assert less.model.state_rate(0.0, less.model.x0).any() != found.model.state_rate(0.0, found.model.x0).any()
    straight = prepare(parse_case(HUB.replace("force = [1, 0, 0]", "force = [0, 0, 0]")), linearised=True)
    assert straight.integrator.name == "linearised"
    assert straight.reason == "none: linear equations about the equilibrium, by matrix exponentials"


@pytest.mark.parametrize(
    ("size", "strain", "doubtful"),
    [
        ("0.31 m", "linear", True),
        ("0.29 m", "linear", False),
        ("0.31 m", "condensed", False),
    ],
)
def test_a_bend_beyond_a_tenth_of_the_length_is_doubted_where_strain_is_linear(
    write_case: Any, craft: str, size: str, strain: str, doubtful: bool
):
    """The boom is 3 m long, and its tip starts off its place along y."""
    text = craft.replace('[0, "10 mm", 0]', f'[0, "{size}", 0]')
    case = read_case(write_case(text.replace('kind = "flexible"', f'kind = "flexible"\nstrain = "{strain}"')))
    found = [one for one in decided(case, loaded=False).advice if one.decision == "bend" and one.doubt]
    assert [one.body for one in found] == ["boom"] * doubtful
    if doubtful:
        assert found[0].reason == (
            "initial displacement of marker 'tip' of body 'boom' is 0.31 m, 10% of the length 3 m (limit 10%), and its "
            "strain is linear; give it strain = 'condensed', or displace it less"
        )
        assert found[0].value == pytest.approx(0.31 / 3) and found[0].limit == 0.1
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always", PhysicsWarning)
            build_system(case)
        assert sum("initial displacement of marker 'tip'" in str(one.message) for one in caught) == 1


def test_displacements_are_compared_with_the_length_from_the_joint_or_with_that_of_the_table():
    """Of rods 4 m long, held at their middle: 0.2 of the 2 m to the tip, or 0.2 of 3 m along the marker's axes."""
    places = {
        "tip": Marker.rigid([4.0, 0.0, 0.0], n_modes=2),
        "middle": Marker.rigid([2.0, 0.0, 0.0], n_modes=2),
        "turned": Marker.rigid([4.0, 0.0, 0.0], np.eye(3)[[2, 0, 1]], 2),
    }
    rod = replace(random_body(np.random.default_rng(1), 2)[0], markers=places)
    rigid = rigid_body(1.0, np.eye(3), markers={name: Marker.rigid(one.position) for name, one in places.items()})
    tables: dict[str, Any] = {
        "far": {"marker": "tip", "displacement": (0.0, 0.24, -0.32)},
        "near": {"marker": "tip", "displacement": (0.0, 0.1, -0.1)},
        "just": {"marker": "tip", "displacement": (0.0, 0.2, 0.0)},
        "relative": {"marker": "turned", "relative": (0.0, -0.2, 0.0), "length": 3.0},
        "amplitudes": {"amplitudes": (9.0, 9.0)},
        "nothing": None,
        "rigid": {"marker": "tip", "displacement": (0.0, 0.5, 0.0)},
        "elsewhere": {"marker": "tip", "displacement": (0.0, 0.5, 0.0)},
    }
    bodies = {name: rod for name in tables if name != "elsewhere"} | {"rigid": rigid}
    joints = tuple(weld(name, child_marker="middle") for name in bodies)
    case: Any = SimpleNamespace(
        bodies={
            name: SimpleNamespace(initial=None if keys is None else InitialTable.model_construct(**keys))
            for name, keys in tables.items()
        }
    )
    found = {one.body: one for one in _large_displacements(case, System(bodies, joints))}
    assert list(found) == ["far", "relative"]
    assert (found["far"].value, found["far"].limit) == (pytest.approx(0.2), 0.1)
    assert "of body 'far' is 0.4 m, 20% of the length 2 m (limit 10%)" in found["far"].reason
    assert "'turned' of body 'relative' is 0.6 m, 20% of the length 3 m" in found["relative"].reason
