"""Numbers as a few: each as the mean of those near it."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import Any

import numpy as np

from .arrays import Float64Array
from .deferred import deferred

kmeans2: Callable[..., Any] = deferred("scipy.cluster.vq", "kmeans2")


def clustered(values: Float64Array, count: int) -> Float64Array:
    """For each value [N] the centre of its cluster, of so many or fewer (k-means, begun at quantiles)."""
    first = np.unique(np.quantile(values, (np.arange(count) + 0.5) / count))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # that a cluster is empty: equal values leave some so
        centers, labels = kmeans2(values, first, minit="matrix", missing="warn")
    return np.asarray(centers[labels])
