"""Runs jobs in child processes, which never outlive this process."""

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
    """Runs jobs in parallel; a failure or an interrupt ends all processes at once.

    Args:
        run: Called with a job in a child process.
        jobs: Jobs to run.
        count: Number of processes.
        start: Called once in each child process, with `shared`.
        shared: Data for each child process; keep it small, as interrupts wait for the start.
        done: Called in this process with each result, in the order of completion.

    Raises:
        EnvgenError: A child process was killed.
    """
    context = multiprocessing.get_context("spawn")
    before = set(multiprocessing.active_children())
    # Two blocks: creating the queues starts Python's resource tracker, which unblocks SIGINT.
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
                "a worker process was killed, perhaps for lack of memory; run the same command "
                "again to resume, if need be with fewer --workers"
            ) from error
        raise
    pool.shutdown()


def _start(start: Callable[..., None], *shared: Any) -> None:  # noqa: ANN401 - handed on
    threading.Thread(target=_end_with_parent, daemon=True).start()
    start(*shared)


def _end_with_parent() -> None:
    """Ends this process after its parent has ended, e.g. by SIGKILL."""
    parent = multiprocessing.parent_process()
    assert parent is not None
    parent.join()
    os._exit(1)
