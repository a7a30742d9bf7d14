"""Plausibility of an array's size: lengths in another unit show against the wavelengths."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from arrivals.measurement_models import SensorArray
from arrivals.recordings.choice.limits import BandLimits, alias_frequency
from arrivals.recordings.choice.spectrum import MeanSpectrum

MOST_WAVELENGTHS = 5.0  # between neighbours, at the lowest given frequency
LEAST_WAVELENGTHS = 0.02  # of the whole array, at the highest
MOST_ALIASES = 50.0  # alias limits in half the rate
LEAST_SHARE = 0.05  # of the power of a recording in the band that an array can use
CURE = 'if lengths are not in m, add unit = "cm" (or mm, in, ft, km) to the array file'
CHECK = "check the lengths and the unit of the array file"


def implausible_size(
    array: SensorArray, frequencies: Sequence[float], limits: BandLimits | None = None,
    rate: float | None = None, spectrum: MeanSpectrum | None = None,
) -> str | None:  # fmt: skip
    """Return a message if aperture and wavelengths can hardly belong together, else None.

    Neighbouring elements lie more than 5 wavelengths apart at all frequencies; or the whole array
    is less than a 50th of a wavelength at all; or, with frequencies chosen below the alias limit,
    this limit is less than a 50th of half the rate, or less than 5 % of the power lies in the band.

    Parameters
    ----------
    array : SensorArray
        The array.
    frequencies : sequence of float
        Frequencies at which it is used, Hz.
    limits : BandLimits, optional
        Band that was chosen; None if frequencies or a band were given.
    rate : float, optional
        Samples per second, Hz.
    spectrum : MeanSpectrum, optional
        Spectrum of the recording.

    Returns
    -------
    str or None
        One line with its cure.

    Examples
    --------
    >>> print(implausible_size(SensorArray.uca(8, radius=4.6, speed=343.0), [2000.0]))
    ... # doctest: +ELLIPSIS
    neighbouring elements of the array are 3.52 m apart, 20.5 wavelengths at 2000 Hz: if lengths ...
    >>> implausible_size(SensorArray.uca(8, radius=0.046, speed=343.0), [2000.0])
    """
    if array.speed is None or array.n_sensors < 2 or not len(frequencies):
        return None
    alias = alias_frequency(array)
    neighbours = f"neighbouring elements of the array are {array.speed / (2 * alias):.3g} m apart"
    lowest, highest = min(frequencies), max(frequencies)
    apart = lowest / (2 * alias)  # wavelengths
    if apart > MOST_WAVELENGTHS:
        return f"{neighbours}, {apart:.3g} wavelengths at {lowest:g} Hz: {CURE}"
    aperture = float(np.linalg.norm(np.ptp(array.positions, axis=0)))
    extent = aperture * highest / array.speed
    if extent < LEAST_WAVELENGTHS:
        size = f"the whole array is {aperture:.3g} m wide, {extent:.2g} wavelengths"
        return f"{size} at {highest:g} Hz: {CHECK}"
    if limits is None or rate is None:
        return None
    if rate / (2 * alias) > MOST_ALIASES or _share(spectrum, limits) < LEAST_SHARE:
        usable = f"for frequencies below {limits.high:.3g} Hz, of {rate / 2:g} Hz in the recording"
        return f"{neighbours}, {usable}: {CURE}"
    return None


def _share(spectrum: MeanSpectrum | None, limits: BandLimits) -> float:
    """Return the share of the power below the upper limit."""
    if spectrum is None or not spectrum.power.any():
        return 1.0
    return float(spectrum.power[spectrum.frequency <= limits.high].sum() / spectrum.power.sum())
