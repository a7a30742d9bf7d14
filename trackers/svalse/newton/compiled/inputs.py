"""The compiled solver's inputs from the array program's records, and its result as one of them."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from arrivals.measurement_models.manifolds.uniform_line import UniformLineManifold
from arrivals.trackers.marginal_variances import student_table
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
)
from arrivals.trackers.svalse.newton.marginals import ComponentMarginals
from arrivals.trackers.svalse.newton.problems import InitialValues
from arrivals.trackers.svalse.newton.state import SolverResult
from arrivals.trackers.svalse.newton.support_search import SupportSearch
from arrivals.typing import Float, Int


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
            k, *sizes_of(k), G, chart.norm2[:, 0].astype(np.float64),
            none if chart.series is None else np.ascontiguousarray(chart.series.T),
            float(response.tempering), float(response.power_floor), float(response.noise_floor),
            float(chart.longest_step), float(chart.max_variance),
            float(manifold.step) if isinstance(manifold, UniformLineManifold) else 0.0,
            bool(manifold.front_back_ambiguous),
        ),
        GridNumbers(
            grid.theta, grid.doa, np.ascontiguousarray(grid.A), *real_responses(chart, grid),
            full(grid.gram[:, 0], F, grid), full(grid.norm2, F, grid), float(grid.log_range),
            float(grid.cos_apart), float(grid.cos_merge), float(grid.cos_near), float(grid.merge),
            float(grid.merge_correlation or 0.0),
        ),
        SearchNumbers(
            limits.inner, limits.removal, limits.fill, limits.final, limits.max_changes,
            search.max_iterations, search.n_components, search.max_active,
            float(limits.inner_tolerance), float(limits.large_gain), float(search.tolerance),
            float(search.kl_weight), bool(search.reestimate), *student_table(),
        ),
    )  # fmt: skip


def full(values: Float, n_bins: int, grid: AngleCandidates) -> Float:
    """Return a copy of values for each bin and point of the grid.

    It can be written to for any number of bins: numba compiles anew for one that cannot.
    """
    return np.array(np.broadcast_to(values, (n_bins, grid.n_points)), order="C")


def sizes_of(k: Float) -> tuple[Float, Int]:
    """Return the values of |k|, and where that of each harmonic stands."""
    sizes, column = np.unique(np.abs(k), return_inverse=True)
    return sizes, column.astype(np.int64)


def real_responses(chart: AngleChart, grid: AngleCandidates) -> tuple[Float, Int, Float]:
    """Return R, column and sign of `GridNumbers`; sensors k and -k of a line have one column."""
    k = chart.jk.imag
    if not chart.is_linear:
        k = np.arange(1.0, chart.n_sensors + 1)  # every sensor has its own
    _, first, column = np.unique(np.abs(k), return_index=True, return_inverse=True)
    R = np.concatenate([grid.A.real[:, :, first], grid.A.imag[:, :, first]], axis=2)
    sign = np.where(k * k[first][column] < 0, -1.0, 1.0)
    return np.ascontiguousarray(R), column.astype(np.int64), sign


def solve_compiled(search: SupportSearch, values: InitialValues) -> SolverResult:
    """Solve problems by the compiled functions.

    Parameters
    ----------
    search : SupportSearch
        Of an array of which there is a compiled form.
    values : InitialValues
        Its variances are replaced by those of the solution.

    Returns
    -------
    SolverResult
        The same as that of the array program, up to rounding.
    """
    from arrivals.trackers.svalse.newton.compiled.solve import solve_all

    chart, grid, numbers = numbers_of(search)
    old, (B, F, _, N) = values.components.packed, values.Y.shape
    n_rows, n_tracked = old.shape[1:]
    L = max(n_tracked, search.max_active) + 1
    n_slots = n_tracked + search.limits.max_changes + 3 * L  # each change removes one at most
    packed, memory = np.zeros((B, n_rows, L)), np.zeros((B, n_rows, n_slots))
    packed[:, :, :n_tracked] = memory[:, :, :n_tracked] = old
    start = Start(
        np.ascontiguousarray(values.Y), packed, values.K.copy(), values.nu, values.tau,
        values.log_prior_inactive, values.estimate_rho, values.log_odds_new,
        np.minimum(search.fill_target, values.fill_target),
    )  # fmt: skip
    removed = Removed(
        memory,
        np.zeros((B, n_tracked), dtype=np.bool_),
        np.zeros((B, grid.theta.size), dtype=np.bool_),
        values.K[:, None].copy(),
    )
    of_each = np.zeros((3, B, L))
    outcome = Outcome(
        np.zeros(B, dtype=np.int64), np.zeros(B, dtype=np.bool_),
        np.zeros((B, F, L, N), dtype=np.complex128), of_each[0], of_each[1], of_each[2],
    )  # fmt: skip
    solve_all(Task(chart, grid, numbers, start), removed, outcome)
    return SolverResult(
        components=values.components.like(packed),
        K=start.K,
        W=outcome.W,
        nu=start.nu,
        tau=start.tau,
        marginals=ComponentMarginals(
            outcome.covariance[:, None], outcome.stated_covariance[:, None], outcome.log_odds
        ),
        memory=values.components.like(memory),
        n_known=removed.n_known[:, 0],
        snr_db=values.snr_db,
        iterations=outcome.iterations,
        finished=outcome.finished,
    )
