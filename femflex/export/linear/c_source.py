"""Linear models as C: one source file with its header, and a program that checks them where they are compiled.

The C is that of 1990 and needs no library. Names begin with that of the file. Templates beside this file hold the
functions, for a model of the name `model`.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path

import numpy as np
from scipy.linalg import expm, matrix_balance

from femflex.arrays import Array
from femflex.effectors.constant_commands import stands_for_controller
from femflex.studies.linear import LinearModel, StateSpace
from femflex.studies.linear.linear_model import SecondOrder, second_order
from femflex.system import Effector
from femflex.writing import atomic_file, check_destination

TEMPLATES = Path(__file__).parent
STEPS, CYCLES = 16, 2.0  # of the program's check, and how often the slowest vibration swings in it
LIMIT = 1e-8  # of its differences, over the largest response
KINDS = ("state", "input", "output")
FIRST = """\
extern const double {n}_A[], {n}_B[], {n}_C[], {n}_D[]; /* row by row */
extern const double {n}_y0[]; /* outputs where all states and inputs are zero */
extern const double {n}_scale[]; /* usual sizes of the states beside each other */

/* x_rate = A x + B u */
void {n}_rate(const double *x, const double *u, double *x_rate);
/* y = y0 + C x + D u */
void {n}_output(const double *x, const double *u, double *y);
/* matrices of a step of h seconds with constant inputs, exact; work has {N}_WORK numbers */
void {n}_discretise(double h, double *transition, double *input, double *work);
/* x at the end of such a step */
void {n}_step(const double *transition, const double *input, const double *u, double *x);
"""
SECOND = """
/* Second order: x is q, v and z, one after another; L is the lower factor of M = L L^T.
 *     M v' + (D + G) v + K q + R z = Q u,   q' = v + W q
 */
#define {N}_COORDINATES {n_q} /* of q, and of v */
#define {N}_FURTHER {n_z} /* of z */
extern const double {n}_mass[], {n}_mass_factor[]; /* M, L */
extern const double {n}_damping[], {n}_gyroscopic[], {n}_stiffness[]; /* D, G, K */
extern const double {n}_turning[], {n}_coupling[], {n}_forces[]; /* W, R, Q */
extern const double {n}_modes[]; /* Phi, a column for each mode: q = Phi eta, v = Phi nu, Phi^T M Phi = 1 */
extern const double {n}_modal_damping[], {n}_modal_gyroscopic[], {n}_modal_stiffness[];
extern const double {n}_modal_turning[], {n}_modal_coupling[], {n}_modal_forces[];

void {n}_coordinate_rate(const double *q, const double *v, const double *z, const double *u, double *q_rate,
                         double *v_rate);
void {n}_modal_rate(const double *eta, const double *nu, const double *z, const double *u, double *eta_rate,
                    double *nu_rate);
