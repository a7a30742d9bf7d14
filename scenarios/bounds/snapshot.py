"""Cramér-Rao bounds on directions from single snapshots."""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models import ArraySnapshot
from arrivals.measurement_models.arrays.sensor_array import direction
from arrivals.measurements import numbers
from arrivals.messages import shown
from arrivals.typing import Complex, Float
from arrivals.validation import LARGEST, instance, positive, real


def snapshot_bound(
    measurement: ArraySnapshot, doa: ArrayLike, amplitude: ArrayLike, noise: ArrayLike
) -> Float:
    """Return the deterministic Cramér-Rao bound of one snapshot, standard deviations, rad.

        C = σ²/2 {Re[(DᴴP⊥D) ∘ (w wᴴ)ᵀ]}⁻¹,  D = ∂A/∂β,  P⊥ = I - A A⁺

    A and D are whitened where the noise is coherent.
    Number of sources and noise variance are known, amplitudes are not.

    Parameters
    ----------
    measurement : ArraySnapshot
        Array, wavelength and coherence of the noise.
    doa : array_like, shape (..., n_sources)
        Directions, rad.
    amplitude : array_like, shape (..., n_sources)
        Complex, at the origin of coordinates.
    noise : array_like, shape (...)
        Variance of the noise of one sensor.

    Returns
    -------
    ndarray, shape (..., n_sources)
        Standard deviations, rad.

    References
    ----------
    Stoica and Nehorai, "MUSIC, maximum likelihood, and Cramér-Rao bound", IEEE Trans. ASSP 37(5),
    1989, (2.11).

    Examples
    --------
    One source at broadside: σ²β = 6σ² / (|w|² M(M²-1) (2πd/λ)²).

    >>> from arrivals.measurement_models import SensorArray
    >>> model = ArraySnapshot(SensorArray.ula(15, spacing=0.5), wavelength=1.0)
    >>> std = snapshot_bound(model, [0.0], [1.0], 0.01)
    >>> bool(np.isclose(std[0] ** 2, 6 * 0.01 / (15 * (15**2 - 1) * np.pi**2)))
    True
    """
    array = instance("measurement", measurement, ArraySnapshot).array
    w = numbers("amplitude", amplitude)
    beta = real("doa", doa)
    wavelength = measurement.plain_wavelength("the bound", white_noise=False)
    noise = real("noise", noise)
    if beta.ndim == 0 or w.shape[-1:] != beta.shape[-1:] or not beta.size:
        shapes = f"{beta.shape} and {w.shape}"
        raise ValueError(f"doa and amplitude must have shape (..., n_sources); got {shapes}")
    if not (np.isfinite(w).all() and (np.abs(beta) < LARGEST).all()):
        raise ValueError("doa and amplitude must be finite; got NaN, or an infinite number")
    if not ((noise >= 0) & (noise < LARGEST)).all():
        raise ValueError(f"noise must be finite and not negative; got {shown(noise)}")
    A = np.swapaxes(array.steering_vector(beta, wavelength), -1, -2)
    rotated = direction(beta + np.pi / 2, max(array.dim, 2))  # du/dβ in the plane
    slope = rotated[..., 1:2] if array.dim == 1 else rotated
    # D = ∂A/∂β
    D = 2j * np.pi / wavelength * (array.positions @ np.swapaxes(slope, -1, -2)) * A
    if measurement.coherence is not None:
        L = measurement.whitening()[0]
        A, D = L @ A, L @ D
    # P⊥D = D - A A⁺ D
    residual = D - A @ (np.linalg.pinv(A) @ D)
    # J = Re[(DᴴP⊥D) ∘ (w wᴴ)ᵀ],  C = σ²/2 J⁻¹   (2.11)
    J = ((np.swapaxes(D.conj(), -1, -2) @ residual) * _outer(w)).real
    variance = np.diagonal(np.linalg.pinv(J, hermitian=True), axis1=-2, axis2=-1)
    return np.asarray(np.sqrt(noise[..., None] / 2 * variance))


def _outer(w: ArrayLike) -> Float:
    w = np.asarray(w)
    return np.asarray(w[..., :, None].conj() * w[..., None, :])


class SnapshotScenario(Protocol):
    """Scenario of single snapshots, such as those of `simulations.line_arrays`."""

    @property
    def measurement(self) -> ArraySnapshot:
        """Array and wavelength."""

    def signals(self, rng: np.random.Generator) -> tuple[Float, Complex, Float]:
        """Draw directions, amplitudes and noise variances, one row a step."""


class LineBound(NamedTuple):
    """Errors, degrees, of an efficient estimator with a known number of sources.

    Parameters
    ----------
    gospa : float
        Mean over steps of Σ E min(|e|, c/2): a missed source costs c/2.
    rmse : float
        Mean over steps of the root of the mean of E min(e², c²).
    """

    gospa: float
    rmse: float


def line_bound(scenario: SnapshotScenario, runs: int, seed: int = 0, c: float = 10.0) -> LineBound:
    """Average the bound of single snapshots over a study's draws, for Gaussian errors.

    A scale for the results: it is not a bound on GOSPA in the strict sense, and it does not bound
    a method with memory.

    Parameters
    ----------
    scenario : SnapshotScenario
        Draws directions, amplitudes and noise.
    runs, seed : int
        As in `monte_carlo`.
    c : float
        Cut-off, degrees.

    Returns
    -------
    LineBound
        Mean GOSPA and RMSE, degrees.

    Examples
    --------
    >>> from arrivals.scenarios import create
    >>> line_bound(create("svalse_scenario1", snr_db=30.0), runs=1).gospa < 0.5
    True
    """
    positive("c", c)
    steps = []
    for run in range(runs):
        seed_sequence = np.random.SeedSequence(seed, spawn_key=(run,))
        truth, amplitude, noise = scenario.signals(np.random.default_rng(seed_sequence))
        for doa, w, variance in zip(truth, amplitude, noise, strict=True):
            on = ~np.isnan(doa)
            std = np.rad2deg(snapshot_bound(scenario.measurement, doa[on], w[on], variance))
            steps.append((capped_distance(std, c / 2).sum(), np.sqrt(capped_square(std, c).mean())))
    gospa, rmse = np.mean(steps, axis=0)
    return LineBound(float(gospa), float(rmse))


def capped_distance(std: Float, c: float) -> Float:
    """Return E min(|e|, c) of e ~ N(0, std²).

    Examples
    --------
    >>> capped_distance(np.array([1e-3, 1e9]), 5.0).round(4)
    array([8.e-04, 5.e+00])
    """
    from scipy.special import erfc

    t = c / (np.sqrt(2) * std)
    return np.asarray(std * np.sqrt(2 / np.pi) * -np.expm1(-(t**2)) + c * erfc(t))


def capped_square(std: Float, c: float) -> Float:
    """Return E min(e², c²) of e ~ N(0, std²).

    Examples
    --------
    >>> capped_square(np.array([0.1, 1e9]), 10.0).round(4)
    array([1.e-02, 1.e+02])
    """
    from scipy.special import erf, erfc

    t = c / (np.sqrt(2) * std)
    inside = erf(t) - 2 / np.sqrt(np.pi) * t * np.exp(-(t**2))
    return np.asarray(std**2 * inside + c**2 * erfc(t))
