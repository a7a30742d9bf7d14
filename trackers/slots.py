"""Variable numbers of sources in arrays of one size."""

import numpy as np

from arrivals.typing import Bool, Float, Int


def padded(values: Float | Int | Bool, n: int, filler: float) -> Float:
    """Return the first n values, as floats, followed by fillers up to length n.

    Examples
    --------
    >>> padded(np.array([1.0, 2.0]), 4, np.nan)
    array([ 1.,  2., nan, nan])
    """
    full = np.full(n, filler)
    full[: len(values[:n])] = values[:n]
    return full
