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
from arrivals.trackers.svalse.components import ComponentPosterior, ComponentPrior
from arrivals.trackers.svalse.newton.batch import every, some
from arrivals.trackers.svalse.newton.candidates import Grid, removal_gains
from arrivals.trackers.svalse.newton.expected_response import ExpectedResponse
from arrivals.trackers.svalse.newton.state import Problem, SolverState, nothing_found, result, start
from arrivals.trackers.svalse.newton.step import ascend
from arrivals.trackers.svalse.newton.support_search import IterationLimits, SupportSearch
from arrivals.trackers.svalse.noise_initialization import noise_floor, power_floor
from arrivals.typing import Complex


@dataclass(frozen=True)
class NewtonSolver:
    """Settings of the engine.

    Parameters
    ----------
    tolerance : float
        Change of the ELBO, nats, at which the last Newton steps rest.
    max_iterations : int
        Newton steps at most.
    merge : float
        Two active components nearer than this, rad of direction, become one; 0 for never.
    snr_db : float or None
        Signal-to-noise ratio from which the noise starts where the prediction has none. None
        estimates it from the covariance of as many snapshots as sensors, or from the lags of one
        look of a line; elsewhere it is 20.
    max_components : int or None
        As many as there are sensors if None.
    kl : float
        Share of the angles' KL divergences that is charged in decisions on the support.
    fill : float
        Components, as a share of the sensors of a filled line of the same extent, up to which
        some are added before the noise is learned.
    max_age : int
        Steps that a component is remembered without being active.
    keep : float
        Weight of the newest signal-to-noise ratio in the start of the next step.
    inner, removal, fill_inner, final : int
        Newton steps after a move, after a removal, after a move while filling, and at the end.
    inner_tolerance : float
        Change of the ELBO, nats, at which those after a move rest.
    far : float
        Gain of a Newton step, nats, after which another follows in any case.
    grid : int
        Angles for each sensor at which components may be born.
    max_moves : int
        Changes of the support at most.
    temper : float
        Looks of a step that count as one.
    power_floor : float or None
        Power, in units of one look's noise after beamforming, below which nothing is a source;
        None is 0 for one look and 3 for several.
    max_snr_db : float or None
        Signal-to-noise ratio beyond which what is left of the data is laid to the model.
    """

    tolerance: float = 1e-4
    max_iterations: int = 500
    merge: float = np.deg2rad(1.5)
    snr_db: float | None = 20.0
    max_components: int | None = None
    kl: float = 0.5
    fill: float = 0.5
    max_age: int = 3
    keep: float = 0.3
    inner: int = 3
    removal: int = 1
    fill_inner: int = 2
    final: int = 12
    inner_tolerance: float = 1e-2
    far: float = 10.0
    grid: int = 4
    max_moves: int = 60
    temper: float = 1.0
    power_floor: float | None = None
    max_snr_db: float | None = None

    def fit(
        self, Y: Complex, manifold: Manifold, prediction: ComponentPrior | None
    ) -> ComponentPosterior:
        """Fit looks (n_bins, n_sensors, n_snapshots); no prediction: nothing is known."""
        return self.fit_batch([Y], manifold, [prediction])[0]

    def fit_batch(
        self,
        Ys: Sequence[Complex],
        manifold: Manifold,
        predictions: Sequence[ComponentPrior | None],
    ) -> list[ComponentPosterior]:
        """Fit independent snapshots of one array, as one array program."""
        most = self.most(manifold)
        problems = [Problem(Y, known, most) for Y, known in zip(Ys, predictions, strict=True)]
        fits = [nothing_found(problem, self.max_age) for problem in problems]
        heard = [i for i, problem in enumerate(problems) if not problem.silent]
        if heard and manifold.n_sensors > 1:
            solved = self._solved([problems[i] for i in heard], manifold)
            for i, fit in zip(heard, solved, strict=True):
                fits[i] = fit
        return fits

    def most(self, manifold: Manifold) -> int:
        """Return how many components there may be on an array."""
        return min(manifold.n_sensors, self.max_components or manifold.n_sensors)

    def _solved(self, problems: list[Problem], manifold: Manifold) -> list[ComponentPosterior]:
        """Fit snapshots that have power: moves and Newton steps in turn until all rest."""
        moves = moves_on(self, manifold, problems[0].Y.shape[2])
        work = start(problems, moves.response, self.snr_db, len(moves.grid.theta), moves.places)
        work.left[:] = np.where(work.free, 0, self.inner)
        work.tolerance[:] = self.inner_tolerance
        fits: dict[int, ComponentPosterior] = {}
        while len(work):
            over = work.left == 0
            if some(over):
                part = work.take(over)
                moves.choose(part)
                work = work.put(over, part)
                if some(work.done):
                    gains = removal_gains(moves.response, work.state, self.kl)
                    for i in map(int, np.flatnonzero(work.done)):
                        n = int(work.row[i])
                        fits[n] = result(
                            work, i, problems[n], manifold, gains, self.keep, self.max_age
                        )
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
        left = np.where(gain > self.far, np.maximum(work.left, 2), work.left)
        work.left = np.where(gain < work.tolerance, 0, left - 1)
        work.left = np.minimum(work.left, self.max_iterations - work.iterations)


@lru_cache(maxsize=16)  # of a whole array, and of some sets of sensors: each holds a grid of waves
def moves_on(engine: NewtonSolver, manifold: Manifold, n_snapshots: int) -> SupportSearch:
    """Return the moves between Newton steps, for an array and so many snapshots a step."""
    M, most, n_looks = manifold.n_sensors, engine.most(manifold), manifold.n_bins * n_snapshots
    response = ExpectedResponse(
        manifold,
        engine.temper,
        power_floor(engine.power_floor, n_looks),
        noise_floor(engine.max_snr_db),
    )
    return SupportSearch(
        response,
        Grid(response, engine.grid, engine.merge),
        IterationLimits(
            engine.inner,
            engine.removal,
            engine.fill_inner,
            engine.final,
            engine.inner_tolerance,
            engine.tolerance,
        ),
        engine.kl,
        places=most,
        most=min(most, M - 1),
        fill_to=min(int(np.ceil(round(engine.fill * response.extent, 6))), most, M - 1),
        max_moves=engine.max_moves,
        max_iterations=engine.max_iterations,
        relearn=n_looks > 1 or manifold.coefficients is not None,
    )
