"""Craft as FMUs of FMI 3.0: linear models in C, and whole crafts with Python inside."""

from __future__ import annotations

from femflex.export.fmi.craft import write_craft_fmu
from femflex.export.fmi.linear import write_linear_fmu

__all__ = ["write_craft_fmu", "write_linear_fmu"]
