"""Many runs of one case, with some of its values varied."""

from __future__ import annotations

from femflex.studies.sweep.sweep import Sweep, open_sweep, sweep

__all__ = ["Sweep", "open_sweep", "sweep"]
