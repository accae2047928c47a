"""[stability]: the values of a case over which the stability of its equilibrium or periodic motion is charted."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field, StrictBool, ValidationError, model_validator

from femflex.case.sweep import Scattered, numbers_of
from femflex.noun.problems import CaseError
from femflex.noun.sentences import schema_problems
from femflex.noun.table import Table, refuse
from femflex.noun.values import Count, Duration

RATIOS = ("k_roll", "k_yaw")
MAX_POINTS = 2001  # points along one value


class AxisTable(Table):
    """A value of the case over which stability is charted."""

    between: Annotated[list[Scattered], Field(min_length=2, max_length=2)]
    """First and last value, in one unit."""
    points: Annotated[int, Count(2)] = 41
    """Number of values, evenly spaced."""

    @model_validator(mode="after")
    def _rises(self) -> AxisTable:
        start, end, _ = self.numbers()
        if not start < end:
            refuse(f"found between = {self.between}; the second must be above the first")
        if self.points > MAX_POINTS:
            refuse(f"found {self.points} points; give at most {MAX_POINTS}")
        return self

    def numbers(self) -> tuple[float, float, str]:
        """First and last value and their unit as it is written, "" for plain numbers."""
        return numbers_of(self.between)


class StabilityTable(Table):
    """Stability over one value (a locus) or two values (a chart), as `femflex stability` prints and draws it."""

    of: Literal["equilibrium", "motion"] = "equilibrium"
    """What is judged: the equilibrium by its poles, or the periodic motion by its Floquet multipliers."""
    vary: Annotated[dict[str, AxisTable], Field(min_length=1, max_length=2)]
    """Key path in the case, such as "joints.0.damping", and its range; one or two of them. With `inertia` the keys are
    "k_roll" and "k_yaw"."""
    inertia: str | None = None
    """Rigid body whose moments of inertia give the undeformed craft the inertia ratios
    k_roll = (I_pitch - I_yaw) / I_roll and k_yaw = (I_pitch - I_roll) / I_yaw; I_pitch of the craft stays."""
    period: Duration | None = None
    """Period of the motion. Default: that of the orbit, or one turn of the spinning frame."""
    shooting: StrictBool = False
    """Find the periodic motion near the initial state first. Default: the motion begins at the initial state."""
    without: list[str] = Field(default_factory=list)
    """Terms that a second chart or locus omits, as in `run --without`, such as "flexibility"; drawn in dashed lines."""

    @model_validator(mode="after")
    def _keys_fit_quantity(self) -> StabilityTable:
        ratios = [key for key in self.vary if key in RATIOS]
        if self.inertia is None and ratios:
            refuse(f"found {ratios[0]!r} without inertia; name the body whose moments of inertia change")
        if self.inertia is not None and set(self.vary) != set(RATIOS):
            refuse(f"found inertia with vary of {', '.join(self.vary)}; it goes with k_roll and k_yaw, both")
        if self.of == "equilibrium" and (self.period is not None or self.shooting):
            refuse("found period or shooting with of = 'equilibrium'; they go with of = 'motion'")
        return self


def stability_table(keys: dict[str, Any], origin: str) -> StabilityTable:
    """The table of these keys. Raises CaseError with all its problems; origin: source of the keys, for messages."""
    try:
        return StabilityTable.model_validate(keys)
    except ValidationError as error:
        raise CaseError(origin, schema_problems(StabilityTable, keys, error)) from None
