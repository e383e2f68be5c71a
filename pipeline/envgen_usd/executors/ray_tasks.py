"""Tasks on a Ray cluster, which all see the output folder under one path."""

import os
import uuid
from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import islice

# Ray reports its use to its makers, unless this is set before it is imported.
os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
import ray

from envgen_usd.errors import EnvgenError, one_line
from envgen_usd.executors.executor import Job, Result, Tasks, code_hash, run_task

RETRIES = 5
"""How often a task runs again after its process or its node was lost."""
AHEAD = 4
"""Tasks for each processor that the cluster is given at a time; more take memory."""


@dataclass(frozen=True)
class RayTasks:
    """A Ray cluster that this process is connected to; each task takes one processor.

    Attributes:
        slots: Number of processors of the cluster.
    """

    slots: int

    @staticmethod
    def at(address: str) -> "RayTasks":
        """Connects to a cluster.

        Raises:
            EnvgenError: No cluster answers.
        """
        if not ray.is_initialized():
            try:
                ray.init(address, log_to_driver=False, logging_level="error", namespace="envgen")
            except (ConnectionError, RuntimeError, ValueError) as error:
                raise EnvgenError(
                    f"--address {address}: no Ray cluster answers ({one_line(error)}); start one "
                    "with `ray start --head`, and name its address"
                ) from error
        return RayTasks(max(int(ray.cluster_resources().get("CPU", 1)), 1))

    def is_alone(self, jobs: int) -> bool:  # noqa: ARG002 - of the interface
        """The cluster does all jobs."""
        return False

    def run(self, tasks: Tasks[Job, Result], done: Callable[[Result], None]) -> None:
        """Runs each job as a task.

        A node that is taken for lost may finish a task that another node has begun anew; where
        they meet at a rename, one fails, so tasks are also repeated after errors of files.
        """
        call = ray.remote(run_task).options(
            num_cpus=1, max_retries=RETRIES, retry_exceptions=[OSError]
        )
        code, token = code_hash(), uuid.uuid4().hex
        waiting = (replace(tasks, jobs=(job,)) for job in tasks.jobs)
        pending = [call.remote(code, token, each) for each in islice(waiting, AHEAD * self.slots)]
        try:
            while pending:
                ready, pending = ray.wait(pending)
                pending += [call.remote(code, token, each) for each in islice(waiting, 1)]
                for result in ray.get(ready[0]):
                    done(result)
        except ray.exceptions.RayTaskError as error:
            ray.shutdown()
            raise error.cause if isinstance(error.cause, Exception) else error from error
        except ray.exceptions.RayError as error:
            ray.shutdown()
            raise EnvgenError(
                f"the Ray cluster lost a task {RETRIES + 1} times ({one_line(error)}); run the "
                "same command again to resume"
            ) from error
