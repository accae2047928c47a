"""A shipped case is stiff enough that the implicit method is chosen by itself, and said."""

from pathlib import Path

import pytest

from femflex import pipeline
from femflex.integrate import Esdirk4

CASE = Path(__file__).resolve().parents[1] / "cases" / "stiff_mast.toml"


@pytest.mark.filterwarnings("ignore:run. an output step")
def test_a_stiff_mast_is_integrated_by_the_implicit_method(tmp_path):
    prepared = pipeline.prepare(CASE, tmp_path / "run.h5")
    assert prepared.case.run.integrator == "auto" and isinstance(prepared.integrator, Esdirk4)
    assert prepared.reason.startswith("esdirk4 (implicit, order 4): the highest natural frequency is 300.7 Hz")
