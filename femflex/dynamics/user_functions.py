"""Faults of users' compiled functions of effectors and varying bodies, which calls as plain Python reveal.

Compiled code checks no place in an array, and answers NaN where a function raises. So every function is called once
before a run, where a place outside its arrays is an error; and where a motion is not finite any more, the first
function that fails there is named with what it raised.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from femflex.arrays import Array, IntArray
from femflex.dynamics.forces.effector_functions import call_sizes, input_size, output_size, plain_call
from femflex.dynamics.forces.effector_records import EFFECTOR, N_EFFECTOR
from femflex.dynamics.forces.effectors import acting_effectors, apply
from femflex.dynamics.layout.records import N_TERM, TERM, body_records, header_record
from femflex.system import Block, Effector, LengthTable, System

if TYPE_CHECKING:
    from femflex.dynamics.model import Model

STEPS_AHEAD = np.append(
    0.0, np.geomspace(1e-16, 1.0, 33)
)  # s, beyond the last state: where a failed step may have looked


class UserCall(NamedTuple):
    """One function as it is called at a state.

    owner    what the function belongs to, as sentences say it
    call     (t, out): calls it as plain Python; raises what it raises, and IndexError outside its arrays
    out      (n,) what stands in its output before the call
    inputs   (m,) what it reads of the motion
    written  (n,) what the compiled function has written; None for a Jacobian, which not every evaluation calls
    """

    owner: str
    call: Callable[[float, Array], None]
    out: Array
    inputs: Array
    written: Array | None

    def error(self, t: float) -> Exception | None:
        """The exception that the function raises as plain Python; None where it raises none."""
        try:
            with np.errstate(all="ignore"), warnings.catch_warnings():
                warnings.simplefilter("ignore")
                self.call(t, self.out)
        except Exception as error:
            return error
        return None


def check_user_functions(model: Model) -> None:
    """Call every user's function at the initial state. Raises ValueError for one that leaves its arrays, and for one
    whose numbers are not finite.
    """
    for function in _evaluated(model.for_run(), 0.0, model.x0) if _has_user_functions(model.system) else ():
        error = function.error(0.0)
        if error is None and not np.isfinite(function.out).all():
            raise ValueError(f"{function.owner} gives numbers that are not finite at the initial state")
        if isinstance(error, IndexError):
            raise ValueError(
                f"{function.owner} reads or writes outside its arrays at the initial state: {error}. Check the indices "
                "against the number of its markers, degrees of freedom, inputs, states, parameters and channels"
            ) from error


def user_function_fault(model: Model, t: float, x: Array) -> tuple[str, Exception | None]:
    """Return a sentence on the first user's function that raises, or is not finite, at the state x (n_x,) or just
    beyond it, and the exception that it raised; "" and None if there is none.
    """
    if not _has_user_functions(model.system):
        return "", None
    model = model.for_run()
    rate = np.nan_to_num(model.state_rate(t, x))
    for h in STEPS_AHEAD:
        for function in _evaluated(model, t + h, x + h * rate):
            if not np.isfinite(function.inputs).all():
                return "", None
            error = function.error(t + h)
            if np.isfinite(function.out if function.written is None else function.written).all() and (
                error is None or function.written is not None
            ):
                continue
            if error is None:
                return f"{function.owner} gives numbers that are not finite", None
            return f"{function.owner} raised {type(error).__name__}: {error}", error
    return "", None


def _has_user_functions(system: System) -> bool:
    written = [variation.write for variation in system.varying.values()]
    return any(_is_python(effector.act) for effector in acting_effectors(system)) or any(map(_is_python, written))


def _is_python(write: Any) -> bool:
    return not isinstance(write, (str, LengthTable)) and not hasattr(write, "address")


def _evaluated(model: Model, t: float, x: Array) -> Iterator[UserCall]:
    """Every user's function, in the order of evaluation, after an evaluation of the model."""
    model.state_rate(t, x)
    table, pool, work = model.workspace.arrays
    z = x[model.n_q + model.n_u :]
    for name, record in zip(model.system.order, body_records(table)[1:], strict=True):
        variation = model.system.varying.get(name)
        if variation is not None and _is_python(variation.write):
            size = Block(variation.whole or model.system.bodies[name], variation.varies).size
            before, written = (array[record["block"] :][:size] for array in (model.workspace.numbers, pool))
            numbers = pool[record["numbers"] :][: len(variation.states) + len(variation.numbers)]
            write: Any = variation.write
            call = partial(_write, getattr(write, "py_func", write), z, numbers)
            owner = f"the function that writes the properties of body {name!r}"
            yield UserCall(owner, call, before.copy(), z, written)
    head = header_record(table)
    terms = table[head["terms"] :][: N_TERM * head["n_terms"]].view(TERM)
    for term in terms[terms["apply"] == apply.address]:
        records = table[term["at"] :][: N_EFFECTOR * term["n"]].view(EFFECTOR)
        for effector, e in zip(acting_effectors(model.system), records, strict=True):
            if _is_python(effector.act):
                yield from _effector_calls(effector, e, z, table, work)


def _effector_calls(effector: Effector, e: np.void, z: Array, table: IntArray, work: Array) -> Iterator[UserCall]:
    """The function of an effector, and its Jacobian."""
    m, f, n, n_z, _, n_c = sizes = call_sizes(effector)
    inputs_read = work[e["seen"] :][: input_size(m, f, n)].copy()
    inputs = header_record(table)["z"] + table[e["inputs"] :][:n]
    inputs_read[18 * m + 2 * f :] = work[inputs]  # effectors at one marker share the place of what they read
    states = z[e["z"] :][:n_z]
    functions: dict[str, Any] = {"effector": effector.act, "the Jacobian of effector": effector.jacobian}
    for kind, function in functions.items():
        if function is not None:
            jacobian = function is effector.jacobian
            size = n_z**2 if jacobian else output_size(m, f, n_z, n_c)
            written = None if jacobian else work[e["out"] :][:size]
            call = partial(_act, plain_call(function, sizes, jacobian), inputs_read, states, effector.parameters)
            yield UserCall(f"{kind} {effector.name!r}", call, np.zeros(size), np.append(inputs_read, states), written)


def _write(write: Callable[..., None], z: Array, numbers: Array, t: float, out: Array) -> None:
    write(t, z.copy(), numbers.copy(), out)


def _act(act: Callable[..., None], inputs: Array, z: Array, parameters: Array, t: float, out: Array) -> None:
    act(t, inputs.copy(), z.copy(), parameters.copy(), out)
