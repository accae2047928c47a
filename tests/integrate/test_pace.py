"""How long a block of rows may take."""

import pytest

from femflex.integrate import pace
from femflex.integrate.pace import BlockTime


def test_blocks_are_longer_where_their_taker_needs_long(monkeypatch):
    """0.2 s, or five times what observing and writing the last one took, up to 1 s."""
    now = [100.0]
    monkeypatch.setattr(pace, "perf_counter", lambda: now[0])
    block = BlockTime()
    assert block.stop_at() - now[0] == pytest.approx(0.2)
    for taken, allowed in ((0.01, 0.2), (0.1, 0.5), (3.0, 1.0), (0.0, 0.2)):
        block.handed()
        now[0] += taken
        assert block.stop_at() - now[0] == pytest.approx(allowed)
