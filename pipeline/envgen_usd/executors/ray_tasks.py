"""Tasks on a Ray cluster, which all see the output folder under one path."""

import logging
import os
import socket
import uuid
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, replace
from typing import Any

# Ray reports its use to its makers, unless this is set before it is imported.
os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
import ray

from envgen_usd.errors import EnvgenError, one_line
from envgen_usd.executors.executor import Job, Result, Tasks, code_hash, run_task
from envgen_usd.interrupts import interrupts_held_back

RETRIES = 5
"""How often a task runs again after its process or its node was lost."""
AHEAD = 4
"""Tasks for each processor that the cluster is given at a time; more take memory."""
TO_A_GPU = 4
"""Tasks that draw at a time on one GPU; more keep it busier, and take more of its memory."""
PAUSE = 0.5
"""Longest delay of an interrupt, seconds."""


@dataclass(frozen=True)
class RayTasks:
    """A Ray cluster that this process is connected to; each task takes one processor.

    Where the cluster has GPUs, tasks that draw take a share of one, too. Ray then names the GPU in
    `CUDA_VISIBLE_DEVICES`, and OpenGL draws on it.

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
                _check_address(address)
                with interrupts_held_back():  # Ray would replace their handlers.
                    ray.init(address, log_to_driver=False, logging_level=logging.ERROR)
            except (OSError, RuntimeError, ValueError) as error:
                raise EnvgenError(
                    f"--address {address}: no Ray cluster answers ({one_line(error)}); start one "
                    "with `ray start --head`, and name its address"
                ) from error
        return RayTasks(max(int(ray.cluster_resources().get("CPU", 1)), 1))

    def is_alone(self, jobs: int) -> bool:  # noqa: ARG002 - of the interface
        """The cluster does all jobs."""
        return False

    def begun(self, module: str) -> AbstractContextManager["RayTasks"]:  # noqa: ARG002 - of the interface
        """Nothing has to be started."""
        return nullcontext(self)

    def run(self, tasks: Tasks[Job, Result], done: Callable[[Result], None]) -> None:
        """Runs each job as a task.

        A node that is taken for lost may finish a task that another node has begun anew; where
        they meet at a rename, one fails, so tasks are also repeated after errors of files.
        """
        gpus = 1 / TO_A_GPU if tasks.on_gpu and ray.cluster_resources().get("GPU") else 0
        call = ray.remote(run_task).options(
            num_cpus=1, num_gpus=gpus, max_retries=RETRIES, retry_exceptions=[OSError]
        )
        code, token = code_hash(), uuid.uuid4().hex
        pending: list[Any] = []
        given = 0
        try:
            while pending or given < len(tasks.jobs):
                # An interrupt within Ray's compiled code would become another error.
                with interrupts_held_back():
                    ahead = tasks.jobs[given : given + AHEAD * self.slots - len(pending)]
                    given += len(ahead)
                    shares = (replace(tasks, jobs=(job,)) for job in ahead)
                    pending += [call.remote(code, token, share) for share in shares]
                    ready, pending = ray.wait(pending, timeout=PAUSE)
                    results = [result for each in ray.get(ready) for result in each]
                for result in results:
                    done(result)
        except BaseException as error:
            with interrupts_held_back():
                ray.shutdown()  # ends the tasks
            if isinstance(error, ray.exceptions.RayTaskError) and error.cause is not None:
                raise error.cause from error
            if isinstance(error, ray.exceptions.RayError):
                raise EnvgenError(
                    f"the Ray cluster lost a task {RETRIES + 1} times ({one_line(error)}); run "
                    "the same command again to resume"
                ) from error
            raise


def _check_address(address: str) -> None:
    """Raises an error of the network after seconds, where Ray would try for minutes."""
    host, colon, port = address.rpartition(":")
    if colon and port.isdecimal() and "/" not in host:
        socket.create_connection((host, int(port)), timeout=10).close()