"""


def write_c(model: StateSpace, path: str | Path, force: bool = False) -> list[str]:
    """Write NAME.c, NAME.h and NAME_test.c of a linear model. Returns what is worth saying, as lines.

    A LinearModel has its second-order form and its modes there too. The program of NAME_test.c returns 0 where the step
    responses agree with femflex's. Raises ValueError for a craft that changes over time, and for a name without a
    letter, and OSError.
    """
    path = Path(path)
    if isinstance(model, LinearModel):
        check_constant(model)
    texts = c_texts(model, path.stem)
    for name in texts:
        check_destination(path.with_name(name), force)
    with ExitStack() as stack:
        for name, text in texts.items():
            stack.enter_context(atomic_file(path.with_name(name), force)).write_text(text)
    names = " ".join(name for name in texts if name.endswith(".c"))
    return [f"with {', '.join(name for name in texts if name != path.name)}; check: cc {names} -lm && ./a.out"]


def c_texts(model: StateSpace, name: str) -> dict[str, str]:
    """The texts of NAME.c, NAME.h and NAME_test.c. Raises ValueError for a name without a letter."""
    word = re.sub(r"\W", "_", name, flags=re.ASCII)
    if not re.match("[A-Za-z]", word):
        raise ValueError(f"{name}: functions in C are named after the file, whose name must begin with a letter")
    form = second_order(model) if isinstance(model, LinearModel) else None
    return {
        f"{name}.h": _header(model, form, word),
        f"{name}.c": _source(model, form, name, word),
        f"{name}_test.c": _test(model, name, word),
    }


def _header(model: StateSpace, form: SecondOrder | None, word: str) -> str:
    wide = len(model.states) + len(model.inputs)
    lines = ["/* Linear model by femflex, in SI: x' = A x + B u, y = y0 + C x + D u", " *"]
    for kind in KINDS:
        for k, (name, unit) in enumerate(_pairs(model, kind)):
            frame = f", {model.frames[name]} axes" if name in model.frames and kind != "state" else ""
            lines.append(f" * {kind:6} {k:3}  {_comment(name)} [{unit}]{frame}")
    lines += [" */", f"#ifndef {word.upper()}_H", f"#define {word.upper()}_H", ""]
    lines += [f"#define {word.upper()}_{kind.upper()}S {len(_pairs(model, kind))}" for kind in KINDS]
    lines += [f"#define {word.upper()}_WORK {4 * wide**2 + 1}", ""]
    lines += [f"extern const char *const {word}_{kind}_names[], *const {word}_{kind}_units[];" for kind in KINDS]
    lines += [f"extern const char *const {word}_{kind}_frames[];" for kind in KINDS[1:]]
    text = "\n".join(lines) + "\n" + FIRST.format(n=word, N=word.upper())
    if form is not None:
        text += SECOND.format(n=word, N=word.upper(), n_q=len(form.mass), n_z=form.coupling.shape[1])
    return text + "\n#endif\n"


def _source(model: StateSpace, form: SecondOrder | None, name: str, word: str) -> str:
    _, (scale, _) = matrix_balance(model.A, permute=False, separate=True) if len(model.A) else (0, (np.zeros(0), 0))
    y0 = model.y0 if isinstance(model, LinearModel) else np.zeros(len(model.outputs))
    arrays = {"A": model.A, "B": model.B, "C": model.C, "D": model.D, "y0": y0, "scale": scale}
    if form is not None:
        modal = form.over_modes()
        keys = ("damping", "gyroscopic", "stiffness", "turning", "coupling", "forces")
        arrays |= {"mass": form.mass, "mass_factor": np.linalg.cholesky((form.mass + form.mass.T) / 2)}
        arrays |= {key: getattr(form, key) for key in keys} | {"modes": form.modes}
        arrays |= {f"modal_{key}": getattr(modal, key) for key in keys}
    lines = ["/* Linear model by femflex; see {name}.h. */", f'#include "{name}.h"', ""]
    for kind in KINDS:
        names, units = (_strings([pair[k] for pair in _pairs(model, kind)]) for k in (0, 1))
        lines += [f"const char *const {word}_{kind}_names[] = {names};"]
        lines += [f"const char *const {word}_{kind}_units[] = {units};"]
        if kind != "state":
            frames = _strings([model.frames.get(name, "") for name, _ in _pairs(model, kind)])
            lines += [f"const char *const {word}_{kind}_frames[] = {frames};"]
    lines += [f"const double {word}_{key}[] = {_numbers(value)};" for key, value in arrays.items()]
    functions = _template("functions.c", word) + ("" if form is None else _template("second_order.c", word))
    return "\n".join(lines) + "\n" + functions


def _test(model: StateSpace, name: str, word: str) -> str:
    y0 = model.y0 if isinstance(model, LinearModel) else np.zeros(len(model.outputs))
    vibrations = model.eigenvalues()
    size = np.abs(vibrations)
    moving = size[size > 1e-6 * size.max(initial=0.0)]
    step = 2.0 * np.pi / float(moving.min()) * CYCLES / STEPS if len(moving) else 1.0
    states = _step_states(model, step)
    expected = np.einsum("os,kis->iko", model.C, states) + model.D.T[:, None, :]
    largest = np.abs(states).max(axis=0, initial=0.0)  # of each state, and of all of its unit: rounding is of that size
    units = np.array([unit for _, unit in model.states])
    for unit in np.unique(units):
        largest[:, units == unit] = largest[:, units == unit].max(axis=1, keepdims=True)
    size = largest @ np.abs(model.C.T) + np.abs(model.D.T) + np.abs(y0)
    head = [
        f"/* Check of {name}.c: cc {name}.c {name}_test.c -lm && ./a.out */",
        "#include <math.h>",
        "#include <stdio.h>",
        f'#include "{name}.h"',
        "",
        f"#define STEP {step!r} /* s */",
        f"#define STEPS {STEPS}",
        f"#define LIMIT {LIMIT!r}",
        f"static const double expected[] = {_numbers(expected + y0)}; /* input, step, output */",
        f"static const double size[] = {_numbers(size)}; /* of the terms of an output, for each input */",
    ]
    return "\n".join(head) + "\n" + _template("test.c", word)


def _step_states(model: StateSpace, step: float) -> Array:
    """States (STEPS, n_in, n) at step, 2 step ... [s] after a unit step of each input."""
    n, n_in = model.B.shape
    wide = np.zeros((n + n_in, n + n_in))
    wide[:n, :n], wide[:n, n:] = model.A, model.B
    return np.array([expm(wide * step * (k + 1))[:n, n:].T for k in range(STEPS)])


def _pairs(model: StateSpace, kind: str) -> Sequence[tuple[str, str]]:
    pairs: Sequence[tuple[str, str]] = getattr(model, f"{kind}s")
    return pairs


def _template(file: str, word: str) -> str:
    text = (TEMPLATES / file).read_text(encoding="utf-8")
    return text.replace("model_", f"{word}_").replace("MODEL_", f"{word.upper()}_")


def _comment(text: str) -> str:
    return text.replace("*/", "* /").replace("\n", " ")


def _strings(texts: Sequence[str]) -> str:
    """The initialiser of an array of strings; ISO C has none without an entry."""
    quoted = ['"' + text.replace("\\", "\\\\").replace('"', '\\"').replace("\n", " ") + '"' for text in texts]
    return "{" + ", ".join(quoted or ['""']) + "}"


def _numbers(values: Array) -> str:
    """The initialiser of an array of doubles, with as many digits as give every number back."""
    flat = [repr(float(value)) for value in np.ravel(values)] or ["0.0"]
    rows = [", ".join(flat[k : k + 6]) for k in range(0, len(flat), 6)]
    return "{\n    " + ",\n    ".join(rows) + "\n}"


def check_constant(model: LinearModel) -> None:
    """Raise ValueError for a craft whose equations change over time, or whose commands the model does not take."""
    system = model.model.system
    remedy = "export the craft itself for co-simulation (femflex export CASE -o NAME.fmu)"
    for name, variation in system.varying.items():
        if not variation.states:
            raise ValueError(f"body {name!r} changes over time, and a linear model in C does not; {remedy}")
    for joint in system.joints:
        if joint.latches:
            raise ValueError(
                f"joint {joint.label!r} latches, which is an event; a linear model in C has none; {remedy}"
            )
    names = {name for name, _ in model.inputs}
    for effector in system.effectors:
        if isinstance(effector, Effector) and stands_for_controller(effector):
            commands = [f"effectors/{effector.name}/{channel}" for channel in effector.channels]
            if missing := [command for command in commands if command not in names]:
                raise ValueError(
                    f"controller {effector.name!r} is sampled, so that it is not part of a linear model; "
                    f"take its commands as inputs too ({', '.join(missing)}), or {remedy}"
                )
