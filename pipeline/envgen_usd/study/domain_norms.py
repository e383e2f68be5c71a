"""Batch norm of synthetic and real pictures apart, as Chang et al. 2019 norm domains.

Mean and deviation of a mixed batch are those of neither kind, while pictures that are scored are
real. So each half of a batch is normed by itself, and the trained network has the means of real
pictures. Weights are shared.
"""

from collections.abc import Iterator
from contextlib import contextmanager

from torch import nn
from torch.nn.modules.batchnorm import _BatchNorm

from envgen_usd.study.learners import Lesson
from envgen_usd.study.training_options import TrainingOptions

_LEAST = 2
"""Least number of pictures whose mean is taken: layers behind a pooling have a value for each."""


def synthetic_apart(lesson: Lesson, options: TrainingOptions) -> int:
    """Number of synthetic pictures at the begin of each batch that are normed apart, or 0."""
    real = options.batch // 2
    mixed = len(lesson.real) > 0 and len(lesson.synthetic) > 0
    even = options.batches == "even" and options.schedule == "joint" and real >= _LEAST
    return options.batch - real if options.batch_norm == "domain" and mixed and even else 0


@contextmanager
def running_means_kept(network: nn.Module) -> Iterator[None]:
    """Inside of the block, training leaves the means for scoring as they are."""
    norms = [each for each in network.modules() if isinstance(each, _BatchNorm)]
    before = [each.track_running_stats for each in norms]
    for each in norms:
        each.track_running_stats = False
    try:
        yield
    finally:
        for each, was in zip(norms, before, strict=True):
            each.track_running_stats = was
