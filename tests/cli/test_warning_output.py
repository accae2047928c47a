"""Warnings on standard error, and tables that are folded."""

from __future__ import annotations

import warnings

import pytest

from femflex.cli.tables import folded_columns, print_table
from femflex.cli.warning_output import gather_warnings, print_warnings, warnings_so_far
from femflex.warning import PhysicsWarning, grouped_texts


def test_warnings_of_one_effect_come_as_one_line():
    bent, fast = "{body_or_joint}: bent by {value} % (limit {limit} %).", "{body_or_joint}: turns at {value} rad/s;"
    given = [
        PhysicsWarning(bent, body_or_joint=name, value=k, limit=5, remedy="Stiffen it")
        for k, name in enumerate("abcde")
    ]
    given += [PhysicsWarning(fast, body_or_joint="a", value=3), UserWarning("no body named")]
    assert grouped_texts(given) == [
        "a: bent by 0 % (limit 5 %). Stiffen it (likewise b, c, d and 1 more, each with its own numbers)",
        "a: turns at 3 rad/s;",
        "no body named",
    ]


def test_two_warnings_of_one_effect_on_one_body_are_both_shown():
    effect = "{body_or_joint}: joint at {place} does not turn."
    given = [PhysicsWarning(effect, body_or_joint="a", place=place) for place in ("tip", "root", "tip")]
    assert grouped_texts(given) == ["a: joint at tip does not turn.", "a: joint at root does not turn."]


def test_a_text_alone_is_left_as_it_is():
    assert str(PhysicsWarning("{value} in braces")) == "{value} in braces"
    assert PhysicsWarning("{value:.1f} %", value=2).value == 2


def test_a_warning_is_told_once_and_only_those_of_femflex(capsys):
    with warnings.catch_warnings():
        gather_warnings()
        for name in ("boom", "boom", "mast"):
            warnings.warn(PhysicsWarning("{body_or_joint}: bends", body_or_joint=name), stacklevel=1)
        warnings.warn("of somebody else", UserWarning, stacklevel=1)
        print_warnings()
        warnings.warn("mast: bends", PhysicsWarning, stacklevel=1)
        print_warnings()
    assert capsys.readouterr().err == "femflex: warning: boom: bends (likewise mast, with its own numbers)\n"
    assert len(warnings_so_far()) == 1


@pytest.mark.parametrize(
    ("widths", "groups"),
    [([4, 10, 60], [[0, 1, 2]]), ([4, 10, 63], [[0, 1], [0, 2]]), ([90], [[0]]), ([4, 90, 3], [[0, 1], [0, 2]])],
)
def test_a_table_is_folded_where_it_is_wider_than_the_screen(widths, groups):
    assert folded_columns(widths, 1, 80) == groups


def test_numbers_stand_to_the_right_under_their_head_where_some_are_missing_too(capsys):
    print_table(["mode", "damping"], [["a", "1.5 %"], ["bending", "none"]])
    assert capsys.readouterr().out.splitlines() == [
        "mode     damping",
        "────────────────",
        "a          1.5 %",
        "bending     none",
        "",
    ]


def test_no_row_of_a_folded_table_is_wider_than_80(capsys):
    print_table(["mode", *"abcdefgh"], [[str(k), *[f"{k}.123456789012"] * 8] for k in range(3)])
    said = capsys.readouterr().out.splitlines()
    assert max(map(len, said)) <= 80 and sum(line.startswith("mode") for line in said) == 2
    assert sum(line.count("2.123456789012") for line in said) == 8
