"""Directions and covariance from the snapshots of a single step, without the past of a tracker."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.direction_measurement import DirectionMeasurement
from arrivals.messages import shown
from arrivals.trackers.fusion.stations.white_snapshots import StepSnapshots as StepSnapshots
from arrivals.trackers.fusion.stations.white_snapshots import step_snapshots as step_snapshots
from arrivals.typing import Float
from arrivals.validation import count, real

MAX_EXCESS = 0.9  # of the information, from noise in the amplitudes
PRIOR_INFORMATION = 1.0  # rad⁻²: no direction has a standard deviation above 1 rad
MAX_STEP = 0.1  # rad, of one Gauss-Newton step
REGULARIZATION = 1e-6  # of the mean ‖a‖², in the Gram matrix; leaves a residual of noiseless data


class DirectionFit(NamedTuple):
    """Directions fitted to the snapshots of a step.

    Parameters
    ----------
    doa : ndarray, shape (n_sources,)
        Directions, rad.
    covariance : ndarray, shape (n_sources, n_sources)
        Inverse of the joint information, rad².
    excess : ndarray, shape (n_sources, n_sources)
        Part of the information that is noise in the amplitudes, as in `error_covariance`, rad⁻².
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
    excess: Float
    noise: float
    energy: float
    explained: Float

    @property
    def error_covariance(self) -> Float:
        """Covariance of the errors, with the noise in the amplitudes, rad²."""
        J: Float = np.linalg.inv(self.covariance).astype(np.float64)
        return error_covariance(J, self.excess)


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
        With as many sources as sensors or more, information is missing: the directions are the
        initial ones, each with a variance of 1 rad².

    Raises
    ------
    ValueError
        If a direction is not finite.

    Examples
    --------
    >>> from arrivals.measurement_models import ArraySnapshot, SensorArray
    >>> model = ArraySnapshot(SensorArray.uca(8, 0.65), wavelength=1.0)
    >>> z = 3 * model.steering_vector(0.5) + 0.1 * np.exp(1j * np.arange(8) ** 2)
    >>> fit = fit_directions(step_snapshots(model, z), [0.45, 2.0])
    >>> fit.doa[:1].round(2), fit.explained > 20 * fit.noise
    (array([0.5]), array([ True, False]))
    """
    theta = _checked(doa)
    n_steps = count("n_steps", n_steps, minimum=0)
    K, M = len(theta), step.n_sensors
    if K == 0 or K >= M:
        return _without_information(step, theta)
    for i in range(n_steps + 1):
        at = _linearized(step, theta)
        J = at.information + PRIOR_INFORMATION * np.eye(K)
        R = np.linalg.inv(J)
        if i < n_steps:
            # θ = θ + (J + I)⁻¹ g
            theta = theta + np.clip(R @ at.gradient, -MAX_STEP, MAX_STEP)
    excess = at.excess
    if step.is_line:
        side = np.where(np.cos(theta) < 0, -1.0, 1.0)  # of a mirror image
        R, excess = side[:, None] * R * side, side[:, None] * excess * side
    R, theta = (R + R.T) / 2, in_range(theta, step.is_line)
    return DirectionFit(theta, R, excess, at.noise, at.energy, at.explained)


def error_covariance(J: Float, excess: Float) -> Float:
    """Return the covariance of errors of directions, noise of their amplitudes included.

    Amplitudes are estimated from the same noise, which enters the information J as an excess B
    and the variance of the gradient twice: the errors have the covariance (J - B)⁻¹ J (J - B)⁻¹.

    Parameters
    ----------
    J : ndarray, shape (n_sources, n_sources)
        Information with estimated amplitudes, rad⁻².
    excess : ndarray, shape (n_sources, n_sources)
        B = 2N Σ_f Re[(D' P⊥D) ∘ (A'A)⁻ᵀ], rad⁻²; it counts as at most 0.9 of J.

    Returns
    -------
    ndarray, shape (n_sources, n_sources)
        rad².

    References
    ----------
    Stoica and Nehorai, "Performance study of conditional and unconditional direction-of-arrival
    estimation", IEEE Trans. ASSP 38(10), 1990.

    Examples
    --------
    >>> error_covariance(np.array([[4.0]]), np.array([[2.0]]))
    array([[1.]])
    """
    L_inverse = np.linalg.inv(np.linalg.cholesky(J))
    # J = L L', B = L U diag(e) U' L':  (J - B)⁻¹ J (J - B)⁻¹ = L⁻ᵀ U diag(1 - e)⁻² U' L⁻¹
    e, U = np.linalg.eigh(L_inverse @ excess @ L_inverse.T)
    root = L_inverse.T @ (U / (1 - np.minimum(e, MAX_EXCESS)))
    return np.asarray(root @ root.T)


class _Linearized(NamedTuple):
    """Information and gradient of the likelihood at some directions."""

    information: Float
    gradient: Float
    noise: float
    energy: float
    explained: Float
    excess: Float


def _linearized(step: StepSnapshots, theta: Float) -> _Linearized:
    Y, K = step.Y, len(theta)
    F, M, N = Y.shape
    A, D = step.response(theta)
    AH = A.conj().swapaxes(1, 2)
    gram = AH @ A
    size = np.einsum("fkk->f", gram).real / K
    inverse = np.linalg.inv(gram + (REGULARIZATION * size)[:, None, None] * np.eye(K))
    # [W, C] = G⁻¹ A' [Y, D];   [E, P⊥D] = [Y, D] - A [W, C]
    targets = np.concatenate([Y, D], axis=2)
    solved = inverse @ (AH @ targets)
    rest = targets - A @ solved
    W, E = solved[:, :, :N], rest[:, :, :N]
    # ν = ‖E‖² / (F N (M - K))
    energy = float(np.vdot(E, E).real)
    noise = energy / (F * step.n_snapshots * (M - K))
    # J = 2/ν Σ_f Re[(D' P⊥D) ∘ (W W')ᵀ],   g_k = 2/ν Σ_f,n Re[W*_kn (D'E)_kn]
    slopes = D.conj().swapaxes(1, 2) @ rest
    products = W.conj() @ W.swapaxes(1, 2)
    J = 2 / noise * (slopes[:, :, N:] * products).real.sum(axis=0)
    g = 2 / noise * (W.conj() * slopes[:, :, :N]).real.sum(axis=(0, 2))
    # without source k, ‖E‖² rises by |w_k|² / [G⁻¹]_kk
    powers = np.einsum("fkk->fk", products).real
    explained = (powers / np.einsum("fkk->fk", inverse).real).sum(axis=0)
    # B = 2N Σ_f Re[(D' P⊥D) ∘ G⁻ᵀ]
    excess = (slopes[:, :, N:] * inverse.swapaxes(1, 2)).real.sum(axis=0)
    return _Linearized(J, g, noise, energy, explained, 2 * step.n_snapshots * excess)


def _without_information(step: StepSnapshots, theta: Float) -> DirectionFit:
    """Return the fit of no source, or of too many: its energy is zero and its noise NaN."""
    K = len(theta)
    n_numbers = step.Y.shape[0] * step.n_snapshots * step.n_sensors
    energy, noise = (0.0, np.nan) if K else (step.energy, step.energy / n_numbers)
    prior = np.eye(K) / PRIOR_INFORMATION
    directions = in_range(theta, step.is_line)
    return DirectionFit(directions, prior, np.zeros((K, K)), noise, energy, np.zeros(K))


def _checked(doa: ArrayLike) -> Float:
    theta = real("doa", doa)
    if theta.ndim != 1 or not np.isfinite(theta).all():
        raise ValueError(f"doa must be finite, of shape (n_sources,); got {shown(doa)}")
    return theta


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
        theta = _checked(doa)
        return theta.copy(), np.eye(len(theta)) / PRIOR_INFORMATION, np.nan
    fit = fit_directions(step, doa, n_steps=n_steps)
    return fit.doa, fit.covariance, fit.noise


def in_range(theta: Float, is_line: bool) -> Float:
    """Return directions in [-π, π), of a line in [-π/2, π/2].

    Examples
    --------
    >>> np.rad2deg(in_range(np.deg2rad([200.0, 95.0]), False)).round(6)
    array([-160.,   95.])
    >>> np.rad2deg(in_range(np.deg2rad([-30.0, 95.0]), True)).round(6)
    array([-30.,  85.])
    """
    wrapped = (theta + np.pi) % (2 * np.pi) - np.pi
    if not is_line:
        return np.asarray(wrapped)
    return np.where(np.abs(wrapped) > np.pi / 2, np.copysign(np.pi, wrapped) - wrapped, wrapped)
