"""Every verb that builds bodies says which strain was chosen for those that do not say it, and why."""

import json

import pytest

BLADE = """
title = "blade"

[run]
duration = 0.2
output_step = 0.05

[attitude]
frame = "spinning"
spin = [0, 0, 2]

[bodies.blade]
kind = "analytic"
length = 1
EA = 1e6
EIy = 1
EIz = 1
GJ = 1
mass_per_length = 1
functions = { y = 2, z = 2, family = "polynomial" }

[[joints]]
kind = "weld"
child = "blade"
child_marker = "root"

[study]
quantity = { of = "peak", channel = "markers/blade.tip/deflection" }
"""
WHY = "strain is condensed: turning at 2 rad/s may raise the first frequency by 1"
VERBS = {
    "check": [],
    "equilibrium": [],
    "modes": ["--bodies"],
    "campbell": ["--speeds", "0, 2", "--modes", "2"],
    "converge": ["--levels", "1,2"],
}


@pytest.mark.sampled(2)
@pytest.mark.parametrize("verb", VERBS)
def test_a_verb_says_the_strain_that_was_chosen_and_why(verb: str, femflex, write_case):
    code, out, _ = femflex(verb, write_case(BLADE), *VERBS[verb])
    assert code == 0 and " ".join(out.split()).count(WHY) == 1


@pytest.mark.sampled(2)
@pytest.mark.parametrize(
    ("verb", "words"),
    [
        ("check", ("bodies", "blade", "note")),
        ("equilibrium", ("bodies", "blade", "note")),
        ("modes", ("blade", "note")),
        ("campbell", ("bodies", "blade", "note")),
        ("converge", ("notes", "blade")),
    ],
)
def test_json_holds_the_same(verb: str, words: tuple[str, ...], femflex, write_case):
    code, out, _ = femflex(verb, write_case(BLADE), *VERBS[verb], "--json")
    data = json.loads(out)
    for word in words:
        data = data[word]
    assert code == 0 and data.startswith(WHY)


@pytest.mark.slow
def test_terms_say_it_of_the_model_that_they_build_again(femflex, write_case):
    assert femflex("run", write_case(BLADE), "-o", "blade.h5", "--no-pictures")[0] == 0
    code, out, _ = femflex("terms", "blade.h5", "--case", write_case(BLADE))
    assert code == 0 and WHY in out


def test_what_a_case_says_itself_is_not_told_as_a_choice(femflex, write_case):
    said = BLADE.replace("mass_per_length = 1\n", 'mass_per_length = 1\nstrain = "condensed"\n')
    code, out, _ = femflex("equilibrium", write_case(said))
    assert code == 0 and "strain is" not in out


@pytest.mark.slow
def test_a_backbone_of_linear_strain_says_that_it_cannot_bend(femflex, write_case):
    said = BLADE.replace("mass_per_length = 1\n", 'mass_per_length = 1\nstrain = "linear"\n')
    _, out, _ = femflex("modes", write_case(said), "--backbone", "1 mm, 1 cm")
    assert out.count("1.00000") == 2
    assert "linear strain: its force is proportional to the amplitude" in out and "strain = 'condensed'" in out
    data = json.loads(femflex("modes", write_case(said), "--backbone", "1 mm", "--json")[1])
    assert data["blade"]["backbone"]["note"].startswith("linear strain")
    condensed = femflex("modes", write_case(BLADE), "--backbone", "1 mm")[1]
    assert "its force is proportional" not in condensed
