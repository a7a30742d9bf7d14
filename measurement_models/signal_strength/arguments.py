"""What a model of signal strength is given: checked, and in one form."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.signal_strength.envelope import log_envelope_moments
from arrivals.typing import Float
from arrivals.validation import count, number, real


def per_sensor(name: str, value: ArrayLike, n: int) -> float | Float:
    """Return a finite number, or one for each sensor that cannot be written to.

    Examples
    --------
    >>> per_sensor("sigma", [0.5, 0.7], 3)
    Traceback (most recent call last):
    ValueError: sigma must be a number or have shape (3,); got (2,)
    """
    if np.ndim(value) == 0:
        value = number(name, value)
        if not np.isfinite(value):
            raise ValueError(f"{name} must be finite; got {value}")
        return value
    array = np.array(real(name, value))
    if array.shape != (n,):
        raise ValueError(f"{name} must be a number or have shape ({n},); got {array.shape}")
    if not np.isfinite(array).all():
        raise ValueError(f"{name} must be finite; got {array.tolist()}")
    array.setflags(write=False)
    return array


def gains(log_gain: ArrayLike, n: int) -> Float:
    """Return known log gains (..., n) that cannot be written to.

    Examples
    --------
    >>> gains([0.0, 0.1], 3)
    Traceback (most recent call last):
    ValueError: log_gain must have shape (..., 3); got (2,)
    """
    array = np.array(real("log_gain", log_gain))
    if array.ndim not in (1, 2) or array.shape[-1] != n:
        raise ValueError(f"log_gain must have shape (..., {n}); got {array.shape}")
    if not np.isfinite(array).all():
        raise ValueError("log_gain must be finite")
    array.setflags(write=False)
    return array


def entries(
    position: tuple[int, int] | None, amplitude: int | None
) -> tuple[tuple[int, int] | None, int | None]:
    """Return the entries of a state that are x, y and u, all different.

    Examples
    --------
    >>> entries((0, 1), 1)
    Traceback (most recent call last):
    ValueError: position and amplitude must be different entries; got (0, 1), 1
    """
    if amplitude is not None:
        amplitude = count("amplitude", amplitude, minimum=0)
    if position is None:
        return None, amplitude
    entries = tuple(count("position", entry, minimum=0) for entry in position)
    if len(entries) != 2:
        raise ValueError(f"position must name two entries of the state; got {position}")
    if len({*entries, amplitude}) != 3:
        raise ValueError(
            f"position and amplitude must be different entries; got {position}, {amplitude}"
        )
    return (entries[0], entries[1]), amplitude


def moments(
    sigma: float | Float | None, n_snapshots: int, exact: bool, n: int
) -> tuple[float, Float]:
    """Return the bias and the variances of readings."""
    bias, variance = 0.0, np.full(n, 1 / (4 * n_snapshots))
    if sigma is not None:
        variance = np.broadcast_to(np.square(sigma), n).copy()
    elif exact:
        mean, spread = log_envelope_moments(n_snapshots)
        bias, variance = float(mean), np.full(n, float(spread))
    variance.setflags(write=False)
    return bias, variance
