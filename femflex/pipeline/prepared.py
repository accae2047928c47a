"""Preparation of a run: case, system, compiled model, integrator and output times."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from femflex.case import Case
    from femflex.dynamics import Model
    from femflex.dynamics.constraints.initial_corrections import AbsorbedMisfit, CorrectedInitialValue
    from femflex.integrate import Integrator
    from femflex.pipeline.decisions import ResolvedCase
    from femflex.pipeline.recovery_channels import RecoveryChannels
    from femflex.system import Controller, Effector, Part, System, Variation


@dataclass(frozen=True, eq=False)
class Prepared:
    """A run before its first step: case, system, compiled model, integrator and why it was chosen, output times [s].

    resolved: the case with every automatic choice filled in, and the advice for these.
    added_effectors: names of effectors and controllers in addition to those of the case.
    """

    case: Case
    system: System
    model: Model
    integrator: Integrator
    reason: str
    times: NDArray[Any]
    resolved: ResolvedCase
    added_effectors: tuple[str, ...] = ()

    @cached_property
    def corrections(self) -> list[CorrectedInitialValue]:
        """The initial values changed to satisfy the constraints, the largest changes first."""
        from femflex.dynamics.constraints.initial_corrections import initial_corrections

        return initial_corrections(self.model)

    @cached_property
    def absorbed_misfits(self) -> list[AbsorbedMisfit]:
        """The misfits of loops with clearance that moving their markers absorbed."""
        from femflex.dynamics.constraints.initial_corrections import absorbed_misfits

        return [] if self.model.constraints is None else absorbed_misfits(self.model.constraints)

    @cached_property
    def recovery(self) -> RecoveryChannels:
        """The channels of section forces and stresses that the case names."""
        from femflex.pipeline.recovery_channels import recovery_channels

        return recovery_channels(self.case, self.system)

    def load_kernels(self) -> None:
        """Compile the kernels that the run calls, or read them from disk."""
        self.model.observe(self.times[:1], self.model.x0[None])
        getattr(self.integrator, "filler", lambda model: None)(self.model)


def prepare(
    case: Case | str | Path,
    output: str | Path | None = None,
    *,
    force: bool = False,
    resume: bool = False,
    bodies: Mapping[str, Part] | None = None,
    without: Sequence[str] = (),
    effectors: Sequence[Effector | Controller] = (),
    varying: Mapping[str, Variation] | None = None,
    linearised: bool = False,
) -> Prepared:
    """Prepare the run of a case with these bodies or with its own; nothing is written.

    output: the result file; if given, check first that it can be written or resumed
    without: names of what is switched off (see `femflex.dynamics.ledger.without`)
    effectors: effectors and controllers in addition to those of the case
    varying: body name -> Variation, how its properties depend on time
    linearised: the motion of the linear equations (see `femflex.pipeline.linear_motion`)

    Raises as `femflex.run` does for what can be reported before the first step.
    """
    from femflex.advice.advice import warn_of
    from femflex.advice.model_warnings import output_notes
    from femflex.case import Case, read_case
    from femflex.dynamics.implicit.residual import residual
    from femflex.dynamics.observe.observe import observe
    from femflex.integrate import dop853_kernel
    from femflex.kernels.compiled import compile_ahead
    from femflex.pipeline.compiled import compiled
    from femflex.pipeline.decisions import check_periods, refuse_rotation_without_inertia, resolve_choices
    from femflex.pipeline.integrator import case_integrator
    from femflex.pipeline.references import duration_of
    from femflex.pipeline.resumed import check_same_effectors, check_same_model, check_same_times, integrator_of

    case = case if isinstance(case, Case) else read_case(case)
    if resume and output is None:
        raise ValueError("a run is resumed from its file; say which one (`output`)")
    if resume and linearised:
        raise ValueError("found resume and linearised; a linearised run is not resumed, so run it anew")
    if output is not None:
        check_output(case, Path(output), force, resume)
        if resume:
            check_same_effectors(effectors, Path(output))
    loops = (dop853_kernel.fill,) if case.run.integrator in ("auto", "dop853") else ()
    compile_ahead(residual, observe, *loops)  # while this process builds bodies and compiles the equations
    resolved = resolve_choices(case, bodies)
    system = resolved.system
    if effectors or varying:
        variations = {**system.varying, **(varying or {})}
        system = replace(system, effectors=(*system.effectors, *effectors), varying=variations)
        check_periods(system, duration_of(case, system))
    model = compiled(system)
    if without:
        model = model.without(*without)
        system = model.system
    if output is not None and resume:
        check_same_model(model, Path(output))
    times = case.run.times(duration_of(case, system))
    refuse_rotation_without_inertia(resolved)
    resolved = replace(resolved, advice=(*resolved.advice, *output_notes(system, float(times[1] - times[0]))))
    warn_of(resolved.advice)
    begun = ""
    if output is not None and resume:
        check_same_times(times, Path(output))
        begun = integrator_of(Path(output))
    integrator, reason = _linear(model) if linearised else case_integrator(case, model, times, begun)
    reasons = " ".join([reason, *sampling(system)])
    names = tuple(effector.name for effector in effectors)
    return Prepared(case, system, model, integrator, reasons, times, resolved, names)


def _linear(model: Model) -> tuple[Integrator, str]:
    """The linearised motion in place of an integrator. Raises ValueError for a system without one."""
    from femflex.pipeline.linear_motion import LinearMotion, check

    check(model.system)
    return LinearMotion(), "none: linear equations about the equilibrium, by matrix exponentials"


def sampling(system: System) -> list[str]:
    """A sentence on the controllers of each period."""
    periods: dict[float, list[str]] = {}
    for controller in system.controllers:
        periods.setdefault(controller.period, []).append(controller.name)
    return [
        f"Controller {names[0]} is called every {period:g} s, its command constant between."
        if len(names) == 1
        else f"Controllers {', '.join(names)} are called every {period:g} s, their commands constant between."
        for period, names in periods.items()
    ]


def check_output(case: Case, output: Path, force: bool, resume: bool) -> None:
    """Raise OSError when the result file cannot be written there, ValueError when it cannot be resumed."""
    from femflex.case.named_files import check_no_input
    from femflex.pipeline.resumed import is_finished
    from femflex.writing import check_destination

    if not resume:
        check_destination(output, force)
        check_no_input(case, output)
        return
    if is_finished(case, output):
        raise ValueError(f"{output} is complete; there is nothing to resume")
