"""Plane or curved: changes of the prior of a component's second unknown, where it has a range.

A new component is a plane wave, of a curvature with a narrow prior, the spike. It becomes a curved
one, of a wide prior, the slab, where that raises the support criterion.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from arrivals.trackers.svalse.newton.batch import any_set
from arrivals.trackers.svalse.newton.charts.point_chart import PointChart
from arrivals.trackers.svalse.newton.elbo import Evaluation, evaluate
from arrivals.trackers.svalse.newton.expected_response import ExpectedResponse
from arrivals.trackers.svalse.newton.step import newton_step, slopes, weights
from arrivals.typing import Bool, Float, Int

MARGIN = 1e-3  # nats by which a change must raise the criterion
MOST_FREED = 2  # plane components that are tried in one round
WEAK = 6.0  # nats, twice: information on a curvature below which a plane wave is tried again
MOST_TRIALS = 4  # changes of a problem that are tried at once


class CurvatureEvidence(NamedTuple):
    """What the data say of the curvature of each component, (B, L).

    Attributes
    ----------
    information : ndarray
        Of the data alone, the direction and the other components held.
    mean : ndarray
        Curvature as a curved wave.
    gain : ndarray
        Estimated increase of the criterion as a curved wave; -inf where it is one.
    is_curved : ndarray of bool
        Which are curved waves.
    """

    information: Float
    mean: Float
    gain: Float
    is_curved: Bool


def curvature_evidence(
    response: ExpectedResponse,
    evaluation: Evaluation,
    slab: float,
    log_odds: float,
    kl_weight: float,
) -> CurvatureEvidence:
    """Return what the data say of curvatures: the slab's prior is N(0, 1/slab)."""
    g, curvature = slopes(response, evaluation, *weights(evaluation))
    pull = g[:, 1] + evaluation.prior_gradient[:, 1]
    information = np.maximum(curvature[:, 2] - evaluation.prior_curvature[:, 2], 1e-9)
    precision = information + slab
    mean = (information * evaluation.components.point[:, 1] + pull) / precision
    # ½ p m² - ½ c ln p/p₁ + ln odds
    gain = 0.5 * (precision * mean**2 - kl_weight * np.log(precision / slab)) + log_odds
    is_curved = (evaluation.components.curved > 0) & evaluation.used
    possible = evaluation.used & ~is_curved & (mean > 0)
    return CurvatureEvidence(information, mean, np.where(possible, gain, -np.inf), is_curved)


def trial_order(evidence: CurvatureEvidence, curvature: Float) -> tuple[Int, Bool]:
    """Return the components to change, in order, and which of these are there, (B, n) each.

    First curved waves of negative curvature, then plane ones of the largest gains, then a curved
    one of which the data say little.
    """
    negative = evidence.is_curved & (curvature < 0)
    weak = evidence.is_curved & ~negative & (curvature**2 * evidence.information < WEAK)
    first_weak = weak & (np.cumsum(weak, axis=1) == 1)
    n_better = (evidence.gain[:, :, None] < evidence.gain[:, None]).sum(axis=2)
    freed = (evidence.gain > 0) & (n_better < MOST_FREED)
    rank = np.where(negative, 3.0, np.where(freed, 2.0, np.where(first_weak, 1.0, 0.0)))
    relative = np.where(freed, evidence.gain, 0.0)
    relative = relative / (1 + relative.max(axis=1, keepdims=True))
    order = np.argsort(-(rank + relative), axis=1, kind="stable")[:, :MOST_TRIALS]
    return order, np.take_along_axis(rank > 0, order, axis=1)


def switch_waves(
    response: ExpectedResponse,
    evaluation: Evaluation,
    estimate_nu: Bool,
    n_steps: int,
    curved_probability: float,
    kl_weight: float,
) -> tuple[Evaluation, Bool, Bool]:
    """Try to change one component of each problem from plane to curved, or back.

    All trials are problems of one batch.

    Parameters
    ----------
    response : ExpectedResponse
    evaluation : Evaluation
    estimate_nu : ndarray of bool, shape (B,)
        Rows in which ν and τ are updated.
    n_steps : int
        Newton steps of a trial.
    curved_probability : float
        Prior probability of a curved wave.
    kl_weight : float
        Share of the KL divergence that a component is charged.

    Returns
    -------
    evaluation : Evaluation
        With the first change of each problem that raises the criterion.
    tried, changed : ndarray of bool, shape (B,)
        Problems with a trial, and those with such a change.
    """
    assert isinstance(response.chart, PointChart)
    spike, slab = response.chart.wave_precisions
    log_odds = float(np.log(curved_probability) - np.log1p(-curved_probability))
    evidence = curvature_evidence(response, evaluation, slab, log_odds, kl_weight)
    order, there = trial_order(evidence, evaluation.components.point[:, 1])
    tried, changed = np.asarray(there.any(axis=1)), np.zeros(len(evaluation), dtype=np.bool_)
    if not any_set(tried):
        return evaluation, tried, changed
    row, place = np.nonzero(there)
    k = order[row, place]
    freed = ~evidence.is_curved[row, k]
    negative = ~freed & (evaluation.components.point[row, 1, k] < 0)
    trial = evaluation.take(row)
    components, each = trial.components.copy(), np.arange(len(row))
    old, new = components.prior_precision[each, 2, k], np.where(freed, slab, spike)
    components.kl_constant[each, k] += 0.5 * (np.log(old) - np.log(new))
    components.curved[each, k] = freed
    components.log_odds[each, k] += np.where(freed, log_odds, -log_odds)
    components.prior_precision[each, 1, k] = 0.0
    components.prior_precision[each, 2, k] = new
    components.prior_mean[each, 1, k] = 0.0
    components.point[each, 1, k] = np.where(freed, evidence.mean[row, k], 0.0)
    components.covariance[each, 1, k] = 0.0
    components.covariance[each, 2, k] = 1 / (evidence.information[row, k] + new)
    trial = evaluate(
        response, trial.Y, components, trial.K, trial.nu, trial.tau, trial.log_prior_inactive
    )
    for _ in range(n_steps):
        trial = newton_step(response, trial, estimate_nu[row])
    before = evaluation.criterion(kl_weight)[row]
    better = trial.criterion(kl_weight) > before + MARGIN
    better &= ~(freed & (trial.components.point[each, 1, k] < 0))
    better |= negative
    good = np.flatnonzero(better)
    rows, first = np.unique(row[good], return_index=True)  # the first of each problem
    changed[rows] = True
    if any_set(changed):
        evaluation = evaluation.replace_rows(changed, trial.take(good[first]))
    return evaluation, tried, changed
