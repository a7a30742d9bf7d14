"""Solver of VALSE and SVALSE by joint Newton steps and single changes of the support.

The support is changed by one component at a time from that of the prediction, each change
followed by a few Newton steps on all unknowns together; a change is kept only if it raises the
support criterion.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from arrivals.measurement_models.manifolds.manifold import (
    Manifold,
    is_angle_manifold,
    is_point_manifold,
)
from arrivals.trackers.svalse.components import (
    ComponentPosterior,
    ComponentPrior,
    SolverSettings,
)
from arrivals.trackers.svalse.coordinate.solver import CoordinateSolver
from arrivals.trackers.svalse.newton.batch import all_set, any_set
from arrivals.trackers.svalse.newton.candidate_grid import candidate_grid
from arrivals.trackers.svalse.newton.compiled.inputs import solve_compiled
from arrivals.trackers.svalse.newton.compiled.selection import CompiledChoice, is_compiled
from arrivals.trackers.svalse.newton.expected_response import ExpectedResponse
from arrivals.trackers.svalse.newton.problems import StepInput, initial_values
from arrivals.trackers.svalse.newton.state import (
    SolverResult,
    SolverState,
    inactive_posterior,
    initial_state,
    solved_posterior,
    unsolved,
)
from arrivals.trackers.svalse.newton.step import newton_step
from arrivals.trackers.svalse.newton.support_search import (
    DEFAULT_LIMITS,
    IterationLimits,
    SupportSearch,
)
from arrivals.trackers.svalse.noise_initialization import noise_floor, power_floor
from arrivals.typing import Complex
from arrivals.validation import instance, one_of, probability

FILL_SHARE = 0.5  # components added before the noise is estimated, per sensor of a filled line


@dataclass(frozen=True)
class NewtonSolver(SolverSettings):
    """Joint Newton steps on all unknowns, and single changes of the support.

    Parameters
    ----------
    tolerance : float
        Change of the ELBO, nats, at which the final Newton steps stop.
    max_iterations : int
        Largest number of Newton steps; a step that needs more is reported as not converged.
    max_components : int, optional
        Largest number of components; that of the sensors if None.
    merge : float, optional
        Distance, rad of direction, below which the later of two active components is removed; 0
        for never. None is 1.5 degrees for tracked components (SVALSE) and 0 for independent
        snapshots (VALSE).
    snr_db : float, optional
        Signal-to-noise ratio from which the noise starts in a first step; later ones start from
        the steps before. If None, that of the covariance of at least as many snapshots as sensors;
        with fewer 20, or for one snapshot of a line without a prior (VALSE) that of the lags.
    tempering : float
        Number of snapshots that count as one, at least 1: overlapping windows and neighbouring
        bins of a recording are not independent, and deviate equally from a plane wave.
    power_floor : float, optional
        Smallest power of a source, in units of the noise of one snapshot after beamforming. None
        is 0 for one snapshot a step, which is the paper's model, and 3 for several.
    max_snr_db : float, optional
        Signal-to-noise ratio that bounds the noise from below: model errors count as noise.
    kl_weight : float
        Share of the cost of localising a component, nats, that is charged in decisions on the
        support. 1 is the exact bound; less finds weaker sources, and more false ones below 10 dB.
    merge_correlation : float, optional
        Instead of a distance: correlation of the responses, in all bins, above which the later of
        two active components is removed; in (0, 1]. It needs no scale, and is the default with
        azimuth and elevation, 0.99, and of spherical waves, 0.95, of which several may have one
        direction.
    curved_probability : float
        Prior probability that a wave is curved, where sources have a range.
    limits : IterationLimits
        Numbers of Newton steps and of changes of the support.
    compiled : {"auto", True, False}
        Solve one problem at a time by functions that numba compiles, `arrivals[fast]`. "auto" does
        so where there are such functions, for every array with one angle a source.

    Notes
    -----
    An unknown slowness or elevation, and whole densities of the angles, need coordinate ascent:
    these measurements are passed to a `CoordinateSolver` with the same settings.

    Examples
    --------
    >>> NewtonSolver(max_components=3).kl_weight
    0.5
    """

    kl_weight: float = 0.5
    merge_correlation: float | None = None
    curved_probability: float = 0.2
    limits: IterationLimits = DEFAULT_LIMITS
    compiled: CompiledChoice = "auto"

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "kl_weight", probability("kl_weight", self.kl_weight))
        if (
            self.merge_correlation is not None
            and not probability("merge_correlation", self.merge_correlation) > 0
        ):
            raise ValueError(f"merge_correlation must lie in (0, 1]; got {self.merge_correlation}")
        if not 0 < probability("curved_probability", self.curved_probability) < 1:
            got = self.curved_probability
            raise ValueError(f"curved_probability must lie between 0 and 1; got {got}")
        instance("limits", self.limits, IterationLimits)
        if self.compiled is not True and self.compiled is not False:
            one_of("compiled", self.compiled, ("auto", True, False))

    def check(self, manifold: Manifold, n_snapshots: int, n_moments: int) -> None:
        """Raise ValueError if compiled functions are required and there are none."""
        if self.compiled is True:
            is_compiled(True, manifold, n_moments)

    def merging(self, manifold: Manifold, with_prior: bool) -> tuple[float, float | None]:
        """Return the distance, rad, and the correlation by which components are merged."""
        correlation = self.merge_correlation
        if correlation is None and self.merge is None and is_point_manifold(manifold):
            correlation = manifold.merge_correlation
        return self.merge_distance(with_prior), correlation

    def solve(
        self, snapshots: Complex, manifold: Manifold, prior: ComponentPrior | None
    ) -> ComponentPosterior:
        """Return the components in the snapshots of one step.

        Parameters
        ----------
        snapshots : ndarray, shape (n_bins, n_sensors, n_snapshots)
            Data without gaps.
        manifold : Manifold
            Response of these sensors in these bins.
        prior : ComponentPrior or None
            Prediction of the components; None without one.

        Returns
        -------
        ComponentPosterior
            Tracked components first.
        """
        return self.solve_batch([snapshots], manifold, [prior])[0]

    def solve_batch(
        self,
        snapshots: Sequence[Complex],
        manifold: Manifold,
        priors: Sequence[ComponentPrior | None],
    ) -> list[ComponentPosterior]:
        """Return the components of independent steps of one array, in one array program.

        Parameters
        ----------
        snapshots : sequence of ndarray, shape (n_bins, n_sensors, n_snapshots)
            Data without gaps, all of one shape.
        manifold : Manifold
            Response of these sensors in these bins.
        priors : sequence of ComponentPrior or None
            Predictions of the components; all None without them.

        Returns
        -------
        list of ComponentPosterior
            In the order of the snapshots.
        """
        coordinate = any(prior is not None and prior.n_moments for prior in priors)
        if is_angle_manifold(manifold):
            coordinate |= len(manifold.nuisance_weights) > 1
        if coordinate:
            return self.converted(CoordinateSolver).solve_batch(snapshots, manifold, priors)
        search = support_search(self, manifold, snapshots[0].shape[2], priors[0] is not None)
        steps = [
            StepInput(Y, prior, search.n_components)
            for Y, prior in zip(snapshots, priors, strict=True)
        ]
        powered = [i for i, step in enumerate(steps) if not step.no_power and search.max_active]
        solved = self._solve([steps[i] for i in powered], search) if powered else []
        posteriors = dict(zip(powered, solved, strict=True))
        return [
            posteriors.get(i) or inactive_posterior(step, search.response.chart)
            for i, step in enumerate(steps)
        ]

    def _solve(self, steps: list[StepInput], search: SupportSearch) -> list[ComponentPosterior]:
        """Alternate Newton steps and changes of the support until neither gains.

        The support search fills, estimates ν and τ, merges, removes, adds and finishes, in that
        order.
        """
        values = initial_values(steps, search.response, self, search.n_components)
        if is_compiled(self.compiled, search.response.manifold):
            solved, chart = solve_compiled(search, values), search.response.chart
            return [solved_posterior(solved, i, step, chart) for i, step in enumerate(steps)]
        state = initial_state(values, search.response, search.grid.n_points)
        state.steps_remaining[:] = np.where(state.estimate_rho, 0, self.limits.inner)
        state.tolerance[:] = self.limits.inner_tolerance
        posteriors: dict[int, ComponentPosterior] = {}
        while True:
            due = state.steps_remaining == 0
            if any_set(due):
                part = state.select(due)
                search.next_change(part)
                state = state.replace_rows(due, part)
                posteriors |= done_posteriors(state, steps, search)
                if all_set(state.done):
                    return [posteriors[n] for n in range(len(steps))]
                state = unsolved(state)
            self.advance(search, state)

    def advance(self, search: SupportSearch, state: SolverState) -> None:
        """Take one Newton step in every problem; those with a large gain take another."""
        before = state.evaluation.F
        state.evaluation = newton_step(search.response, state.evaluation, state.estimate_nu)
        state.iterations = state.iterations + 1
        gain = np.abs(state.evaluation.F - before)
        steps = np.where(
            gain > self.limits.large_gain, np.maximum(state.steps_remaining, 2),
            state.steps_remaining,
        )  # fmt: skip
        steps = np.where(gain < state.tolerance, 0, steps - 1)
        state.steps_remaining = np.minimum(steps, self.max_iterations - state.iterations)


def done_posteriors(
    state: SolverState, steps: Sequence[StepInput], search: SupportSearch
) -> dict[int, ComponentPosterior]:
    """Return the posteriors of the problems that are done, by their numbers."""
    if not any_set(state.done):
        return {}
    done = state.select(state.done)
    solved, chart = SolverResult.of(done, search.response, search.kl_weight), search.response.chart
    return {
        n: solved_posterior(solved, i, steps[n], chart) for i, n in enumerate(done.problem.tolist())
    }


@lru_cache(maxsize=16)  # arrays, and some sets of their sensors: each holds a grid of responses
def support_search(
    solver: NewtonSolver, manifold: Manifold, n_snapshots: int, with_prior: bool
) -> SupportSearch:
    """Return the support search of an array with so many snapshots a step.

    Parameters
    ----------
    solver : NewtonSolver
        Settings.
    manifold : Manifold
        Response of the array.
    n_snapshots : int
        Snapshots of a step.
    with_prior : bool
        True if components have a prior, which sets the default distance of merging.

    Returns
    -------
    SupportSearch
        The same for equal arguments.
    """
    M, n_all = manifold.n_sensors, manifold.n_bins * n_snapshots
    n = solver.n_components(M)
    response = ExpectedResponse(
        manifold,
        solver.tempering,
        power_floor(solver.power_floor, n_all),
        noise_floor(solver.max_snr_db),
    )
    return SupportSearch(
        response,
        candidate_grid(response, *solver.merging(manifold, with_prior)),
        limits=solver.limits,
        tolerance=solver.tolerance,
        max_iterations=solver.max_iterations,
        kl_weight=solver.kl_weight,
        n_components=n,
        max_active=min(n, M - 1),
        fill_target=min(int(np.ceil(round(FILL_SHARE * response.extent, 6))), n, M - 1),
        reestimate=n_all > 1 or not response.chart.is_plain,
        curved_probability=solver.curved_probability,
    )
