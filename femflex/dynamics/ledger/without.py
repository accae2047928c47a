"""A model with something switched off by name: a term of eq. (9), a load, flexibility, or nonlinear strain."""

from __future__ import annotations

import warnings
from dataclasses import replace
from difflib import get_close_matches
from typing import TYPE_CHECKING

import numpy as np

from femflex.body import FlexibleBody, StrainTensors
from femflex.dynamics.forces.force_term import force_terms
from femflex.dynamics.layout.pool import aligned
from femflex.dynamics.layout.records import body_records, header_record
from femflex.dynamics.ledger.by_source import DRIVES, SWITCHED, TERMS, term_names
from femflex.dynamics.ledger.equation_terms import BY_NAME
from femflex.dynamics.ledger.ledger import place_and_cancel
from femflex.dynamics.ledger.rows import FIRST_PRESCRIBED, SPARE
from femflex.dynamics.workspace import Workspace
from femflex.system import Effector, System
from femflex.warning import PhysicsWarning

if TYPE_CHECKING:
    from femflex.dynamics.model import Model


FLEXIBILITY = "flexibility"
NONLINEAR = "nonlinear_strain"

LOOPS, CONSTRAINTS, VARYING = "loops/", "constraints/", "varying/"
SHORT = {"K1": "elastic", "K2": "elastic_K2", "K3": "elastic_K3"}


def linearised_body(body: FlexibleBody, varies: bool = False) -> FlexibleBody:
    """The body to first order: no cubic and quartic strain, and nothing that follows its bending.

    varies: a function writes all of its shapes, so that those that follow are kept, and do not move.
    """
    linear = StrainTensors(body.strain.V1, body.strain.f0)
    body = replace(body, slaves=0.0 * body.slaves) if varies else body.without_slaves()
    markers = {name: replace(marker, axis=np.zeros(3)) for name, marker in body.markers.items()}
    return replace(body, strain=linear, markers=markers)


def has_nonlinear_strain(body: FlexibleBody) -> bool:
    """Whether a body's strain is of more than first order, or shapes follow its bending."""
    return not body.strain.is_linear or bool(body.slaves.any())


def switchable_names(model: Model) -> list[str]:
    """Everything that can be switched off in the model."""
    system = model.system
    flexible = [name for name in system.order if system.bodies[name].n_modes]
    pieces = {piece for parts in system.segments.values() for piece in parts}
    flexible = [*(name for name in flexible if name not in pieces), *system.segments]
    fixed_items = [f"{term.folder}/{item}" for term in force_terms() for item in term.fixed(system)]
    fixed = ("inertia", *fixed_items, *(name for name in term_names(system) if name.startswith(DRIVES)))
    names = [name for name in term_names(system) if name not in fixed and name not in model.omitted]
    if model.constraints is not None:
        names += model.constraints.paths
    names += [f"{term.folder}/{item}" for term in force_terms() for item in term.others(system)]
    names = [name for name in names if name not in model.omitted]
    if NONLINEAR not in model.omitted and any(has_nonlinear_strain(body) for body in system.bodies.values()):
        names.append(NONLINEAR)
    names += [VARYING + name for name in system.varying]
    return [*names, *([FLEXIBILITY] if flexible else []), *(f"{FLEXIBILITY}/{name}" for name in flexible)]


def resolve_name(model: Model, name: str) -> tuple[str, ...]:
    """Return the full names of parts that can be switched off.

    A load may be named alone, stiffness as K1; effectors of one kind together, as in "solar_pressure".
    """
    names = switchable_names(model)
    name = SHORT.get(name, name)
    for full in (name, *(folder + name for folder in folders())):
        if full in names:
            return (full,)
    effectors = (effector for effector in model.system.effectors if isinstance(effector, Effector))
    paths = (f"effectors/{effector.name}" for effector in effectors if effector.kind.replace(" ", "_") == name)
    if of_kind := tuple(path for path in paths if path in names):
        return of_kind
    if name == "inertia":
        reason = "'inertia' cannot be switched off: without it there is no motion to solve for."
    elif name.startswith(DRIVES):
        reason = f"{name!r} cannot be switched off: it is the force that the prescribed motion requires."
    elif name in model.omitted:
        reason = f"{name!r} is switched off already."
    else:
        absent = name in TERMS or name in (FLEXIBILITY, NONLINEAR)
        reason = (
            "cannot be switched off: this system has none" if absent else "is not something that can be switched off"
        )
        match = closest_name(name, names)
        reason = f"{name!r} {reason}" + (f"; did you mean {match!r}?" if match else ".")
    raise ValueError(
        f"{reason} Known here are {', '.join(names)}." if names else f"{reason} Nothing can be switched off here."
    )


