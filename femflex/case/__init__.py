"""Case files: TOML -> checked, typed data in SI -> bodies and System. The only place where units are converted."""

from __future__ import annotations

from femflex.case.case import Case
from femflex.case.read import parse_case, read_case, with_values
from femflex.noun.problems import CaseError, Problem

__all__ = ["Case", "CaseError", "Problem", "parse_case", "read_case", "with_values"]
