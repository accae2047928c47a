"""Cases with other values at their key paths."""

import tomllib

import numpy as np
import pytest

from femflex.case import CaseError, read_case, with_values
from femflex.case.changed import toml_text
from femflex.case.read import parse_case
from femflex.pipeline import prepare


@pytest.fixture
def case(write_case):
    return read_case(write_case())


def test_values_change_and_the_rest_stays(case):
    other = with_values(case, {"bodies.hub.mass": 410.0, "run.duration": "2 min", "bodies.boom.reduction.modes": 3})
    assert other.bodies["hub"].mass == 410.0 and case.bodies["hub"].mass == 200.0
    assert other.run.duration == 120.0
    assert other.bodies["boom"].reduction.modes == 3
    assert other.bodies["hub"].inertia == case.bodies["hub"].inertia
    assert other.path == case.path


def test_the_text_of_a_changed_case_says_what_it_is(case):
    other = with_values(case, {"bodies.hub.mass": np.float64(410.0), "bodies.hub.markers.left.position": np.ones(3)})
    again = parse_case(other.text, case.path)
    assert again.bodies["hub"].mass == 410.0
    assert again.model_dump() == other.model_dump()


def test_keys_that_the_file_leaves_out_can_be_given(case):
    assert with_values(case, {"run.integrator": "esdirk4"}).run.integrator == "esdirk4"


def test_entries_of_lists_go_by_number(case):
    assert with_values(case, {"joints.0.name": "root"}).joints[0].name == "root"
    with pytest.raises(
        CaseError, match=r"'joints.7.name' is no key of .*: joints is a list of 1; give a number from 0"
    ):
        with_values(case, {"joints.7.name": "root"})


def test_paths_that_lead_nowhere_are_refused_with_what_is_known(case):
    with pytest.raises(CaseError, match=r"'bodies.hbu.mass' is no key of .*has no 'hbu'; did you mean 'hub'\\?"):
        with_values(case, {"bodies.hbu.mass": 1.0})
    with pytest.raises(CaseError, match="masss"):
        with_values(case, {"bodies.hub.masss": 1.0})
    with pytest.raises(CaseError, match="which holds no keys"):
        with_values(case, {"bodies.hub.mass.value": 1.0})
    with pytest.raises(CaseError, match="mass"):
        with_values(case, {"bodies.hub.mass": -1.0})
    with pytest.raises(CaseError, match="a case holds numbers, texts, lists and tables"):
        with_values(case, {"bodies.hub.mass": object()})


def test_a_text_is_read_back_as_it_was_written():
    raw = {
        "title": 'two "words" and ünits \U0001f6f0 of\ttwo\nlines',
        "on": True,
        "run": {"duration": "10 s", "step": 1e-3},
        "bodies": {"hub": {"mass": 4, "markers": {"left side": {"position": [0.5, 0, -1e-20]}}}, "empty": {}},
        "joints": [{"kind": "weld", "stops": [{"at": 1.0}]}, {"kind": "free"}],
        "mixed": [[1, 2.5], ["a"]],
    }
    assert tomllib.loads(toml_text(raw)) == raw


def test_a_run_is_prepared_without_a_file(case):
    prepared = prepare(with_values(case, {"bodies.hub.mass": 410.0}))
    assert prepared.system.bodies["hub"].moments.mass == 410.0
    with pytest.raises(ValueError, match="say which one"):
        prepare(case, resume=True)


def test_tables_that_stay_are_those_of_the_file_and_not_of_a_changed_copy(case):
    """Equal to the whole text checked anew, whichever tables are taken over as they were read."""
    copy = case.model_copy(update={"run": case.run.model_copy(update={"duration": 7.0})})
    other = with_values(copy, {"bodies.hub.mass": 410.0, "joints.0.name": "root"})
    assert other.run.duration == case.run.duration and other.bodies["boom"] is case.bodies["boom"]
    assert other.model_dump() == parse_case(other.text, case.path).model_dump()
    with pytest.raises(CaseError, match=r"bodies\.hub\.mass: found -1 kg"):
        with_values(case, {"bodies.hub.mass": -1})