def folders() -> tuple[str, ...]:
    """Return the first parts of the names of items that may be named alone."""
    return (*(f"{term.folder}/" for term in force_terms()), LOOPS, CONSTRAINTS, VARYING)


def closest_name(name: str, known_names: list[str]) -> str:
    """The known name that is meant by another one, in full where its last part alone would not do; "" for none."""
    short = {full.partition("/")[2]: full for full in known_names if "/" in full}
    matches = get_close_matches(name, [*known_names, *short], n=1)
    return short.get(matches[0], matches[0]) if matches else ""


def without_named(system: System, name: str) -> System:
    """The system without the thing; itself where the compiled equations leave it out."""
    if name in BY_NAME:
        change = BY_NAME[name].without
        return system if change is None else change(system)
    if name == NONLINEAR:
        return replace(
            system,
            bodies={key: linearised_body(body, key in system.varying) for key, body in system.bodies.items()},
            varying={key: variation.with_frozen("strain") for key, variation in system.varying.items()},
        )
    if name.startswith(VARYING):
        return replace(system, varying={key: v for key, v in system.varying.items() if VARYING + key != name})
    for term in force_terms():
        if name.startswith(f"{term.folder}/"):
            return term.without_item(system, name.removeprefix(f"{term.folder}/"))
    if name.startswith(LOOPS):
        return replace(system, loops=tuple(loop for loop in system.loops if LOOPS + loop.label != name))
    if name.startswith(CONSTRAINTS):
        return replace(system, constraints=tuple(c for c in system.constraints if CONSTRAINTS + c.name != name))
    if name.partition("/")[0] == FLEXIBILITY:
        body = name.partition("/")[2]
        return with_rigid_bodies(system, set(system.segments.get(body, (body,))) if body else set(system.bodies))
    return system


def with_rigid_bodies(system: System, names: set[str]) -> System:
    """Return the system with those bodies rigid in their undeformed shape."""
    return replace(
        system,
        bodies={name: rigid_copy(body) if name in names else body for name, body in system.bodies.items()},
        varying={key: v.for_rigid_body(system.bodies[key]) if key in names else v for key, v in system.varying.items()},
        delta0={name: value for name, value in system.delta0.items() if name not in names},
        ddelta0={name: value for name, value in system.ddelta0.items() if name not in names},
    )


def without_reactions(system: System, omitted: tuple[str, ...]) -> System:
    """Return the system without reactions of joints, where terms are left out of the equations they follow from."""
    terms_left_out = [name for name in omitted if name in SWITCHED]
    if not (system.reactions and terms_left_out):
        return system
    warnings.warn(
        "forces in joints are left out of the run: they are those of the full equations, and "
        f"{', '.join(terms_left_out)} is switched off",
        PhysicsWarning,
        stacklevel=3,
    )
    return replace(system, reactions=False)


def rigid_copy(body: FlexibleBody) -> FlexibleBody:
    """The body without its shapes, and so without any stiffness that its strain could leave out."""
    return replace(body.without_slaves().truncated(0), damping=np.zeros((0, 0)), foreshortening=None)


def without_terms(model: Model, omitted: tuple[str, ...]) -> Model:
    """Return the model whose compiled equations leave out those of these terms that are not part of a system."""
    if not any(name in SWITCHED for name in omitted):
        return replace(model, omitted=omitted)
    weights = [0.0 if name in SWITCHED and name in omitted else 1.0 for name in TERMS]
    original, table = model.workspace, model.table.copy()
    numbers = aligned(len(original.numbers) + len(weights))
    numbers[:] = np.concatenate([original.numbers, weights])
    head, bodies = header_record(table), body_records(table)
    head["left_out"] = place_and_cancel.address
    head["kept"], head["left_forces"] = len(original.numbers), original.n_work
    bodies["sprung"], bodies["full"] = 1, 0  # forces act along all joints
    room = (1 + SPARE + FIRST_PRESCRIBED) * model.n_u
    model = replace(model, omitted=omitted)
    return model.with_workspace(Workspace(table, numbers, original.n_work + room, original.varies))
