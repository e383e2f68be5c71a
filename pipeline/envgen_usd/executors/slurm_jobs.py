"""Tasks as jobs of Slurm, given by submitit; processes of this machine where there is no Slurm."""

import logging
import shutil
import subprocess
import time
import uuid
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import submitit

from envgen_usd.errors import EnvgenError
from envgen_usd.executors.executor import Job, Result, Tasks, code_hash, run_task

DEFAULT_JOBS = 16
"""Jobs of Slurm at a time, where nothing else is said."""
MINUTES = 240
"""Time limit of a job; SBATCH_TIMELIMIT replaces it."""
ATTEMPTS = 5
"""How often jobs are given that end without a result."""
_POLL = 1.0
"""Seconds between looks for results; a larger value asks the file system less often."""
_ASK = 10.0
"""Seconds between questions to Slurm; a larger value spares its controller."""
_LATE = 60.0
"""Seconds after which the result of a job that Slurm no longer has is given up.

A larger value waits longer for slow file systems.
"""


@dataclass(frozen=True)
class SlurmJobs:
    """Jobs of Slurm; each does a share of the tasks, one after another, on one processor.

    Attributes:
        cluster: ``slurm``, ``local``, ``debug`` (in this process), or ``None``: what is there.
        folder: Begins the name of a folder for inputs, results and logs of the jobs, which is
            removed when all have ended well.
        slots: Number of jobs at a time.
    """

    cluster: str | None
    folder: Path
    slots: int

    @staticmethod
    def at(address: str, folder: Path, workers: int) -> "SlurmJobs":
        """Names the cluster.

        Raises:
            EnvgenError: There is no such cluster.
        """
        known = ("auto", "slurm", "local", "debug")
        if address not in known:
            raise EnvgenError(f"--address {address}: of submitit, take one of {', '.join(known)}")
        cluster = None if address == "auto" else address
        return SlurmJobs(cluster, folder, workers or DEFAULT_JOBS)

    def is_alone(self, jobs: int) -> bool:  # noqa: ARG002 - of the interface
        """The jobs of Slurm do all work."""
        return False

    def begun(self, module: str) -> AbstractContextManager["SlurmJobs"]:  # noqa: ARG002 - of the interface
        """Nothing has to be started."""
        return nullcontext(self)

    def run(self, tasks: Tasks[Job, Result], done: Callable[[Result], None]) -> None:
        """Runs shares of the jobs; those that end without a result are given again."""
        count = min(self.slots, len(tasks.jobs))
        shares = [replace(tasks, jobs=tasks.jobs[number::count]) for number in range(count)]
        token = uuid.uuid4().hex
        # Several runs may use one folder at a time, as parts of a map do.
        folder = self.folder.with_name(f"{self.folder.name}.{token}")
        for _ in range(ATTEMPTS):
            if shares:
                shares = self._given(shares, folder, token, done)
        if shares:
            raise EnvgenError(
                f"{len(shares)} jobs ended {ATTEMPTS} times without a result; their logs are in "
                f"{folder}"
            )
        shutil.rmtree(folder, ignore_errors=True)

    def _given(
        self,
        shares: Sequence[Tasks[Job, Result]],
        folder: Path,
        token: str,
        done: Callable[[Result], None],
    ) -> list[Tasks[Job, Result]]:
        """Gives shares as jobs; returns those without a result."""
        # Inputs and results are pickles: nobody else may write them.
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        # It would warn every second where Slurm keeps no accounts.
        logging.getLogger("submitit").setLevel(logging.ERROR)
        executor = submitit.AutoExecutor(folder=folder, cluster=self.cluster)
        executor.update_parameters(
            timeout_min=MINUTES, cpus_per_task=1, slurm_array_parallelism=self.slots
        )
        with executor.batch():
            jobs = [executor.submit(run_task, code_hash(), token, share) for share in shares]
        lost: list[Tasks[Job, Result]] = []
        shares_of = {job.job_id: share for job, share in zip(jobs, shares, strict=True)}
        try:
            for job, results in _ended(jobs, by_slurm=executor.cluster == "slurm"):
                if results is None:
                    lost.append(shares_of[job.job_id])
                for result in results or ():
                    done(result)
        except BaseException:
            for job in jobs:
                job.cancel()
            raise
        return lost


def _ended(jobs: Sequence[Any], *, by_slurm: bool) -> Iterator[tuple[Any, Any]]:
    """Jobs with their results as they end; `None` for the results of a job that was lost.

    submitit learns of a lost job from Slurm's accounts, which not every cluster keeps; the queue
    of jobs, which is always there, no longer has it.
    """
    waiting, asked, missed = list(jobs), time.monotonic(), dict.fromkeys(jobs, 0.0)
    while waiting:
        for job in [job for job in waiting if job.done()]:
            waiting.remove(job)
            yield job, _results(job)
        if by_slurm and time.monotonic() - asked > _ASK:
            queued = _queued()
            for job in [*waiting] if queued is not None else ():
                gone = job.job_id not in (queued or ())
                missed[job] = missed[job] + time.monotonic() - asked if gone else 0.0
                if missed[job] > _LATE:
                    waiting.remove(job)
                    yield job, None
            asked = time.monotonic()
        time.sleep(_POLL if waiting else 0.0)


def _queued() -> frozenset[str] | None:
    """Ids of the user's jobs that wait or run; `None` where Slurm gives no answer."""
    command = ("squeue", "--me", "--array", "--noheader", "--format=%i")
    try:
        said = subprocess.run(command, capture_output=True, text=True, check=True, timeout=_LATE)
    except (OSError, subprocess.SubprocessError):
        return None
    return frozenset(said.stdout.split())


def _results(job: Any) -> Any:  # noqa: ANN401 - the library has no types
    """Results of a job that has ended; `None` where it was lost.

    Raises:
        EnvgenError: The job says why it failed.
    """
    try:
        return job.result()
    except submitit.core.utils.FailedJobError as error:
        last = str(error).strip().splitlines()[-1]
        raise EnvgenError(f"a job of submitit failed: {last}") from error
    except submitit.core.utils.UncompletedJobError:
        return None
