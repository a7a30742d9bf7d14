"""Motion of points between steps, and the modes of a walk that may stand still."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from arrivals.measurement_models.manifolds.manifold import PointManifold
from arrivals.motion_models.bernoulli_von_mises import BernoulliVonMises
from arrivals.motion_models.move_stop import MoveStopWalk
from arrivals.symmetric import (
    clamped,
    identity,
    inverse,
    log_det,
    times,
    trace_of_product,
)
from arrivals.trackers.svalse.components import ComponentPosterior, TrackedComponents
from arrivals.trackers.svalse.move_stop_points import (
    PointModes,
    mixed,
    predict,
    renewed,
    update,
)
from arrivals.typing import Bool, Float

MIN_INFORMATION = 1e-3  # of the data, relative to the prior's, for an update of the modes
ELECTRICAL_SLOPE = np.pi  # rad of phase a rad of direction: a line at half a wavelength, broadside


def predicted_points(
    manifold: PointManifold,
    motion: BernoulliVonMises,
    mu: Float,
    kappa: Float,
    modes: Float,
    curved: Bool,
    dt: float,
) -> tuple[Float, Float, Float]:
    """Return points, precisions and modes after a step, P' = (P⁻¹ + Q)⁻¹ in the chart.

    A plane wave stays one: its second unknown returns to its narrow prior.

    Parameters
    ----------
    manifold : PointManifold
    motion : BernoulliVonMises
        Its step in direction is one along a great circle.
    mu, kappa : ndarray, shapes (B, L, point_size), (B, L, d(d+1)/2)
        Points, and upper triangles of precisions; NaN and 0 in unused slots.
    modes : ndarray, shape (d + d(d+1)/2 + 1, B, L, 2)
        As in `PointModes`; not used where the walk never stops.
    curved : ndarray of bool, shape (B, L)
        Which are curved waves.
    dt : float
        Length of the step.
    """
    B, L, p = mu.shape
    unused = np.isnan(mu.reshape(-1, p)[:, 0])
    # all problems in one row
    x = np.where(unused, 0.0, mu.reshape(-1, p).T)
    precision = np.where(unused, identity(manifold.n_unknowns), kappa.reshape(B * L, -1).T)
    S = inverse(precision)
    range_step = manifold.walk_range if motion.walk_range is None else motion.walk_range
    Q = manifold.walk(x, step_variance(motion, dt), range_step**2 * dt)
    if motion.move_stop is None:
        S = S + Q
    else:
        now = PointModes.of(modes.reshape(len(modes), B * L, 2), manifold.n_unknowns)
        moved = predict(motion.move_stop, renewed(motion.move_stop, now, S), Q, dt)
        moved = mixed(with_waves(manifold, moved.modes, curved.ravel()))._replace(shift=moved.shift)
        x, S = manifold.move(x, moved.shift), moved.covariance
        modes = moved.modes.rows.reshape(modes.shape)
    if manifold.spike_precision is not None:
        plane = ~curved.ravel()
        second = np.where(plane, 1 / manifold.spike_precision, S[2])
        S = np.stack([S[0], np.zeros_like(second), second])
        x = np.stack([x[0], np.where(plane, 0.0, x[1])])
    new = np.where(unused, np.nan, x).T.reshape(mu.shape)
    return new, np.where(unused, 0.0, inverse(S)).T.reshape(kappa.shape), modes


def step_variance(motion: BernoulliVonMises, dt: float) -> float:
    """Return the variance of the step in direction, rad².

    A concentration in the electrical angle counts as at broadside of a line of half a wavelength.
    """
    variance = float(motion.Q(dt)[0, 0])
    return variance if motion.sigma_doa is not None else variance / ELECTRICAL_SLOPE**2


def with_waves(manifold: PointManifold, modes: PointModes, curved: Bool) -> PointModes:
    """Return modes whose curvatures have the spike of a plane wave, or are not correlated."""
    spike = manifold.spike_precision
    if spike is None:
        return modes
    plane = ~curved[:, None]
    offset, S = modes.offset, modes.covariance
    offset = np.stack([offset[0], np.where(plane, 0.0, offset[1])])
    S = np.stack([S[0], np.zeros_like(S[1]), np.where(plane, 1 / spike, S[2])])
    return modes._replace(offset=offset, covariance=S)


def with_point_modes(
    walk: MoveStopWalk,
    manifold: PointManifold,
    priors: Sequence[TrackedComponents],
    posteriors: Sequence[ComponentPosterior],
) -> list[ComponentPosterior]:
    """Return posteriors in which the modes of the walk have been updated, in one array program.

    The data's part of each posterior, relative to its prior, is a measurement of the point.

    Parameters
    ----------
    walk : MoveStopWalk
    manifold : PointManifold
    priors : sequence of TrackedComponents
        Predicted components, one record for each posterior.
    posteriors : sequence of ComponentPosterior

    Returns
    -------
    list of ComponentPosterior
        With `modes`, and the points and covariances of the mixtures.
    """
    pairs = list(zip(priors, posteriors, strict=True))
    n = [min(int(p.tracked.sum()), len(q.theta)) for p, q in pairs]
    first = [np.flatnonzero(p.tracked)[:m] for (p, _), m in zip(pairs, n, strict=True)]
    prior, same = (
        np.concatenate([getattr(p, name)[on] for (p, _), on in zip(pairs, first, strict=True)])
        for name in ("mu", "curved")
    )
    mu = prior.T
    P = np.concatenate([p.kappa[on] for (p, _), on in zip(pairs, first, strict=True)]).T
    rows = np.concatenate([p.modes[:, on] for (p, _), on in zip(pairs, first, strict=True)], axis=1)
    theta, active, K, now_curved = (
        np.concatenate([value_of(q, name)[:m] for (_, q), m in zip(pairs, n, strict=True)])
        for name in ("theta", "active", "marginal_kappa", "curved")
    )
    x, K = theta.T, K.T
    # D = V⁻¹ - P;  D δ = V⁻¹ e, e the point from the prior's mean: the pseudo-measurement
    D, e = clamped(K - P, 0.0), manifold.offset(x, mu)[0]
    S = inverse(P)
    known = trace_of_product(D, S) > MIN_INFORMATION * manifold.n_unknowns
    informed, changed = active & known & (same == now_curved), active & (same != now_curved)
    modes = renewed(walk, PointModes.of(rows, manifold.n_unknowns), S)
    new = update(walk, modes, np.where(informed, times(K, e), 0.0), np.where(informed, D, 0.0))
    x = np.where(changed, x, np.where(informed, manifold.move(mu, new.shift), mu))
    covariance = np.where(changed, inverse(K), np.where(informed, new.covariance, S))
    rows = np.where(informed[:, None], new.modes.rows, modes.rows)
    ends = np.cumsum(n)[:-1]
    parts = zip(
        posteriors, np.split(x, ends, axis=1), np.split(covariance, ends, axis=1),
        np.split(rows, ends, axis=1), strict=True,
    )  # fmt: skip
    return [merged_points(*part) for part in parts]


def value_of(posterior: ComponentPosterior, name: str) -> Float:
    """Return a field of a posterior; of those optional, what stands for it."""
    value = getattr(posterior, name)
    if value is not None:
        return np.asarray(value)
    return posterior.kappa if name == "marginal_kappa" else np.ones(len(posterior.theta), bool)


def merged_points(
    posterior: ComponentPosterior, x: Float, covariance: Float, rows: Float
) -> ComponentPosterior:
    """Return a posterior with other densities of its first components."""
    m, n = x.shape[1], len(posterior.theta)
    old, stated = value_of(posterior, "marginal_kappa"), posterior.covariance
    assert stated is not None
    # stated covariances: as much wider than the marginal ones as before
    log_ratio = log_det(stated[:m].T) + log_det(old[:m].T)
    ratio = np.exp(log_ratio / (2 if len(covariance) > 1 else 1))
    return replace(
        posterior,
        theta=np.concatenate([x.T, posterior.theta[m:]]),
        kappa=np.concatenate([inverse(covariance).T, old[m:]]),
        covariance=np.concatenate([(covariance * ratio).T, stated[m:]]),
        modes=np.concatenate([rows, np.zeros((len(rows), n - m, 2))], axis=1),
    )
