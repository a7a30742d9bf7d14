"""Directions and covariance from the snapshots of a single step, without the past of a tracker."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.direction_measurement import DirectionMeasurement
from arrivals.measurement_models.manifolds.fourier import FourierManifold
from arrivals.measurement_models.manifolds.manifold import Manifold, is_angle_manifold
from arrivals.measurement_models.observed import ObservedSnapshots
from arrivals.messages import shown
from arrivals.typing import Complex, Float
from arrivals.validation import count, real

PRIOR_INFORMATION = 1.0  # rad⁻²: no direction has a standard deviation above 1 rad
MAX_STEP = 0.1  # rad, of one Gauss-Newton step
REGULARIZATION = 1e-6  # of the mean ‖a‖², in the Gram matrix of the responses
MIN_RELATIVE_NOISE = 1e-15  # of the mean power; noiseless data have a finite information
DIFFERENCE = 1e-5  # rad, of responses without an analytic derivative

Response = Callable[[Float], tuple[Complex, Complex]]


class DirectionFit(NamedTuple):
    """Directions fitted to the snapshots of a step.

    Parameters
    ----------
    doa : ndarray, shape (n_sources,)
        Directions, rad.
    covariance : ndarray, shape (n_sources, n_sources)
        Inverse of the joint information, rad².
    noise : float
        Variance of the residual at a sensor; NaN without a degree of freedom for it.
    energy : float
        Energy of the residual.
    explained : ndarray, shape (n_sources,)
        Increase of the energy of the residual if a source is removed, the others staying at their
        directions.
    """

    doa: Float
    covariance: Float
    noise: float
    energy: float
    explained: Float


@dataclass(frozen=True, eq=False)
class StepSnapshots:
    """Valid snapshots of a step, in white noise, and the response of the sensors.

    Parameters
    ----------
    Y : ndarray of complex, shape (n_bins, n_sensors, n)
        Snapshots, or, of many, as few columns with the same covariance.
    n_snapshots : int
        Number of snapshots.
    response : callable
        Takes directions (K,), gives responses and derivatives, each (n_bins, n_sensors, K).
    is_line : bool
        True if directions are from broadside.
    """

    Y: Complex
    n_snapshots: int
    response: Response
    is_line: bool

    @property
    def n_sensors(self) -> int:
        """Number of valid sensors."""
        return int(self.Y.shape[1])

    @property
    def energy(self) -> float:
        """Energy of the snapshots."""
        return float(np.vdot(self.Y, self.Y).real)


def step_snapshots(measurement: DirectionMeasurement, z: ArrayLike | None) -> StepSnapshots | None:
    """Return the valid snapshots of a measurement, None if all of it is missing.

    Parameters
    ----------
    measurement : DirectionMeasurement
        Coherent noise is whitened as `observe` does it. With a second unknown of a source, waves
        are those of `steering_vector`: horizontal and plane.
    z : array_like or None
        Measurement.

    Returns
    -------
    StepSnapshots or None

    Raises
    ------
    ValueError
        If the shape of the measurement is wrong.
    """
    observed = measurement.observe(z)
    if observed is None:
        return None
    Y = observed.snapshots
    n = Y.shape[2]
    if n > 2 * Y.shape[1]:  # Y = R'Q', and all results depend on Y Y' = R'R alone
        Y = np.swapaxes(np.linalg.qr(np.swapaxes(Y, 1, 2).conj(), mode="r"), 1, 2).conj()
    array = getattr(measurement, "array", None)
    is_line = bool(array is not None and array.dim == 1)
    return StepSnapshots(Y, n, _response(measurement, observed), is_line)


def fit_directions(step: StepSnapshots, doa: ArrayLike, *, n_steps: int = 2) -> DirectionFit:
    """Return directions of largest likelihood near some, by Gauss-Newton steps.

    Parameters
    ----------
    step : StepSnapshots
        From `step_snapshots`.
    doa : array_like, shape (n_sources,)
        Initial directions, rad.
    n_steps : int
        Number of steps, each of at most 0.1 rad.

    Returns
    -------
    DirectionFit
        With as many sources as sensors or more, there is no information: the directions are the
        initial ones, each with a variance of 1 rad².
    """
    theta = real("doa", doa)
    if theta.ndim != 1 or not np.isfinite(theta).all():
        raise ValueError(f"doa must be finite, of shape (n_sources,); got {shown(doa)}")
    n_steps = count("n_steps", n_steps, minimum=0)
    Y = step.Y
    F, M, N = Y.shape
    K = len(theta)
    if K == 0 or K >= M:
        noise = step.energy / (F * step.n_snapshots * M) if K == 0 else np.nan
        energy = step.energy if K == 0 else 0.0
        return DirectionFit(_in_range(theta, step.is_line), np.eye(K), noise, energy, np.zeros(K))
    identity = np.eye(K)
    n_free = F * step.n_snapshots * (M - K)
    floor = MIN_RELATIVE_NOISE * step.energy / (F * M * step.n_snapshots)
    for i in range(n_steps + 1):
        A, D = step.response(theta)
        AH = A.conj().swapaxes(1, 2)
        gram = AH @ A
        gram = (
            gram
            + REGULARIZATION * np.trace(gram, axis1=1, axis2=2).real[:, None, None] / K * identity
        )
        # [W, C, G⁻¹] = G⁻¹ [A'Y, A'D, I];   E = Y - A W,  P⊥D = D - A C
        targets = np.concatenate([Y, D], axis=2)
        right = np.concatenate([AH @ targets, np.broadcast_to(identity, (F, K, K))], axis=2)
        solved = np.linalg.solve(gram, right)
        rest = targets - A @ solved[:, :, : N + K]
        W, E = solved[:, :, :N], rest[:, :, :N]
        energy = float(np.vdot(E, E).real)
        noise = max(energy / n_free, floor)
        projected = D.conj().swapaxes(1, 2) @ rest  # D'E, D'P⊥D
        # J = 2/ν Σ_f Re[(D' P⊥ D) ∘ (W W')ᵀ]
        WW = W.conj() @ W.swapaxes(1, 2)
        J = 2 / noise * (projected[:, :, N:] * WW).real.sum(axis=0)
        R = np.linalg.inv(J + PRIOR_INFORMATION * identity)
        if i == n_steps:
            break
        # g_k = 2/ν Σ_f,n Re[W*_kn (D'E)_kn];   θ = θ + (J + I)⁻¹ g
        g = 2 / noise * (W.conj() * projected[:, :, :N]).real.sum(axis=(0, 2))
        theta = theta + np.clip(R @ g, -MAX_STEP, MAX_STEP)
    # ‖E‖² rises by |w_k|² / [G⁻¹]_kk without source k
    lost = (np.abs(W) ** 2).sum(axis=2) / np.diagonal(solved[:, :, N + K :], axis1=1, axis2=2).real
    return DirectionFit(
        *_folded(theta, (R + R.T) / 2, step.is_line), noise, energy, lost.sum(axis=0)
    )


def bearings(
    measurement: DirectionMeasurement, z: ArrayLike | None, doa: ArrayLike, *, n_steps: int = 2
) -> tuple[Float, Float, float]:
    """Return the directions that the snapshots of a single step support, near some.

    Maximum likelihood of deterministic amplitudes by Gauss-Newton steps. No prior of a tracker
    enters, so that the directions of several steps have independent errors, and the covariance is
    that of all sources together.

    Parameters
    ----------
    measurement : DirectionMeasurement
        Model of the snapshots.
    z : array_like or None
        Snapshots of the step; NaN where a number is missing.
    doa : array_like, shape (n_sources,)
        Initial directions, rad, such as those of a tracker.
    n_steps : int
        Gauss-Newton steps, each of at most 0.1 rad.

    Returns
    -------
    doa : ndarray, shape (n_sources,)
        Directions, rad.
    covariance : ndarray, shape (n_sources, n_sources)
        Their covariance, rad²; that of a prior of 1 rad without information: if the measurement is
        missing, or has no more valid sensors than there are sources.
    noise : float
        Variance of the residual at a sensor; NaN without information.

    Raises
    ------
    ValueError
        If the shape of the measurement is wrong, or a direction is not finite.

    References
    ----------
    Stoica and Nehorai, "MUSIC, maximum likelihood, and Cramér-Rao bound", IEEE Trans. ASSP 37(5),
    1989, (4.1).

    Examples
    --------
    >>> from arrivals.measurement_models import ArraySnapshot, SensorArray
    >>> model = ArraySnapshot(SensorArray.uca(8, 0.65), wavelength=1.0, n_snapshots=2)
    >>> z = np.stack([model.steering_vector(0.5), 1j * model.steering_vector(0.5)])
    >>> noise = 0.01 * np.exp(1j * np.arange(16) ** 2).reshape(2, 8)
    >>> doa, covariance, noise = bearings(model, z + noise, [0.45])
    >>> doa.round(2), bool(covariance[0, 0] < 1e-5)
    (array([0.5]), True)
    """
    step = step_snapshots(measurement, z)
    if step is None:
        theta = np.array(real("doa", doa))
        return theta, np.eye(len(theta)) / PRIOR_INFORMATION, np.nan
    fit = fit_directions(step, doa, n_steps=n_steps)
    return fit.doa, fit.covariance, fit.noise


def _response(measurement: DirectionMeasurement, observed: ObservedSnapshots) -> Response:
    """Return the response of the valid sensors and bins, and its derivative."""
    manifold = observed.full_manifold
    if manifold is not None and not (observed.bins.all() and observed.sensors.all()):
        manifold = observed.manifold
    if isinstance(manifold, FourierManifold) and len(manifold.coefficients) == 1:
        return _fourier_response(manifold)
    values = _steering(measurement, observed, manifold)

    def response(doa: Float) -> tuple[Complex, Complex]:
        K = len(doa)
        a = values(np.concatenate([doa, doa - DIFFERENCE, doa + DIFFERENCE]))
        return a[:, :, :K], (a[:, :, 2 * K :] - a[:, :, K : 2 * K]) / (2 * DIFFERENCE)

    return response


def _fourier_response(manifold: FourierManifold) -> Response:
    G, k = manifold.coefficients[0], 1j * manifold.harmonics[:, None]

    def response(doa: Float) -> tuple[Complex, Complex]:
        # a = G d,  ∂a/∂θ = G (jk ∘ d)
        d = np.exp(k * doa)
        both = G @ np.concatenate([d, k * d], axis=1)
        return both[:, :, : len(doa)], both[:, :, len(doa) :]

    return response


def _steering(
    measurement: DirectionMeasurement, observed: ObservedSnapshots, manifold: Manifold | None
) -> Callable[[Float], Complex]:
    """Return the function of directions (K,) whose values are responses (n_bins, n_sensors, K)."""
    if manifold is not None and is_angle_manifold(manifold) and len(manifold.nuisance_weights) == 1:
        series = manifold
        return lambda doa: series.steering(series.from_doa(doa))[0]
    whitening = getattr(measurement, "whitening", None)
    L = None if whitening is None else whitening(observed.sensors)[observed.bins]

    def steering(doa: Float) -> Complex:
        a = measurement.steering_vector(doa).reshape(len(doa), len(observed.bins), -1)
        a = np.moveaxis(a[:, observed.bins][:, :, observed.sensors], 0, 2)
        return a if L is None else np.asarray(L @ a)

    return steering


def _folded(theta: Float, covariance: Float, is_line: bool) -> tuple[Float, Float]:
    """Return directions in [-π, π), of a line in [-π/2, π/2], and their covariance."""
    if is_line:
        side = np.where(np.cos(theta) < 0, -1.0, 1.0)  # of a mirror image
        covariance = side[:, None] * covariance * side
    return _in_range(theta, is_line), covariance


def _in_range(theta: Float, is_line: bool) -> Float:
    wrapped = (theta + np.pi) % (2 * np.pi) - np.pi
    if not is_line:
        return np.asarray(wrapped)
    return np.where(np.abs(wrapped) > np.pi / 2, np.copysign(np.pi, wrapped) - wrapped, wrapped)
