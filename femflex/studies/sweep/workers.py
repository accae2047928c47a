"""Members of a sweep on all cores, or on a Dask cluster; a worker that dies ends no other member."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from multiprocessing import active_children
from typing import Any

from femflex.extras import require
from femflex.studies.sweep.member import Outcome, Plan, run_member
from femflex.worker_processes import end_with_parent, worker_context

Todo = Sequence[tuple[int, Mapping[str, Any]]]

KILLED = "its process was killed, as by a lack of memory"
WAIT = 10.0  # for the answer of a scheduler [s]
AHEAD = 2  # submitted members per worker


def outcomes(plan: Plan, todo: Todo, workers: int, scheduler: str | None = None) -> Iterator[Outcome]:
    """The outcomes of members, as they are done: in this process for one worker, else in several."""
    if scheduler is not None:
        with dask_executor(scheduler) as executor:
            yield from _outcomes_of_executor(executor, plan, todo, len(todo))
    elif workers == 1 or len(todo) < 2:
        for number, values in todo:
            yield run_member(plan, number, values)
    else:
        yield from _in_processes(plan, todo, workers)


def _in_processes(plan: Plan, todo: Todo, workers: int) -> Iterator[Outcome]:
    done: set[int] = set()
    try:
        with _pool(workers) as pool:
            for outcome in _outcomes_of_executor(pool, plan, todo, AHEAD * workers):
                done.add(outcome.number)
                yield outcome
    except BrokenProcessPool:  # a process died: run the others one at a time, so that only the failing member is lost
        for number, values in todo:
            if number not in done:
                yield _run_in_own_process(plan, number, values)


def _run_in_own_process(plan: Plan, number: int, values: Mapping[str, Any]) -> Outcome:
    try:
        with _pool(1) as pool, without_main_file():
            return pool.submit(run_member, plan, number, values).result()
    except BrokenProcessPool:
        return Outcome(number, [], [], [], [], KILLED)


@contextmanager
def _pool(workers: int) -> Iterator[ProcessPoolExecutor]:
    """Processes for members; an interrupt does not wait for the members that run."""
    other_processes = set(active_children())
    pool = ProcessPoolExecutor(workers, worker_context([run_member.__module__]), end_with_parent)
    try:
        yield pool
    except BaseException:
        for process in set(active_children()) - other_processes:
            process.terminate()
        pool.shutdown(wait=False, cancel_futures=True)
        raise
    pool.shutdown()


@contextmanager
def without_main_file() -> Iterator[None]:
    """Context in which new processes do not run the script of the sweep again: its module has no file meanwhile."""
    main = sys.modules["__main__"]
    saved = {key: getattr(main, key) for key in ("__file__", "__spec__") if hasattr(main, key)}
    try:
        for key in saved:
            setattr(main, key, None)
        yield
    finally:
        for key, value in saved.items():
            setattr(main, key, value)


def _outcomes_of_executor(executor: Executor, plan: Plan, todo: Todo, max_waiting: int) -> Iterator[Outcome]:
    """Outcomes in the order in which they come; at most `max_waiting` members wait at a time."""
    waiting: set[Future[Outcome]] = set()
    remaining = iter(todo)
    try:
        while True:
            for number, values in remaining:
                with without_main_file():
                    waiting.add(executor.submit(run_member, plan, number, values))
                if len(waiting) >= max_waiting:
                    break
            if not waiting:
                return
            ready, waiting = wait(waiting, return_when=FIRST_COMPLETED)
            for future in ready:
                yield future.result()
    finally:
        for future in waiting:
            future.cancel()


def dask_executor(address: str) -> Executor:
    """The executor of a Dask cluster by its scheduler's address.

    Raises MissingExtra without Dask, and ValueError for a scheduler that does not answer.
    """
    require("sweep", "sweeps on a cluster")
    from distributed import Client

    try:
        client = Client(address, timeout=WAIT)
    except (OSError, TimeoutError, ValueError) as error:
        raise ValueError(f"the Dask scheduler at {address!r} does not answer: {error}") from None
    return client.get_executor()
