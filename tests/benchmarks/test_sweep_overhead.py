"""What a member of a sweep costs beyond the steps of its run, and how much two workers save."""

import re
import time
from pathlib import Path

import numpy as np
import pytest

from femflex.studies.sweep.design import designed
from femflex.studies.sweep.member import Plan, run_member
from femflex.studies.sweep.sweep import planned

DISPERSION = Path(__file__).parents[2] / "cases" / "studies" / "panel_dispersion.toml"
AT_MOST = 5.0  # ms of processor time of a member whose run is two rows
MEMBERS = 60


@pytest.mark.benchmark
def test_a_member_that_differs_in_numbers_costs_less_than_five_milliseconds():
    """The shipped dispersion with a run of 0.1 s: reading its values, checks, model, integrator, outputs."""
    table, plan = planned(DISPERSION)
    text = re.sub(r'duration = "60 s"', 'duration = "0.1 s"', plan.case_text)
    text = re.sub(r"(?ms)^\[(pictures|expect[^\]]*|study)\].*?(?=^\[|\Z)", "", text)
    short = Plan(plan.sweep_text.replace('start = "10 s"', ""), text, plan.case_path)
    spent = []
    for k, values in enumerate(designed(table)[:MEMBERS]):
        begin = time.thread_time()
        assert not run_member(short, k, values).problem
        spent.append(1e3 * (time.thread_time() - begin))
    print(f"\n{np.median(spent[5:]):.2f} ms per member (least {min(spent):.2f}), the first {spent[0]:.0f}")
    assert np.median(spent[5:]) < AT_MOST
