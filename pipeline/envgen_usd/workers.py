"""Runs jobs in child processes, which never outlive this process."""

import importlib
import multiprocessing
import os
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from types import TracebackType
from typing import Any, TypeVar

from envgen_usd.errors import EnvgenError
from envgen_usd.interrupts import interrupts_held_back

Job = TypeVar("Job")
Result = TypeVar("Result")

_SAFE_PATH = "PYTHONSAFEPATH"
_EARLY = 4
"""Processes that start before there are jobs; each takes 0.3 GB."""


class Workers:
    """Child processes that do jobs of one kind after another; the first jobs start them.

    A failure or an interrupt within the ``with`` block ends all of them at once.
    """

    def __init__(self, count: int) -> None:
        """Prepares so many processes."""
        self._count = count
        self._children: set[multiprocessing.process.BaseProcess] = set()
        self._kinds = 0
        context = multiprocessing.get_context("spawn")
        # Creating the queues starts Python's resource tracker, which unblocks SIGINT: the
        # processes start in another block.
        with interrupts_held_back(), _safe_path():
            self._pool = ProcessPoolExecutor(count, context, _watch_parent)

    def __enter__(self) -> "Workers":
        """Returns itself."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Ends the processes, after their jobs or at once."""
        if error is not None:
            self._stop()
        self._pool.shutdown()

    def _stop(self) -> None:
        for child in self._children:
            child.terminate()
        self._pool.shutdown(wait=True, cancel_futures=True)

    def load(self, module: str) -> None:
        """Starts the first processes, which import a module while this process goes on.

        The others start when there are jobs for them.
        """
        self._submitted(_import, [module] * min(self._count, _EARLY))

    def run(
        self,
        run: Callable[[Job], Result],
        jobs: Sequence[Job],
        start: Callable[..., None],
        shared: tuple[Any, ...],
        done: Callable[[Result], None],
    ) -> None:
        """Runs jobs in parallel; after a failure, the processes do no more.

        Args:
            run: Called with a job in a child process.
            jobs: Jobs to run.
            start: Called in each child process before its first job, with `shared`.
            shared: Data for each child process; small, since it goes with each job.
            done: Called in this process with each result, in the order of completion.

        Raises:
            EnvgenError: A child process was killed.
        """
        self._kinds += 1
        work = [(self._kinds, start, shared, run, job) for job in jobs]
        try:
            for future in as_completed(self._submitted(_do, work)):
                done(future.result())
        except BaseException as error:
            # The caller may tidy up what they were writing.
            self._stop()
            if isinstance(error, BrokenProcessPool):
                raise EnvgenError(
                    "a worker process was killed, perhaps for lack of memory; run the same command "
                    "again to resume, if need be with fewer --workers"
                ) from error
            raise

    def _submitted(self, run: Callable[[Any], Any], jobs: Sequence[Any]) -> list[Any]:
        before = set(multiprocessing.active_children())
        try:
            with interrupts_held_back(), _safe_path():
                return [self._pool.submit(run, job) for job in jobs]
        finally:
            self._children |= set(multiprocessing.active_children()) - before


@contextmanager
def _safe_path() -> Iterator[None]:
    """Processes that start within import nothing from the working folder: it may be anybody's."""
    before = os.environ.get(_SAFE_PATH)
    os.environ[_SAFE_PATH] = "1"
    try:
        yield
    finally:
        if before is None:
            del os.environ[_SAFE_PATH]
        else:
            os.environ[_SAFE_PATH] = before


_kind = 0


def _do(work: tuple[int, Callable[..., None], tuple[Any, ...], Callable[[Any], Any], Any]) -> Any:  # noqa: ANN401 - handed on
    """Does a job, after what its kind needs in this process."""
    global _kind  # noqa: PLW0603 - the state of a worker process
    kind, start, shared, run, job = work
    if _kind != kind:
        start(*shared)
        _kind = kind
    return run(job)


def _import(module: str) -> None:
    importlib.import_module(module)


def _watch_parent() -> None:
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    """Ends this process after its parent has ended, e.g. by SIGKILL."""
    parent = multiprocessing.parent_process()
    assert parent is not None
    parent.join()
    os._exit(1)
