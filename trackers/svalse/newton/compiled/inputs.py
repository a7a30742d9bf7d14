"""The compiled solver's inputs from the array program's records, and its result as one of them."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from arrivals.measurement_models.manifolds.uniform_line import UniformLineManifold
from arrivals.trackers.svalse.newton.candidate_grid import AngleCandidates
from arrivals.trackers.svalse.newton.charts.angle_chart import AngleChart
from arrivals.trackers.svalse.newton.compiled.records import (
    ChartNumbers,
    GridNumbers,
    Outcome,
    Removed,
    SearchNumbers,
    Start,
    Task,
    Terms,
)
from arrivals.trackers.svalse.newton.elbo import Evaluation
from arrivals.trackers.svalse.newton.problems import InitialValues
from arrivals.trackers.svalse.newton.state import SolverResult
from arrivals.trackers.svalse.newton.support_search import SupportSearch
from arrivals.typing import Float


@lru_cache(maxsize=16)
def numbers_of(search: SupportSearch) -> tuple[ChartNumbers, GridNumbers, SearchNumbers]:
    """Return what the compiled functions need of an array, its grid and the settings."""
    response, grid, limits = search.response, search.grid, search.limits
    chart = response.chart
    assert isinstance(chart, AngleChart)
    assert isinstance(grid, AngleCandidates)
    F, k, manifold = response.n_bins, chart.jk.imag.astype(np.float64), chart.manifold
    G = np.zeros((0, 0, 0), dtype=np.complex128)
    if chart.G is not None:
        G = np.ascontiguousarray(chart.G.reshape(len(k), F, -1).swapaxes(0, 1))
    none = np.zeros((0, 0), dtype=np.complex128)
    return (
        ChartNumbers(
            k, G, chart.norm2[:, 0].astype(np.float64),
            none if chart.series is None else np.ascontiguousarray(chart.series.T),
            float(response.tempering), float(response.power_floor), float(response.noise_floor),
            float(chart.longest_step), float(chart.max_variance),
            float(manifold.step) if isinstance(manifold, UniformLineManifold) else 0.0,
            bool(manifold.front_back_ambiguous),
        ),
        GridNumbers(
            grid.theta, grid.doa, np.ascontiguousarray(grid.A), full(grid.gram[:, 0], F, grid),
            full(grid.norm2, F, grid), float(grid.log_range), float(grid.cos_apart),
            float(grid.cos_merge), float(grid.cos_near), float(grid.merge),
            float(grid.merge_correlation or 0.0),
        ),
        SearchNumbers(
            limits.inner, limits.removal, limits.fill, limits.final, limits.max_changes,
            search.max_iterations, search.n_components, search.max_active,
            float(limits.inner_tolerance), float(limits.large_gain), float(search.tolerance),
            float(search.kl_weight), bool(search.reestimate),
        ),
    )  # fmt: skip


def full(values: Float, n_bins: int, grid: AngleCandidates) -> Float:
    """Return values for each bin and point of the grid."""
    return np.ascontiguousarray(np.broadcast_to(values, (n_bins, grid.n_points)))


def solve_compiled(search: SupportSearch, values: InitialValues) -> SolverResult:
    """Solve problems by the compiled functions.

    Parameters
    ----------
    search : SupportSearch
        Of an array of which there is a compiled form.
    values : InitialValues

    Returns
    -------
    SolverResult
        The same as that of the array program, up to rounding.
    """
    from arrivals.trackers.svalse.newton.compiled.solve import solve_all

    chart, grid, numbers = numbers_of(search)
    old = values.components.packed
    B, n_rows, n_tracked = old.shape
    L = max(int(values.K.max()), search.max_active) + 1
    n_slots = n_tracked + search.limits.max_changes + 3 * L  # each change removes one at most
    terms = empty_terms(values, L, linear=search.response.chart.is_linear)
    memory = np.zeros((B, n_rows, n_slots))
    terms.packed[:, :, :n_tracked] = memory[:, :, :n_tracked] = old
    removed = Removed(
        memory,
        np.zeros((B, n_tracked), dtype=np.bool_),
        np.zeros((B, grid.theta.size), dtype=np.bool_),
        values.K[:, None].copy(),
    )
    outcome = Outcome(np.zeros(B, dtype=np.int64), np.zeros(B, dtype=np.bool_))
    target = np.minimum(search.fill_target, values.fill_target)
    start = Start(values.estimate_rho, values.log_odds_new, target)
    solve_all(Task(chart, grid, numbers, start), terms, removed, outcome)
    n_known = removed.n_known[:, 0]
    return SolverResult(
        evaluation=evaluation_of(terms, values),
        memory=values.components.like(memory[:, :, : max(int(n_known.max()), 1)]),
        n_known=n_known,
        snr_db=values.snr_db,
        iterations=outcome.iterations,
        finished=outcome.finished,
    )


def empty_terms(values: InitialValues, L: int, linear: bool) -> Terms:
    """Return the terms of all problems with their snapshots, numbers and variances."""
    B, F, M, N = values.Y.shape
    n_rows = values.components.packed.shape[1]

    def real(*shape: int) -> Float:
        return np.zeros((B, *shape))

    def zeros(*shape: int) -> np.ndarray[tuple[int, ...], np.dtype[np.complex128]]:
        return np.zeros((B, F, *shape), dtype=np.complex128)

    return Terms(
        Y=np.ascontiguousarray(values.Y), packed=real(n_rows, L), K=values.K[:, None].copy(),
        nu=values.nu.copy(), tau=values.tau.copy(),
        log_prior_inactive=values.log_prior_inactive[:, None].copy(),
        responses=zeros(3, L, M), X=zeros(3 if linear else 4, L, L), h=zeros(3, L, N),
        uncertainty_loss=real(F, L), prior_gradient=real(L), prior_curvature=real(L), D=real(L),
        log_prior=real(1), W=zeros(L, N), G=zeros(L, L), explained=real(F), F=real(1),
    )  # fmt: skip


def evaluation_of(terms: Terms, values: InitialValues) -> Evaluation:
    """Return the terms as an evaluation, without slots that no problem uses."""
    K, L = terms.K[:, 0], terms.packed.shape[2]
    return Evaluation(
        Y=terms.Y, components=values.components.like(terms.packed), K=K,
        used=np.arange(L) < K[:, None], nu=terms.nu, tau=terms.tau,
        log_prior_inactive=terms.log_prior_inactive[:, 0], A=terms.responses[:, :, 0],
        X=terms.X, h=terms.h, uncertainty_loss=terms.uncertainty_loss,
        prior_gradient=terms.prior_gradient[:, None],
        prior_curvature=terms.prior_curvature[:, None], D=terms.D,
        log_prior=terms.log_prior[:, 0], W=terms.W, G=terms.G, explained=terms.explained,
        F=terms.F[:, 0],
    ).trimmed()  # fmt: skip
