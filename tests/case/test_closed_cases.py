"""Loops and constraints in case files: mistakes get their sentence."""

from pathlib import Path

import pytest

from femflex.case import CaseError, read_case
from femflex.case.builders import build_system

CASES = Path(__file__).parents[2] / "cases"
FOUR_BAR = (CASES / "four_bar.toml").read_text(encoding="utf-8")
SLEIGH = (CASES / "chaplygin_sleigh.toml").read_text(encoding="utf-8")


MISTAKES = [
    (
        FOUR_BAR,
        'pivot = { position = ["2 m"',
        'pivot = { position = ["6 m"',
        "cannot close",
        "bending would move it by",
    ),
    (
        FOUR_BAR,
        'parent = "coupler"\nparent_marker = "tip"',
        'parent = "rocker"\nparent_marker = "tip"',
        "loops[closure]",
        "'rocker' joined to itself",
    ),
    (
        FOUR_BAR,
        'parent = "coupler"\nparent_marker = "tip"',
        'parent = "copler"\nparent_marker = "tip"',
        "loops[closure].parent",
        "did you mean 'coupler'?",
    ),
    (
        FOUR_BAR,
        'parent = "coupler"\nparent_marker = "tip"',
        'parent = "coupler"\nparent_marker = "tp"',
        "loops[closure].parent_marker",
        "no marker of body 'coupler'",
    ),
    (
        FOUR_BAR,
        'name = "closure"',
        'name = "closure"\nangle = 0.3',
        "loops[closure].angle",
        "has no coordinates of its own",
    ),
    (FOUR_BAR, "samples = 1001", 'samples = 1001\nintegrator = "esdirk4"', "run.integrator", "does not hold loops"),
    (SLEIGH, 'body = "sleigh"', 'body = "sleigh"\nparent = "sleigh"', "constraints[blade]", "joined to itself"),
    (SLEIGH, 'kind = "knife_edge"', 'kind = "rolling_disc"\nradius = 0', "constraints[blade].radius", "above 0 m"),
]


@pytest.mark.parametrize(
    ("text", "old", "new", "fragments"), [(t, o, n, f) for t, o, n, *f in MISTAKES], ids=range(len(MISTAKES))
)
def test_mistakes_are_told(tmp_path, text, old, new, fragments):
    assert old in text
    file = tmp_path / "case.toml"
    file.write_text(text.replace(old, new), encoding="utf-8")
    with pytest.raises(CaseError) as told:
        case = read_case(file)
        system = build_system(case)
        from femflex.case.builders.integrator import chosen_integrator
        from femflex.dynamics import compile_system

        chosen_integrator(case, compile_system(system), case.run.times(case.run.duration))
    for fragment in fragments:
        assert fragment in str(told.value)
