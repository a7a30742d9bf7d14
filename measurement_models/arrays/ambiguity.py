"""Pairs of directions with equal response."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from arrivals.measurement_models.arrays.plane_waves import PlaneWaves
from arrivals.typing import Complex, Float

MIN_COHERENCE = 0.99  # of two responses that count as equal
FINEST = 1024  # directions of a search at most


@lru_cache(maxsize=256)
def ambiguous_pair(waves: PlaneWaves) -> tuple[float, float] | None:
    """Return the first two directions, rad, of equal response at every frequency, or None.

    Equal is a mean of |aᴴb|² / ‖a‖²‖b‖² over the bins above 0.99. The two endfire directions of a
    line at half a wavelength do not count.

    Examples
    --------
    >>> from arrivals.measurement_models.arrays.sensor_array import SensorArray
    >>> sparse = SensorArray.ula(8, spacing=1.0)
    >>> np.rad2deg(ambiguous_pair(PlaneWaves(sparse, [1.0]))).round(1)
    array([-90.,   0.])
    >>> ambiguous_pair(PlaneWaves(sparse, [1.0, 1.3])) is None
    True
    """
    if waves.is_line:
        return _pair_of_line(waves)
    return _pair_of_plane(waves)


def _pair_of_line(waves: PlaneWaves) -> tuple[float, float] | None:
    """Search the difference of the sines, the only variable of the coherence."""
    x = waves.array.positions[:, 0]
    reach = waves.wavenumber.max() * max(waves.slowness or (1.0,)) * np.ptp(x)
    apart = np.linspace(0, 2, max(64, min(int(16 * reach), 1 << 16)) + 1)[1:]
    is_ambiguous = _coherence_of_line(waves, apart) > MIN_COHERENCE
    beyond = np.flatnonzero(
        np.logical_not(is_ambiguous).cumsum(),
    )  # past the main lobe
    beyond = beyond[is_ambiguous[beyond] & (apart[beyond] < 2 - 2 / max(reach, 1.0))]
    if len(beyond) == 0:
        return None
    near = apart[beyond[0]] + np.linspace(0, 1, 200) * 2 / max(reach, 1.0)
    best = near[np.argmax(_coherence_of_line(waves, near))]
    return -np.pi / 2, float(np.arcsin(np.clip(best - 1, -1, 1)))


def _coherence_of_line(waves: PlaneWaves, apart: Float) -> Float:
    x = waves.array.positions[:, 0]
    k = np.multiply.outer(waves.slowness or (1.0,), waves.wavenumber)
    sums = np.exp(1j * np.multiply.outer(np.multiply.outer(k, apart), x)).mean(axis=-1)
    return np.asarray((np.abs(sums) ** 2).mean(axis=1).max(axis=0))


def _pair_of_plane(waves: PlaneWaves) -> tuple[float, float] | None:
    """Search all pairs of a grid, and walk up from the best."""
    from scipy.optimize import minimize

    p = waves.array.positions - waves.centre
    phase = waves.wavenumber.max() * max(waves.slowness or (1.0,)) * np.linalg.norm(p, axis=1).max()
    n = min(max(180, int(8 * phase)), FINEST)
    angle = -np.pi + 2 * np.pi * np.arange(n) / n
    coherence = _coherence(waves.steering(angle))
    lobe = max(1, int(np.ceil(n / max(phase, 2) / 3)))
    off = np.abs(np.subtract.outer(np.arange(n), np.arange(n)))
    coherence[np.minimum(off, n - off) <= lobe] = 0
    coherence[np.tril_indices(n)] = 0
    around = [np.roll(coherence, shift, axis) for shift in (1, -1) for axis in (0, 1)]
    peaks = np.argwhere((coherence >= np.max(around, axis=0)) & (coherence > 0.5))
    best = peaks[np.argsort(-coherence[tuple(peaks.T)])][:8]

    def unlike(pair: Float) -> float:
        return -float(_coherence(waves.steering(pair))[0, 1])

    for start in sorted(angle[best].tolist()):
        optimum = minimize(unlike, start, method="Nelder-Mead", options={"xatol": 1e-4})
        distance = abs((optimum.x[1] - optimum.x[0] + np.pi) % (2 * np.pi) - np.pi)
        if -optimum.fun > MIN_COHERENCE and distance > angle[lobe] - angle[0]:
            return float(optimum.x[0]), float(optimum.x[1])
    return None


def _coherence(a: Complex) -> Float:
    """Mean |aᴴb|² / ‖a‖²‖b‖² over the bins, of responses (S, F, M, n), the largest of S: (n, n)."""
    a = a / np.maximum(np.linalg.norm(a, axis=2, keepdims=True), 1e-12)
    bins = (np.swapaxes(b.conj(), 1, 2) @ b for b in a.swapaxes(0, 1))  # one at a time: memory
    return np.asarray((sum(np.abs(products) ** 2 for products in bins) / a.shape[1]).max(axis=0))


def in_a_line(waves: PlaneWaves) -> float | None:
    """Return the azimuth, rad, of the line through sensors in a plane or in space, or None.

    Examples
    --------
    >>> from arrivals.measurement_models.arrays.sensor_array import SensorArray
    >>> row = SensorArray([[0.0, 0.0], [1.0, 1.0], [3.0, 3.0]])
    >>> round(np.rad2deg(in_a_line(PlaneWaves(row, [1.0]))))
    45
    """
    if waves.is_line or waves.response is not None:
        return None
    horizontal = (waves.array.positions - waves.centre)[:, :2]
    _, size, axes = np.linalg.svd(horizontal, full_matrices=False)
    if size[-1] > 1e-3 * size[0]:
        return None
    return float(np.arctan2(axes[0, 1], axes[0, 0]) % np.pi)


def check_directions(waves: PlaneWaves) -> None:
    """Raise a ValueError if an array cannot give directions.

    Examples
    --------
    >>> from arrivals.measurement_models.arrays.sensor_array import SensorArray
    >>> check_directions(PlaneWaves(SensorArray.uca(2, 0.5), [1.0]))
    Traceback (most recent call last):
    ValueError: array must have at least 3 sensors for azimuths; got 2
    """
    n, minimum = waves.array.n_sensors, 2 if waves.is_line else 3
    if n < minimum:
        what = "directions" if waves.is_line else "azimuths"
        raise ValueError(f"array must have at least {minimum} sensors for {what}; got {n}")
    if not waves.is_line and (azimuth := in_a_line(waves)) is not None:
        along = np.rad2deg(azimuth)
        one, other = (f"{(along + side) % 360:.0f}" for side in (30, -30))
        raise ValueError(
            f"array is collinear ({n} sensors): azimuths {one} and {other} degrees are ambiguous. "
            "Pass 1-D positions to estimate directions from broadside"
        )
