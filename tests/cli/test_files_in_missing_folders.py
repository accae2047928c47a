"""Every verb that writes a file says that its folder does not exist before it computes anything."""

from __future__ import annotations

import pytest
from support.small_craft import BOOM, CRAFT

from femflex.dynamics.model import Model

MORE = """
[study]
quantity = { of = "mode_frequency", body = "boom" }
[campbell]
axis = [0, 0, 1]
speeds = ["0 rpm", "10 rpm"]
"""
SWEEP = """
case = "craft.toml"
design = "list"
histories = ["bodies/boom/delta"]
[vary."bodies.hub.mass"]
values = [1, 2]
"""


@pytest.mark.parametrize(
    "command",
    [
        "body craft.toml boom -o {}.h5",
        "campbell craft.toml -o {}.csv",
        "campbell craft.toml -o {}.png",
        "converge craft.toml -o {}.png",
        "equilibrium craft.toml -o {}.h5",
        "linearize craft.toml -o {}.npz",
        "linearize craft.toml -o {}.png",
        "modes craft.toml -o {}.png",
        "new {}.toml",
        "run craft.toml -o {}.h5",
        "stability craft.toml -o {}.csv",
        "sweep sweep.toml -o {}.h5",
        "sweep sweep.toml -o {}.png",
    ],
)
def test_a_missing_folder_is_reported_before_any_work(femflex, tmp_path, monkeypatch, command):
    (tmp_path / "boom.inp").write_text(BOOM)
    (tmp_path / "craft.toml").write_text(CRAFT + MORE)
    (tmp_path / "sweep.toml").write_text(SWEEP)
    for work in ("state_rate", "mass_matrix", "observe"):
        monkeypatch.setattr(Model, work, lambda *a, **k: pytest.fail("it computes first"))
    code, _, error = femflex(*command.format("none/x").split())
    assert code == 2 and "folder none does not exist; make it, or choose another for x." in " ".join(error.split())
