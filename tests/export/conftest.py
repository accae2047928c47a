"""The slewed craft that several files export."""

from __future__ import annotations

import pytest

import femflex


@pytest.fixture(scope="session")
def slewed():
    """The system of cases/panel_slew.toml."""
    return femflex.build_system(femflex.read_case("cases/panel_slew.toml"))
