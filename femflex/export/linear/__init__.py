"""Linear models for other programs: C source, and FMI 3 for model exchange and co-simulation."""

from __future__ import annotations

from femflex.export.linear.c_source import write_c
from femflex.export.linear.constant import check_constant

__all__ = ["check_constant", "write_c"]
