"""The interface of executors, and the one for processes of this machine.

All that tasks share are files, which they rename into place. So a task may run on any machine that
has the same files and the same code, and it may run again where a machine was lost.
"""

import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, replace
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any, Generic, Protocol, TypeVar

from envgen_usd.build_manifest import hash_folder
from envgen_usd.errors import EnvgenError
from envgen_usd.idle_options import refuse_idle
from envgen_usd.workers import Workers

NAMES = ("local", "ray", "submitit")
"""Names of executors."""
AUTO = "auto"
"""Address of a cluster that is to be found."""

Job = TypeVar("Job")
Result = TypeVar("Result")


@dataclass(frozen=True)
class Tasks(Generic[Job, Result]):
    """Jobs that one function does in any order, each for a second or longer.

    Attributes:
        run: Called with a job in another process; a function of a module.
        jobs: The jobs.
        start: Called once in each process before its first job, with `shared`.
        shared: Data for each process; small, or the path of a file that all machines see.
        on_gpu: True if the jobs draw: where a cluster has GPUs, they run beside one.
    """

    run: Callable[[Job], Result]
    jobs: Sequence[Job]
    start: Callable[..., None]
    shared: tuple[Any, ...]
    on_gpu: bool = False


class Executor(Protocol):
    """Runs tasks."""

    @property
    def slots(self) -> int:
        """Number of tasks that run at a time."""

    def is_alone(self, jobs: int) -> bool:
        """Tells whether this process does so many jobs by itself."""

    def begun(self, module: str) -> AbstractContextManager["Executor"]:
        """The executor for a block, in which its processes stay and import a module at once."""

    def run(self, tasks: Tasks[Job, Result], done: Callable[[Result], None]) -> None:
        """Runs all jobs; `done` is called in this process with each result, in any order.

        Raises:
            EnvgenError: A job failed for a reason that it names, or its process was lost too often.
        """


@dataclass(frozen=True)
class LocalProcesses:
    """Processes of this machine.

    Attributes:
        workers: Number of processes; 0 uses all processors.
        standing: Those of a block of `begun`.
    """

    workers: int = 0
    standing: Workers | None = None

    @property
    def slots(self) -> int:
        """Number of processes."""
        return self.workers or os.cpu_count() or 1

    def is_alone(self, jobs: int) -> bool:
        """Tells whether one process is enough."""
        return min(self.slots, jobs) <= 1

    @contextmanager
    def begun(self, module: str) -> Iterator["LocalProcesses"]:
        """Starts the processes, unless this one does all work."""
        if self.slots == 1:
            yield self
            return
        with Workers(self.slots) as workers:
            workers.load(module)
            yield replace(self, standing=workers)

    def run(self, tasks: Tasks[Job, Result], done: Callable[[Result], None]) -> None:
        """Runs jobs in processes, or in this process where one is enough."""
        if self.is_alone(len(tasks.jobs)):
            tasks.start(*tasks.shared)
            for job in tasks.jobs:
                done(tasks.run(job))
            return
        if self.standing is not None:
            self.standing.run(tasks.run, tasks.jobs, tasks.start, tasks.shared, done)
            return
        with Workers(min(self.slots, len(tasks.jobs))) as workers:
            workers.run(tasks.run, tasks.jobs, tasks.start, tasks.shared, done)


ALONE = LocalProcesses(1)
"""This process does all jobs."""


def executor_named(name: str, workers: int, address: str, folder: Path) -> Executor:
    """Returns an executor that is ready.

    Args:
        name: One of `NAMES`.
        workers: Number of processes of this machine, or of jobs of Slurm at a time; 0: a default.
        address: Of a Ray cluster, or the cluster of submitit; ``auto`` finds one.
        folder: Takes files of submitit; all machines see it.

    Raises:
        EnvgenError: No such executor, its package is not installed, no cluster answers, or there
            is an address of none.
    """
    if name not in NAMES:
        raise EnvgenError(f"--executor {name}: no such executor; take one of {', '.join(NAMES)}")
    try:
        if name == "ray":
            from envgen_usd.executors.ray_tasks import RayTasks  # noqa: PLC0415

            return RayTasks.at(address)
        if name == "submitit":
            from envgen_usd.executors.slurm_jobs import SlurmJobs  # noqa: PLC0415

            return SlurmJobs.at(address, folder, workers)
    except ModuleNotFoundError as error:
        raise EnvgenError(
            f"--executor {name}: the package {error.name} is not installed; "
            f"pip install 'envgen-usd[{name}]', on all machines"
        ) from error
    refuse_idle({"--address": address != AUTO}, "with --executor local")
    return LocalProcesses(workers)


@dataclass(frozen=True)
class Cluster:
    """Who runs the tasks of a command, as its options say.

    Attributes:
        name: ``local``, ``ray`` or ``submitit``.
        workers: Number of processes, or of jobs of Slurm at a time; 0 uses all processors.
        address: Of the cluster; ``auto`` finds one.
    """

    name: str = "local"
    workers: int = 0
    address: str = AUTO

    def executor(self, folder: Path) -> Executor:
        """The executor, ready for tasks; `folder` takes files of submitit, all machines see it.

        Raises:
            EnvgenError: There is no such executor, or no cluster answers.
        """
        return executor_named(self.name, self.workers, self.address, folder)


@cache
def code_hash() -> str:
    """Hash of the code of the package, which all machines of a build have to share."""
    return hash_folder(Path(str(resources.files("envgen_usd"))), "*.py")


_prepared = ""


def run_task(code: str, token: str, tasks: Tasks[Job, Result]) -> list[Result]:
    """Does jobs in a process of another machine, which may have done others before.

    Args:
        code: `code_hash` of the machine that gives the jobs.
        token: Differs for each value of `start` and `shared`.
        tasks: The jobs.

    Raises:
        EnvgenError: This machine has other code.
    """
    global _prepared  # noqa: PLW0603 - the state of a worker process
    if code != code_hash():
        raise EnvgenError("a machine of the cluster has another version of envgen-usd")
    if _prepared != token:
        tasks.start(*tasks.shared)
        _prepared = token
    return [tasks.run(job) for job in tasks.jobs]
