"""Warnings on standard error, and tables that are folded."""

from __future__ import annotations

import warnings

import pytest

from femflex.cli.grouped_warnings import gather_warnings, grouped, print_warnings, warnings_so_far
from femflex.cli.tables import folded_columns, print_table
from femflex.warning import PhysicsWarning


def test_warnings_of_one_kind_come_as_one_line():
    said = grouped(["a: 4 modes carry 63 %", "b: 6 modes carry 71.5 %", "a: spins too fast", "no body named"])
    assert said == [
        "a: 4 modes carry 63 % (likewise b, with its own numbers)", "a: spins too fast", "no body named"
    ]  # fmt: skip
    many = grouped([f"panel{k}: off by {k} %" for k in range(7)])
    assert many == ["panel0: off by 0 % (likewise panel1, panel2, panel3 and 3 more, each with its own numbers)"]


def test_warnings_of_many_members_of_one_body_come_as_one_line():
    """A wing of 15 properties, each a group whose sides are curved."""
    wing = [f"wing: plate on group 'pid_{k}': {k} of 24 sides are curved by {k / 7} m" for k in range(15)]
    other = ["wing: beam on group 'pid_3': 2 of 24 sides are curved by 1 m", "shell on group 'a' is warped by 2 %"]
    said = grouped([*wing, *other, "shell on group 'b' is warped by 3 %"])
    assert said == [
        wing[0] + " (likewise 'pid_1', 'pid_2', 'pid_3' and 11 more, each with its own numbers)",
        other[0],
        other[1] + " (likewise 'b', with its own numbers)",
    ]


def test_a_warning_is_told_once_and_only_those_of_femflex(capsys):
    with warnings.catch_warnings():
        gather_warnings()
        for text in ("boom: bends", "boom: bends", "mast: bends"):
            warnings.warn(text, PhysicsWarning, stacklevel=1)
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
