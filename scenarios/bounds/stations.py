"""Posterior Cramér-Rao bound of moving positions that several arrays receive."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models import ArraySnapshot, Station
from arrivals.motion_models import ConstantVelocity
from arrivals.typing import Float
from arrivals.validation import covariance, instance, items, real

SLOPE_STEP = 1e-5  # rad, of central differences of the response


def bearing_information(measurement: ArraySnapshot, doa: ArrayLike, power: ArrayLike) -> Float:
    """Return the information of one step's snapshots on the directions of all present sources.

        J_k = 2N P_k/σ² Σ_f d_kᴴ P⊥ d_k,  d = ∂a/∂β,  P⊥ = I - A A⁺

    It is the mean of the deterministic information over amplitudes that are uncorrelated, of power
    P_k; number of sources and noise variance are known, amplitudes are not.

    Parameters
    ----------
    measurement : ArraySnapshot
        Array, bins, number of snapshots N, and variance σ² of white noise.
    doa : array_like, shape (..., n_sources)
        Directions, rad; NaN for an absent source.
    power : array_like, shape (..., n_sources)
        Mean powers at one sensor; NaN for an absent source.

    Returns
    -------
    ndarray, shape (..., n_sources)
        rad⁻²; 0 for an absent source.

    Raises
    ------
    ValueError
        If the shapes differ, or the noise is coherent.

    References
    ----------
    Stoica and Nehorai, "MUSIC, maximum likelihood, and Cramér-Rao bound", IEEE Trans. ASSP 37(5),
    1989, (2.11).

    Examples
    --------
    A circle of 8 of radius 0.65 λ: d_kᴴ P⊥ d_k = M (2π 0.65)²/2.

    >>> from arrivals.measurement_models import SensorArray
    >>> circle = ArraySnapshot(SensorArray.uca(8, 0.65), 1.0, n_snapshots=10)
    >>> J = bearing_information(circle, [0.3], [1.0])
    >>> bool(np.isclose(J[0], 2 * 10 * 8 * (2 * np.pi * 0.65) ** 2 / 2))
    True
    """
    model = instance("measurement", measurement, ArraySnapshot)
    if model.coherence is not None:
        raise ValueError("measurement must have white noise for the bound; got coherent noise")
    beta, P = real("doa", doa), real("power", power)
    if beta.ndim == 0 or beta.shape != P.shape:
        shapes = f"{beta.shape} and {P.shape}"
        raise ValueError(f"doa and power must have one shape (..., n_sources); got {shapes}")
    absent = np.isnan(beta) | np.isnan(P)
    beta = np.where(absent, 0.0, beta)
    around = beta + SLOPE_STEP * np.array([-1, 0, 1]).reshape(3, *np.ones(beta.ndim, dtype=int))
    a = model.steering_vector(around).reshape(*around.shape, model.n_bins, -1)
    a = np.where(absent[..., None, None, :], 0.0, np.moveaxis(a, -3, -1))  # (3, ..., F, M, K)
    A, D = a[1], (a[2] - a[0]) / (2 * SLOPE_STEP)
    # P⊥D = D - A A⁺ D
    residual = D - A @ (np.linalg.pinv(A) @ D)
    curvature = (D.conj() * residual).real.sum(axis=(-3, -2))
    J = 2 * model.n_snapshots / model.noise * np.where(absent, 0.0, P) * curvature
    return np.asarray(J)


def posterior_bound(
    stations: Sequence[Station],
    truth: ArrayLike,
    power: ArrayLike,
    motion: ConstantVelocity,
    P0: ArrayLike,
) -> Float:
    """Return the posterior Cramér-Rao bound of positions, of known stations and association.

        J_t = (F J_{t-1}⁻¹ Fᵀ + Q)⁻¹ + Σ_s H_s H_sᵀ J_s

    J_s is `bearing_information` of station s, and H_s the slope of its azimuth at the true
    position. A source begins with the covariance P0 when it becomes active.

    Parameters
    ----------
    stations : sequence of Station
        Stations at their true positions and headings, with measurement models.
    truth : array_like, shape (n_steps, n_sources, 2)
        True positions, m; NaN while a source is inactive.
    power : array_like, shape (n_steps, n_stations, n_sources)
        Mean powers at one sensor; NaN where a station is missing.
    motion : ConstantVelocity
        Motion of the sources, of steps of 1 s.
    P0 : array_like, shape (4, 4)
        Covariance of a new source's x, vx, y, vy.

    Returns
    -------
    ndarray, shape (n_steps, n_sources, 2, 2)
        Covariances, m²; NaN while a source is inactive. The root of the trace is the smallest root
        of the mean squared distance.

    Raises
    ------
    ValueError
        If shapes do not fit, a station has no measurement model, or P0 is not a covariance.

    References
    ----------
    Tichavský, Muravchik and Nehorai, "Posterior Cramér-Rao bounds for discrete-time nonlinear
    filtering", IEEE Trans. Signal Process. 46(5), 1998, (21), with the Jacobians at the truth.

    Examples
    --------
    >>> from arrivals.scenarios import create
    >>> trial = create("stations_radio", n_sources=1).sample(np.random.default_rng(0))
    >>> drawn = trial.true_stations, trial.truth, trial.power, trial.motion
    >>> P = posterior_bound(*drawn, np.diag([1000.0, 8.0, 1000.0, 8.0]) ** 2)
    >>> np.sqrt(np.trace(P[[0, 59], 0], axis1=1, axis2=2)).round(1)
    array([2.7, 1.6])
    """
    p, P_mean = real("truth", truth), real("power", power)
    stations = items("stations", stations)
    if p.ndim != 3 or p.shape[2] != 2 or P_mean.shape != (len(p), len(stations), p.shape[1]):
        raise ValueError(
            "truth and power must have shapes (n_steps, n_sources, 2) and (n_steps, n_stations, "
            f"n_sources); got {p.shape} and {P_mean.shape}"
        )
    model = instance("motion", motion, ConstantVelocity)
    if model.n_dims != 2:
        raise ValueError(f"motion must have 2 coordinates; got {model.n_dims}")
    start = covariance("P0", P0, 4)
    x = np.zeros((*p.shape[:2], 4))
    x[..., ::2] = p
    gain = np.zeros((*p.shape[:2], 4, 4))
    for station, of_station in zip(stations, np.moveaxis(P_mean, 1, 0), strict=True):
        if instance("stations", station, Station).measurement is None:
            raise ValueError("stations must have measurement models; got a station without one")
        J = bearing_information(
            station.measurement, station.azimuth(x) - station.heading, of_station
        )
        H = np.nan_to_num(station.slope(x))
        gain += J[..., None, None] * H[..., :, None] * H[..., None, :]
    return _recursion(~np.isnan(p[..., 0]), gain, model, start)


def _recursion(active: Float, gain: Float, motion: ConstantVelocity, P0: Float) -> Float:
    """Return the blocks of x and y (n_steps, n_sources, 2, 2) from information (..., 4, 4)."""
    F, Q = motion.F(), motion.Q()
    P = np.full(gain.shape, np.nan)
    for t, on in enumerate(active):
        began = on & ~active[t - 1] if t else on
        P[t, began] = P0
        goes_on = on & ~began
        P[t, goes_on] = F @ P[t - 1, goes_on] @ F.T + Q
        # P = P' - P' (J⁻¹ + P')⁻¹ P' = (I + P' J)⁻¹ P'
        P[t, on] = np.linalg.solve(np.eye(4) + P[t, on] @ gain[t, on], P[t, on])
    return P[..., ::2, ::2]
