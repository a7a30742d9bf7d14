"""Ends of a line's scan: one direction or two."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from arrivals.measurement_models.arrays.sensor_array import SensorArray
from arrivals.typing import Complex

MAX_COHERENCE_OF_ENDS = 0.1  # of responses at ±90° of a line that count as two directions


def ends_coincide(first: Complex, last: Complex) -> bool:
    """Return True if an array does not resolve the two ends of a line's scan.

    At a spacing of half a wavelength -90 and 90 degrees have one response; slightly below, the
    main lobe of a source at one end reaches the other.

    Parameters
    ----------
    first, last : ndarray, shape (..., n_sensors)
        Steering vectors of the first and the last direction.

    Returns
    -------
    bool
        True if the mean of |aᴴb|² / ‖a‖²‖b‖² is above 0.1.

    Examples
    --------
    >>> doa = [-np.pi / 2, np.pi / 2]
    >>> [ends_coincide(*SensorArray.ula(8, d).steering_vector(doa, 1.0)) for d in (0.5, 0.4)]
    [True, False]
    """
    product = (first.conj() * last).sum(axis=-1)
    norms = (np.abs(first) ** 2).sum(axis=-1) * (np.abs(last) ** 2).sum(axis=-1)
    return bool((np.abs(product) ** 2 / norms).mean() > MAX_COHERENCE_OF_ENDS)


@lru_cache(maxsize=64)
def scan_is_joined(array: SensorArray, wavelengths: tuple[float, ...]) -> bool:
    """Return True if the ends of a line's scan coincide, at several wavelengths on average.

    Parameters
    ----------
    array : SensorArray
        Array of isotropic sensors.
    wavelengths : tuple of float
        Wavelengths, m.

    Returns
    -------
    bool
        False for arrays in a plane or in space.

    Examples
    --------
    >>> [scan_is_joined(SensorArray.ula(8, spacing), (1.0,)) for spacing in (0.5, 0.4)]
    [True, False]
    """
    ends = np.array([-np.pi / 2, np.pi / 2])[:, None]
    is_line = array.dim == 1
    return is_line and ends_coincide(*array.steering_vector(ends, np.asarray(wavelengths)))
