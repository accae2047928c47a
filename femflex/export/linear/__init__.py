"""Linear models for other programs: C source, and FMI 3 for model exchange and co-simulation."""

from __future__ import annotations

from femflex.export.linear.c_source import check_constant, write_c

__all__ = ["check_constant", "write_c"]
