"""The fast engine of VALSE and SVALSE: joint Newton steps and single moves of the support.

The support is changed by one move at a time from a warm one, each followed by a few Newton steps
on all angles together; a move stays only if it raises the support criterion.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from arrivals.measurement_models.manifolds.manifold import Manifold
from arrivals.trackers.svalse.components import (
    ComponentPosterior,
    ComponentPrior,
    SolverSettings,
)
from arrivals.trackers.svalse.coordinate.solver import CoordinateSolver
from arrivals.trackers.svalse.newton.batch import every, some
from arrivals.trackers.svalse.newton.candidates import Grid, removal_gains
from arrivals.trackers.svalse.newton.expected_response import ExpectedResponse
from arrivals.trackers.svalse.newton.state import Problem, SolverState, nothing_found, result, start
from arrivals.trackers.svalse.newton.step import ascend
from arrivals.trackers.svalse.newton.support_search import (
    DEFAULT_LIMITS,
    IterationLimits,
    SupportSearch,
)
from arrivals.trackers.svalse.noise_initialization import noise_floor, power_floor
from arrivals.typing import Complex
from arrivals.validation import instance, probability

MAX_AGE = 3  # steps that a component is remembered without being active
FILL_SHARE = 0.5  # components added before the noise is learned: of the sensors of a filled line
SNR_WEIGHT = 0.3  # of the newest signal-to-noise ratio in the start of the next step
GRID_POINTS_PER_SENSOR = 4  # angles at which components may be added


@dataclass(frozen=True)
class NewtonSolver(SolverSettings):
    """Joint Newton steps on all angles, and single changes of the support.

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
        bins of a recording are not independent, and deviate from a plane wave alike.
    power_floor : float, optional
        Smallest power of a source, in units of the noise of one snapshot after beamforming. None
        is 0 for one snapshot a step, which is the paper's model, and 3 for several.
    max_snr_db : float, optional
        Signal-to-noise ratio that bounds the noise from below: model errors count as noise.
    kl_weight : float
        Share of the cost of localising a component, nats, that is charged in decisions on the
        support. 1 is the exact bound; less finds weaker sources, and more false ones below 10 dB.
    limits : IterationLimits
        Numbers of Newton steps and of changes of the support.

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
    limits: IterationLimits = DEFAULT_LIMITS

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "kl_weight", probability("kl_weight", self.kl_weight))
        instance("limits", self.limits, IterationLimits)

    def solve(
        self, snapshots: Complex, manifold: Manifold, prior: ComponentPrior | None
    ) -> ComponentPosterior:
        """Fit snapshots (n_bins, n_sensors, n_snapshots); without a prior nothing is known."""
        return self.solve_batch([snapshots], manifold, [prior])[0]

    def solve_batch(
        self,
        snapshots: Sequence[Complex],
        manifold: Manifold,
        priors: Sequence[ComponentPrior | None],
    ) -> list[ComponentPosterior]:
        """Fit independent snapshots of one array, as one array program."""
        whole = any(prior is not None and prior.n_moments for prior in priors)
        if whole or len(manifold.nuisance_weights) > 1:
            return self.converted(CoordinateSolver).solve_batch(snapshots, manifold, priors)
        most = self.n_components(manifold.n_sensors)
        problems = [Problem(Y, known, most) for Y, known in zip(snapshots, priors, strict=True)]
        fits = [nothing_found(problem, MAX_AGE) for problem in problems]
        heard = [i for i, problem in enumerate(problems) if not problem.silent]
        if heard and manifold.n_sensors > 1:
            merge = max(self.merge_distance(prior) for prior in priors)
            solved = self._solved([problems[i] for i in heard], manifold, merge)
            for i, fit in zip(heard, solved, strict=True):
                fits[i] = fit
        return fits

    def _solved(
        self, problems: list[Problem], manifold: Manifold, merge: float
    ) -> list[ComponentPosterior]:
        """Fit snapshots that have power: moves and Newton steps in turn until all rest."""
        moves = moves_on(self, manifold, problems[0].Y.shape[2], merge)
        work = start(problems, moves.response, self, len(moves.grid.theta), moves.places)
        work.left[:] = np.where(work.free, 0, self.limits.inner)
        work.tolerance[:] = self.limits.inner_tolerance
        fits: dict[int, ComponentPosterior] = {}
        while len(work):
            over = work.left == 0
            if some(over):
                part = work.take(over)
                moves.choose(part)
                work = work.put(over, part)
                if some(work.done):
                    gains = removal_gains(moves.response, work.state, self.kl_weight)
                    for i in map(int, np.flatnonzero(work.done)):
                        n = int(work.row[i])
                        fits[n] = result(work, i, problems[n], manifold, gains, SNR_WEIGHT, MAX_AGE)
                    if every(work.done):
                        break
                    work = work.take(~work.done)
                work.state, work.saved = work.state.trimmed(), work.saved.trimmed()
            self.climb(moves.response, work)
        return [fits[n] for n in range(len(problems))]

    def climb(self, response: ExpectedResponse, work: SolverState) -> None:
        """Take one Newton step in every problem; a burst goes on while its steps gain much."""
        before = work.state.F
        work.state = ascend(response, work.state, work.learn)
        work.iterations = work.iterations + 1
        gain = np.abs(work.state.F - before)
        left = np.where(gain > self.limits.large_gain, np.maximum(work.left, 2), work.left)
        work.left = np.where(gain < work.tolerance, 0, left - 1)
        work.left = np.minimum(work.left, self.max_iterations - work.iterations)


@lru_cache(maxsize=16)  # of a whole array, and of some sets of sensors: each holds a grid of waves
def moves_on(
    solver: NewtonSolver, manifold: Manifold, n_snapshots: int, merge: float
) -> SupportSearch:
    """Return the moves between Newton steps, for an array and so many snapshots a step."""
    M, n_looks = manifold.n_sensors, manifold.n_bins * n_snapshots
    most = solver.n_components(M)
    response = ExpectedResponse(
        manifold,
        solver.tempering,
        power_floor(solver.power_floor, n_looks),
        noise_floor(solver.max_snr_db),
    )
    return SupportSearch(
        response,
        Grid(response, GRID_POINTS_PER_SENSOR, merge),
        solver.limits,
        solver.kl_weight,
        places=most,
        most=min(most, M - 1),
        fill_to=min(int(np.ceil(round(FILL_SHARE * response.extent, 6))), most, M - 1),
        max_iterations=solver.max_iterations,
        tolerance=solver.tolerance,
        relearn=n_looks > 1 or manifold.coefficients is not None,
    )
