"""What a tracker of signal strength is told of its sources at first: checked, and complete."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from arrivals.trackers.rss.belief import Entries, SourceBeliefs, empty
from arrivals.typing import Float
from arrivals.validation import covariance, positive, real


def known_sources(
    x0: ArrayLike | None, P0: ArrayLike | None, mu0: ArrayLike, v0: ArrayLike, n: int, xy: Entries
) -> SourceBeliefs:
    """Return the sources that a constructor was told of.

    Parameters
    ----------
    x0 : array_like, shape (n_sources, n), or None
        States; None for no source.
    P0 : array_like, shape (n, n) or (n_sources, n, n)
    mu0, v0 : float or array_like, shape (n_sources,)
    n : int
        Entries of a state.
    xy : tuple of two int
        Those of the position.

    Raises
    ------
    ValueError
        If a shape is wrong, something is not finite, or a variance is not positive.

    Examples
    --------
    >>> known_sources([[1.0, 2.0]], np.eye(2), 9.0, 0.1, n=2, xy=(0, 1)).u
    array([9.])
    """
    if x0 is None:
        rest(P0, n, xy)
        _number("mu0", mu0)
        positive("v0", _number("v0", v0))
        return empty(n)
    x = np.atleast_2d(real("x0", x0))
    K = len(x)
    if x.shape != (K, n) or not np.isfinite(x).all():
        raise ValueError(f"x0 must be finite, of shape (n_sources, {n}); got {x.tolist()}")
    u, v = _of_each("mu0", mu0, K), _of_each("v0", v0, K)
    if not (v > 0).all():
        raise ValueError(f"v0 must be positive; got {v.tolist()}")
    return SourceBeliefs(x.copy(), _covariances(P0, K, n, xy), u, v)


def rest(P0: ArrayLike | None, n: int, xy: Entries) -> Float:
    """Return the covariance of a new source's state, zero for its position.

    Examples
    --------
    >>> rest(np.diag([9.0, 2.0, 9.0, 2.0]), 4, (0, 2)).diagonal()
    array([0., 2., 0., 2.])
    """
    if P0 is None:
        if n > 2:
            raise ValueError(f"P0 must be given, shape {(n, n)}: how fast new sources may be")
        return np.zeros((n, n))
    P = real("P0", P0)
    P = covariance("P0", P.mean(axis=0) if P.ndim == 3 else P, n).copy()
    P[xy, :] = P[:, xy] = 0.0
    return P


def _covariances(P0: ArrayLike | None, K: int, n: int, xy: Entries) -> Float:
    if P0 is None:
        raise ValueError("x0 needs P0, the covariance of a source's state")
    P = real("P0", P0)
    P = np.broadcast_to(P, (K, n, n)) if P.shape == (n, n) else P
    if P.shape != (K, n, n):
        raise ValueError(f"P0 must have shape {(n, n)} or {(K, n, n)}; got {P.shape}")
    each = np.stack([covariance("P0", one, n) for one in P])
    if np.linalg.eigvalsh(each[..., xy, :][..., xy])[:, 0].min() <= 0:
        raise ValueError(f"P0 must leave every position uncertain; got {P.tolist()}")
    return each


def _number(name: str, value: Any) -> Any:
    if np.ndim(value):
        raise ValueError(f"{name} must be one number where x0 is None; got {value}")
    return value


def _of_each(name: str, given: ArrayLike, K: int) -> Float:
    value = real(name, given)
    if value.shape not in ((), (K,)) or not np.isfinite(value).all():
        raise ValueError(f"{name} must be a finite number or {K} of them; got {value.tolist()}")
    return np.array(np.broadcast_to(value, K))


def warn_of_few_readings(n_readings: int, n_sources: int) -> None:
    """Warn if readings are fewer than unknowns."""
    if 0 < n_readings < 3 * n_sources:
        _warn(
            f"{n_readings} readings are fewer than the {3 * n_sources} unknowns of "
            f"{n_sources} sources: the prior decides"
        )


def warn_of_places(theta: Float, sensors: Float) -> None:
    """Warn of sources, (n_sources, 2), that start on a sensor."""
    for j, place in enumerate(theta):
        far = np.hypot(*(sensors - place).T)
        if far.min() == 0:
            _warn(
                f"source {j} starts on sensor {far.argmin()}, whose reading then tells no "
                "direction: start it elsewhere"
            )


def warn_of_too_many(evidence: list[float], K: int) -> None:
    """Warn if fits of 0, 1, .. sources say that K are too many.

    Examples
    --------
    >>> warn_of_too_many([-90.0, -9.0, -8.0], 2)
    """
    right = int(np.argmax(evidence))
    if right < K and evidence[K] < evidence[right] - 3:
        _warn(f"the readings tell {right} sources apart, not {K}")


def _warn(message: str) -> None:
    warnings.warn(message, stacklevel=5)
