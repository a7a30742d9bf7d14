"""Cramér-Rao bounds on azimuth and elevation, and on direction and range."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models import ArraySnapshot
from arrivals.measurement_models.arrays.sphere import unit_vectors
from arrivals.measurements import numbers
from arrivals.messages import shown
from arrivals.typing import Complex, Float
from arrivals.validation import LARGEST, instance, positive, real

NO_INFORMATION = 1e-9  # of the largest root of a diagonal element of the Fisher matrix


def sphere_bound(
    measurement: ArraySnapshot,
    doa: ArrayLike,
    elevation: ArrayLike,
    amplitude: ArrayLike,
    noise: float,
) -> Float:
    """Return the deterministic Cramér-Rao bound on directions on the sphere.

        C = σ²/2 {Σ Re[(DᴴP⊥D) ∘ (W Wᴴ)ᵀ]}⁻¹,  D = [∂A/∂ε, ∂A/(cos ε ∂φ)],  P⊥ = I - A A⁺

    The sum is over bins. Number of sources and noise variance are known, amplitudes are not.

    Parameters
    ----------
    measurement : ArraySnapshot
        Sensors in a plane or in space, isotropic; white noise.
    doa, elevation : array_like, shape (n_sources,)
        Azimuths and elevations, rad.
    amplitude : array_like, shape ([n_bins,] [n_snapshots,] n_sources)
        Complex amplitudes of one step.
    noise : float
        Variance of the noise of one sensor.

    Returns
    -------
    ndarray, shape (n_sources, 2, 2)
        Covariances in the tangent plane, rad²: elevation, and azimuth times cos(elevation). The
        standard deviation along the great circle is the root of the trace. Of an array in a plane,
        the elevation of a source in the plane has an infinite variance, and covariances of 0.

    References
    ----------
    Stoica and Nehorai, "MUSIC, maximum likelihood, and Cramér-Rao bound", IEEE Trans. ASSP 37(5),
    1989, (2.11), with two unknowns a source.

    Examples
    --------
    >>> from arrivals.measurement_models import SensorArray
    >>> circle = ArraySnapshot(SensorArray.uca(8, 0.65), 1.0, unknowns="sphere")
    >>> C = sphere_bound(circle, [0.3], [np.pi / 6], [1.0], noise=0.01)
    >>> np.rad2deg(np.sqrt(np.diagonal(C[0]))).round(2)  # 1 / sin 30° of the azimuth's
    array([0.99, 0.5 ])
    """
    model = instance("measurement", measurement, ArraySnapshot)
    azimuth, height = _finite("doa", doa), _finite("elevation", elevation)
    a = _responses(model, model.steering_vector(azimuth, height))
    up = unit_vectors(azimuth, height + np.pi / 2)  # ∂n/∂ε
    across = unit_vectors(azimuth + np.pi / 2, 0 * azimuth)  # ∂n/(cos ε ∂φ)
    p = model.array.positions
    tangents = np.stack([up, across])[..., : p.shape[1]]
    paths = np.moveaxis(tangents @ p.T, 2, 1)  # (2, M, K)
    k = model.waves.wavenumber[:, None, None, None]
    return _bound(model, a, 1j * k * paths * a[:, None], amplitude, noise)


def range_bound(
    measurement: ArraySnapshot,
    doa: ArrayLike,
    distance: ArrayLike,
    amplitude: ArrayLike,
    noise: float,
) -> Float:
    """Return the deterministic Cramér-Rao bound on directions and ranges of spherical waves.

    As `sphere_bound`, with the derivatives along direction and 1/R of a = R/r exp(jk(R - r)).

    Parameters
    ----------
    measurement : ArraySnapshot
        A line of isotropic sensors; white noise.
    doa, distance : array_like, shape (n_sources,)
        Directions from broadside, rad, and distances R from the centroid, m; infinite for a plane
        wave.
    amplitude : array_like, shape ([n_bins,] [n_snapshots,] n_sources)
        Complex amplitudes of one step, at the centroid.
    noise : float
        Variance of the noise of one sensor.

    Returns
    -------
    ndarray, shape (n_sources, 2, 2)
        Covariances of direction, rad, and 1/R, 1/m. The standard deviation of R is R² times that
        of 1/R.

    Examples
    --------
    >>> from arrivals.measurement_models import SensorArray
    >>> line = ArraySnapshot(SensorArray.ula(16, 0.08), 343 / 2000, unknowns="range")
    >>> C = range_bound(line, [np.deg2rad(20)], [5.0], [1.0], noise=0.01)
    >>> float(np.rad2deg(np.sqrt(C[0, 0, 0])).round(3)), float(np.sqrt(C[0, 1, 1]).round(4))
    (0.081, 0.0091)
    """
    model = instance("measurement", measurement, ArraySnapshot)
    if model.array.dim != 1:
        raise ValueError(f"array must be a line for a range; got {model.array.dim} dimensions")
    beta, R = _finite("doa", doa), real("distance", distance)
    a = _responses(model, model.steering_vector(beta, distance=R))
    p = model.array.positions - model.array.positions.mean()  # (M, 1)
    u, v = np.sin(beta), 1 / R
    # t = r/R = √(1 - 2puv + p²v²),  f = R - r = (2pu - p²v) / (1 + t)
    t = np.sqrt(1 - 2 * p * u * v + (p * v) ** 2)
    f = (2 * p * u - p * p * v) / (1 + t)
    tu, tv = -p * v / t, (p * p * v - p * u) / t
    fu, fv = p / t, -(p * p + f * tv) / (1 + t)
    k = model.waves.wavenumber[:, None, None, None]
    slopes = 1j * k * np.stack([fu, fv]) - np.stack([tu, tv]) / t
    slopes[:, 0] *= np.cos(beta)
    return _bound(model, a, slopes * a[:, None], amplitude, noise)


def _finite(name: str, value: ArrayLike) -> Float:
    values = real(name, value)
    if not (np.abs(values) < LARGEST).all():
        raise ValueError(f"{name} must be finite; got {shown(value)}")
    return values


def _responses(model: ArraySnapshot, a: Complex) -> Complex:
    """Return responses (K, [F,] M) as (F, M, K)."""
    if model.coherence is not None or model.response is not None:
        raise ValueError("measurement must have isotropic elements and white noise for the bound")
    if a.ndim != 2 + (model.n_bins > 1):
        raise ValueError(
            f"doa must have shape (n_sources,); got {a.shape[: -1 - (model.n_bins > 1)]}"
        )
    return np.moveaxis(a.reshape(len(a), model.n_bins, -1), 0, 2)


def _bound(
    model: ArraySnapshot, A: Complex, D: Complex, amplitude: ArrayLike, noise: float
) -> Float:
    """Return the blocks (K, 2, 2) of the bound from A (F, M, K) and D (F, 2, M, K)."""
    F, M, K = A.shape
    W = numbers("amplitude", amplitude)
    if W.shape != (*model.shape[:-1], K):
        raise ValueError(f"amplitude must have shape {(*model.shape[:-1], K)}; got {W.shape}")
    if not (np.abs(W) < LARGEST).all():
        raise ValueError(f"amplitude must be finite; got {shown(amplitude)}")
    W = np.swapaxes(W.reshape(F, -1, K), 1, 2)  # (F, K, N)
    D = np.moveaxis(D, 1, 2).reshape(F, M, 2 * K)
    # P⊥D = D - A A⁺ D
    residual = D - A @ (np.linalg.pinv(A) @ D)
    # J = 2/σ² Σ Re[(DᴴP⊥D) ∘ (W Wᴴ)ᵀ],  C = J⁻¹   (2.11)
    outer = np.tile(np.swapaxes(W @ W.conj().swapaxes(1, 2), 1, 2), (2, 2))
    J = (D.conj().swapaxes(1, 2) @ residual * outer).real.sum(axis=0)
    J *= 2 / positive("noise", noise)
    scale = np.sqrt(np.maximum(np.diagonal(J), 0.0))
    known = np.flatnonzero(scale > NO_INFORMATION * scale.max(initial=0.0))
    C = np.zeros(J.shape)
    np.fill_diagonal(C, np.inf)
    inside, units = np.ix_(known, known), np.outer(scale, scale)
    C[inside] = np.linalg.pinv((J / np.where(units > 0, units, 1))[inside]) / units[inside]
    C = C.reshape(2, K, 2, K)
    index = np.arange(K)
    return np.asarray(np.moveaxis(C, (1, 3), (0, 1))[index, index])
