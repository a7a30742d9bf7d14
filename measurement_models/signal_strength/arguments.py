"""Argument checks of LogNormalRSS."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.signal_strength.envelope import AveragedEnvelope
from arrivals.messages import shown
from arrivals.typing import Float
from arrivals.validation import SMALLEST, count, items, number, real

MOST_NEPER = 300.0  # its exponential, squared, is finite


def per_sensor(name: str, value: ArrayLike, n: int) -> float | Float:
    """Return a finite number, or one for each sensor that cannot be written to.

    Examples
    --------
    >>> per_sensor("sigma", [0.5, 0.7], 3)
    Traceback (most recent call last):
    ValueError: sigma must be a number or have shape (3,); got (2,)
    """
    array = np.array(real(name, value))
    if not (np.abs(array) < MOST_NEPER).all():
        raise ValueError(f"{name} must be finite, at most {MOST_NEPER} Np; got {shown(value)}")
    if array.ndim == 0:
        return number(name, value)
    if array.shape != (n,):
        raise ValueError(f"{name} must be a number or have shape ({n},); got {array.shape}")
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
    entries = tuple(count("position", entry, minimum=0) for entry in items("position", position))
    if len(entries) != 2:
        raise ValueError(f"position must name two entries of the state; got {shown(position)}")
    if len({*entries, amplitude}) != 3:
        raise ValueError(
            f"position and amplitude must be different entries; got {position}, {amplitude}"
        )
    return (entries[0], entries[1]), amplitude


def reading_error(
    sigma: ArrayLike | AveragedEnvelope, n: int
) -> tuple[float | Float | AveragedEnvelope, float, Float]:
    """Return the checked `sigma` of n readings, their bias, Np, and their variances, Np²."""
    bias, variance = 0.0, np.zeros(n)
    if isinstance(sigma, AveragedEnvelope):
        bias, variance[:] = sigma.moments()
        checked: float | Float | AveragedEnvelope = sigma
    else:
        checked = per_sensor("sigma", sigma, n)
        if not np.all(np.asarray(checked) > SMALLEST):
            raise ValueError(f"sigma must be positive; got {shown(sigma)}")
        variance[:] = np.square(checked)
    variance.setflags(write=False)
    return checked, bias, variance
