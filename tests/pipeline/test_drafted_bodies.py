"""Bodies whose joints are left open are drafted for that choice, made once, and say what is doubtful of them once."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from pathlib import Path

import pytest

import femflex.assembly.bodies as assembly
from femflex.case import read_case
from femflex.pipeline.decisions import decided
from femflex.warning import PhysicsWarning


@pytest.fixture
def reductions(monkeypatch: pytest.MonkeyPatch) -> list[tuple[str, ...]]:
    """Kinds of the shapes of every body that is reduced from then on."""
    found: list[tuple[str, ...]] = []
    reduce = assembly.reduce_structure
    monkeypatch.setattr(
        assembly,
        "reduce_structure",
        lambda structure, modes, *rest: found.append(modes.kinds) or reduce(structure, modes, *rest),
    )
    return found


@pytest.mark.parametrize("strain", ["linear", "condensed"])
def test_a_body_with_open_joints_is_reduced_once_with_the_shapes_that_they_ask_for(
    strain, craft, write_case, reductions
):
    text = craft.replace('mesh = "boom.inp"', f'mesh = "boom.inp"\nstrain = "{strain}"')
    text = text.replace("mass = 200\ninertia = [120, 100, 140]", "mass = 2\ninertia = [1.2, 1.0, 1.4]")
    found = decided(read_case(write_case(text)))
    assert len(reductions) == 1
    kinds = found.system.bodies["boom"].kinds  # those of sections that turn come after them
    assert kinds[: len(reductions[0])] == reductions[0]
    said = next(one for one in found.advice if one.decision == "joints")
    assert said.choice and set(said.choice) <= {"ROOT", "TIP"}
    assert reductions[0].count("attachment") == sum(map(len, said.choice.values()))


GAUGE = '\n[sensors.gauge]\nkind = "strain"\nbody = "boom"\npoint = [1.0, 0, 0]\ncomponent = "axial"\nperiod = 0.1\n'
RECOVERY = "\n[bodies.boom.recovery.root]\nposition = [0.1, 0, 0]\n"


@pytest.mark.parametrize("measured", [GAUGE, RECOVERY])
def test_a_body_whose_strain_is_measured_is_no_draft(measured, craft, write_case):
    found = decided(read_case(write_case(craft + measured)))
    assert found.system.bodies["boom"].strain_field


def test_what_is_doubtful_of_a_body_is_said_once_though_it_is_drafted_first(craft, write_case: Callable[..., Path]):
    path = write_case(craft.replace('mesh = "boom.inp"', 'mesh = "boom.inp"\nstrain = "linear"'))
    (path.parent / "boom.inp").write_text((path.parent / "boom.inp").read_text().replace("3.0, 0.0", "3000.0, 0.0"))
    with warnings.catch_warnings(record=True) as given:
        warnings.simplefilter("always", PhysicsWarning)
        decided(read_case(path))
    assert sum("the mesh spans 3000 m" in str(one.message) for one in given) == 1
