"""Functions as they look near a belief."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from arrivals.typing import Float


class Linearization(NamedTuple):
    """A function near a belief: f(x + d) ≈ mean + matrix d + e, with e ~ (0, excess)."""

    mean: Float
    jacobian: Float
    extra_noise: Float | None = None
    jittered: int = 0  # covariances that needed it on the way

    def noise(self, own: Float) -> Float:
        """Return a noise covariance and the excess."""
        return own if self.extra_noise is None else own + self.extra_noise


def at_each(jacobian: Callable[..., Float], x: Float, *args: float) -> Float:
    """Return the Jacobians at states (..., n), one matrix each.

    Examples
    --------
    >>> at_each(np.diag, np.ones((3, 2))).shape
    (3, 2, 2)
    """
    if x.ndim == 1:
        return jacobian(x, *args)
    return np.stack([at_each(jacobian, state, *args) for state in x])
