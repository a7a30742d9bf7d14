"""Checks of the initial sources, and warnings."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from arrivals.messages import shown
from arrivals.trackers.rss.belief import Entries, SourceBeliefs
from arrivals.trackers.rss.settings import AmplitudePrior, BirthDeath
from arrivals.typing import Float
from arrivals.validation import covariance, real


def birth_death(births: Any) -> BirthDeath | None:
    """Return the settings of births and deaths, or None for a constant number of sources.

    Examples
    --------
    >>> birth_death(True), birth_death(False)
    (BirthDeath(confirm_steps=3), None)
    """
    if isinstance(births, bool | None):
        return BirthDeath() if births else None
    if not isinstance(births, BirthDeath):
        raise TypeError(f"births must be a BirthDeath, True, False or None; got {shown(births)}")
    return births


def initial_sources(
    x0: ArrayLike | None,
    P0: ArrayLike | None,
    amplitude: AmplitudePrior,
    n: int,
    position: Entries,
) -> SourceBeliefs:
    """Return the initial beliefs of the sources.

    Parameters
    ----------
    x0 : array_like, shape (n_sources, n), or None
        States; None for no source.
    P0 : array_like, shape (n, n) or (n_sources, n, n)
        Their covariance.
    amplitude : AmplitudePrior
    n : int
        Number of entries of a state.
    position : tuple of two int
        Entries of a state that are the position.

    Raises
    ------
    ValueError
        If a shape is wrong, a number is not finite, or a position has no variance.

    Examples
    --------
    >>> initial_sources([[1.0, 2.0]], np.eye(2), AmplitudePrior(mean=9.0), 2, (0, 1)).u
    array([9.])
    """
    if x0 is None:
        without_position(P0, n, position)
        for name, value in (("mean", amplitude.mean), ("variance", amplitude.variance)):
            if np.ndim(value):
                raise ValueError(
                    f"amplitude.{name} must be one number where x0 is None; got {value}"
                )
        return SourceBeliefs.empty(n)
    x = np.atleast_2d(real("x0", x0))
    K = len(x)
    if x.shape != (K, n) or not np.isfinite(x).all():
        raise ValueError(f"x0 must be finite, of shape (n_sources, {n}); got {x.tolist()}")
    if K == 0:
        raise ValueError("x0 must have at least one source; got none: pass None")
    u, v = (_per_source(name, getattr(amplitude, name), K) for name in ("mean", "variance"))
    return SourceBeliefs(x.copy(), _covariances(P0, K, n, position), u, v)


def check_number(
    sources: SourceBeliefs, n_sources: int | None, n_sensors: int, limit: int | None
) -> None:
    """Raise a ValueError if `n_sources` contradicts the initial sources or exceeds a limit."""
    K = len(sources.u)
    if not K and n_sources is not None and n_sources > n_sensors:
        raise ValueError(
            f"n_sources must be at most {n_sensors}, the number of sensors; got {n_sources}"
        )
    if K and n_sources not in (None, K):
        raise ValueError(f"n_sources must be {K}, the sources of x0; got {n_sources}")
    if limit is not None and max(K, n_sources or 0) > limit:
        raise ValueError(
            f"max_sources must be at least {max(K, n_sources or 0)}, the initial number of "
            f"sources; got {limit}"
        )


def without_position(P0: ArrayLike | None, n: int, position: Entries) -> Float:
    """Return the covariance of a new source's state, zero for its position.

    Examples
    --------
    >>> without_position(np.diag([9.0, 2.0, 9.0, 2.0]), 4, (0, 2)).diagonal()
    array([0., 2., 0., 2.])
    """
    if P0 is None:
        if n > 2:
            raise ValueError(
                f"P0 must have shape {(n, n)}; got None: new sources need a covariance of their "
                "velocity"
            )
        return np.zeros((n, n))
    P = real("P0", P0)
    P = covariance("P0", P.mean(axis=0) if P.ndim == 3 else P, n).copy()
    P[position, :] = P[:, position] = 0.0
    return P


def _covariances(P0: ArrayLike | None, K: int, n: int, position: Entries) -> Float:
    if P0 is None:
        raise ValueError("P0 must be the covariance of a source's state if x0 is set; got None")
    P = real("P0", P0)
    P = np.broadcast_to(P, (K, n, n)) if P.shape == (n, n) else P
    if P.shape != (K, n, n):
        raise ValueError(f"P0 must have shape {(n, n)} or {(K, n, n)}; got {P.shape}")
    each = np.stack([covariance("P0", one, n) for one in P])
    if np.linalg.eigvalsh(each[..., position, :][..., position])[:, 0].min() <= 0:
        raise ValueError(f"P0 must have positive variances of the positions; got {P.tolist()}")
    return each


def _per_source(name: str, value: ArrayLike, K: int) -> Float:
    array = np.asarray(value, dtype=np.float64)
    if array.shape not in ((), (K,)):
        raise ValueError(f"amplitude.{name} must be a number or have shape ({K},); got {value!r}")
    return np.array(np.broadcast_to(array, K))


def warn_few_readings(n_readings: int, n_sources: int) -> None:
    """Warn if there are fewer readings than unknowns."""
    if 0 < n_readings < 3 * n_sources:
        _warn(
            f"{n_readings} readings are fewer than the {3 * n_sources} unknowns of "
            f"{n_sources} sources: the estimate depends on the prior"
        )


def warn_initial(theta: Float, sensors: Float) -> None:
    """Warn of few readings, and of initial positions (n_sources, 2) on a sensor."""
    warn_few_readings(len(sensors), len(theta))
    for j, position in enumerate(theta):
        distance = np.hypot(*(sensors - position).T)
        if distance.min() == 0:
            _warn(
                f"source {j} starts on sensor {distance.argmin()}, whose reading then has no "
                "gradient: start it elsewhere"
            )


def warn_unsupported_sources(log_evidence: list[float], K: int) -> None:
    """Warn if the evidence of 0, 1, .. sources is clearly larger for fewer than K.

    Examples
    --------
    >>> warn_unsupported_sources([-90.0, -9.0, -8.0], 2)
    """
    best = int(np.argmax(log_evidence))
    if best < K and log_evidence[K] < log_evidence[best] - 3:
        _warn(f"the readings support {best} sources, not {K}")


def warn_mirror() -> None:
    """Warn that sensors on a line determine a position up to its mirror image."""
    _warn(
        "all sensors are on a line: the mirror image of a position explains the readings as well; "
        "the covariance contains both"
    )


def _warn(message: str) -> None:
    warnings.warn(message, stacklevel=6)
