"""Runs jobs in processes of their own, which never outlive this one."""

import multiprocessing
import os
import threading
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from typing import Any, TypeVar

from envgen_usd.errors import EnvgenError
from envgen_usd.interrupts import interrupts_held_back

Job = TypeVar("Job")
Result = TypeVar("Result")


def run_in_workers(  # noqa: PLR0913, PLR0917 - what a pool is made from
    run: Callable[[Job], Result],
    jobs: Sequence[Job],
    count: int,
    start: Callable[..., None],
    shared: tuple[Any, ...],
    done: Callable[[Result], None],
) -> None:
    """Runs jobs; if one fails or the user interrupts, the others are ended at once.

    Args:
        run: Called with a job in one of the processes.
        jobs: What there is to do.
        count: Number of processes.
        start: Called once in each process, with `shared`.
        shared: Small: while a process starts, nothing hears an interrupt.
        done: Called here with each result, in the order in which they come.

    Raises:
        EnvgenError: A process was ended from outside.
    """
    context = multiprocessing.get_context("spawn")
    before = set(multiprocessing.active_children())
    # Two blocks: making the queues starts Python's resource tracker, which lets SIGINT through.
    with interrupts_held_back():
        pool = ProcessPoolExecutor(count, context, _start, (start, *shared))
    try:
        with interrupts_held_back():
            futures = [pool.submit(run, job) for job in jobs]
        for future in as_completed(futures):
            done(future.result())
    except BaseException as error:
        for child in set(multiprocessing.active_children()) - before:
            child.terminate()
        pool.shutdown(wait=True, cancel_futures=True)
        if isinstance(error, BrokenProcessPool):
            raise EnvgenError(
                "a worker process was ended from outside, perhaps for want of memory; the same"
                " command goes on from here, with fewer --workers if need be"
            ) from error
        raise
    pool.shutdown()


def _start(start: Callable[..., None], *shared: Any) -> None:  # noqa: ANN401 - handed on
    threading.Thread(target=_end_with_parent, daemon=True).start()
    start(*shared)


def _end_with_parent() -> None:
    """Ends this process when the one that started it is gone, e.g. killed."""
    parent = multiprocessing.parent_process()
    assert parent is not None
    parent.join()
    os._exit(1)
