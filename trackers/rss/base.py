"""What the trackers of positions from signal strength share: belief, start, motion, labels."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterable

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.base import default_position
from arrivals.measurement_models.signal_strength.log_normal import LogNormalRSS
from arrivals.motion_models.base import MotionModel
from arrivals.trackers.base import Tracker, is_missing
from arrivals.trackers.direction_tracker import padded
from arrivals.trackers.estimates import PositionEstimate
from arrivals.trackers.gaussian.arguments import measurement_vector
from arrivals.trackers.gaussian.equations import likelihood
from arrivals.trackers.rss.arguments import (
    known_sources,
    rest,
    warn_of_few_readings,
    warn_of_places,
    warn_of_too_many,
)
from arrivals.trackers.rss.batch import run_in_chunks
from arrivals.trackers.rss.belief import SourceBeliefs, unflat, where_finite
from arrivals.trackers.rss.inference.goodness_of_fit import Quality, quality
from arrivals.trackers.rss.inference.joint_posterior import JointPosterior
from arrivals.trackers.rss.inference.solution import (
    Solution,
    Status,
    WeightedReadings,
    found_of,
    in_batch,
)
from arrivals.trackers.rss.model_order.birth_death import TrackTable, counted
from arrivals.trackers.rss.model_order.grid_search import NewSourcePrior
from arrivals.trackers.rss.model_order.model_selection import Candidate, best, grown, refined
from arrivals.trackers.run import Run
from arrivals.typing import Bool, Float
from arrivals.validation import count, instance, not_negative, positive, real

PATIENCE = 2  # sources added without gain before counting ends


class RSSTracker(Tracker):
    """Sources that move independently, corrected by readings of signal strength.

    A method says how it finds amplitudes and positions: `solve`. The rest is here; parameters
    are those of `RSSVB`.

    Attributes
    ----------
    x : ndarray, shape (n_slots · (n + 1),)
        State of the motion model and log amplitude, source by source; NaN in unused places.
    P : ndarray, shape (n_slots · (n + 1), n_slots · (n + 1))
        Covariance, of each source by itself.
    label : ndarray of int, shape (n_slots,)
        -1 in unused places.
    existence : ndarray, shape (n_slots,)
        Probabilities that the sources are there; 1 unless `births`.
    elapsed : float
        Time since the last readings.
    log_likelihood, likelihood : float
        Of the last readings, by Laplace's approximation; 0 and 1 if they were missed.
    """

    def __init__(
        self,
        motion: MotionModel,
        measurement: LogNormalRSS,
        x0: ArrayLike | None,
        P0: ArrayLike | None,
        *,
        mu0: ArrayLike,
        v0: ArrayLike,
        q_u: float,
        n_sources: int | None,
        max_sources: int,
        births: bool,
        confirm: int,
        area_std: float | None,
        grid_step: float | None,
        correlation_time: float | None,
    ) -> None:
        self.motion = instance("motion", motion, MotionModel)  # type: ignore[type-abstract]  # any
        model = instance("measurement", measurement, LogNormalRSS)
        self.measurement = model.for_state(motion.state_names)
        if max(self.xy) >= motion.dim_x:
            raise ValueError(
                f"position of the measurement must name entries of the motion's state, below "
                f"{motion.dim_x}; got {self.xy}"
            )
        self.x0, self.P0, self.mu0, self.v0 = x0, P0, mu0, v0
        self.q_u = not_negative("q_u", q_u)
        self.n_sources = None if n_sources is None else count("n_sources", n_sources)
        self.max_sources = count("max_sources", max_sources)
        self.births = instance("births", births, bool)
        self.confirm = count("confirm", confirm)
        for name, value in (
            ("area_std", area_std), ("grid_step", grid_step), ("correlation_time", correlation_time)
        ):  # fmt: skip
            setattr(self, name, None if value is None else positive(name, value))
        self._begin()

    area_std: float | None
    grid_step: float | None
    correlation_time: float | None

    def _begin(self) -> None:
        """Take up what the constructor was told."""
        sources = known_sources(
            self.x0, self.P0, self.mu0, self.v0, self.motion.dim_x, self.xy
        )  # fmt: skip
        K = len(sources.u)
        if self.x0 is not None and self.n_sources not in (None, K):
            raise ValueError(f"n_sources is {self.n_sources}, but x0 has {K} sources")
        if self.births and max(K, self.n_sources or 0) > self.max_sources:
            raise ValueError(f"there are more sources at first than max_sources={self.max_sources}")
        self.census = TrackTable.known(K)
        self.elapsed = np.inf
        self._hold(sources)
        self._note_missed()
        warn_of_few_readings(self.measurement.dim_z, K)
        warn_of_places(sources.x[:, self.xy], self.measurement.sensors)

    # What a method defines

    @abstractmethod
    def solve(self, problem: JointPosterior, u: Float, theta: Float) -> Solution:
        """Find amplitudes and positions for a batch of problems, from starting points."""

    # The belief, flat outside and by source inside

    @property
    def xy(self) -> tuple[int, int]:
        """Entries of a source's state that are its position."""
        return self.measurement.position or default_position(self.motion.dim_x)

    @property
    def n_slots(self) -> int:
        """Number of sources that the belief has room for."""
        if self.births or (self.x0 is None and self.n_sources is None):
            return self.max_sources
        return len(np.atleast_2d(self.x0)) if self.x0 is not None else int(self.n_sources or 0)

    def by_source(self) -> SourceBeliefs:
        """Return the belief by source, those not yet confirmed included."""
        return unflat(real("x", self.x), real("P", self.P), self.motion.dim_x)

    def _hold(self, sources: SourceBeliefs) -> None:
        K = len(sources.u)
        if len(self.census.label) != K:  # another x was assigned
            self.census = TrackTable.known(K)
        n_slots = max(self.n_slots, K)
        self.x, self.P = sources.flat(n_slots)
        self.label = padded(self.census.label, n_slots, -1).astype(np.int64)
        self.existence = padded(self.census.existence, n_slots, np.nan)

    def _note_missed(self) -> None:
        self.log_likelihood = 0.0
        self._status = Status()

    @property
    def likelihood(self) -> float:
        """Likelihood of the last readings, at least the smallest positive float."""
        return likelihood(self.log_likelihood)

    # The two steps

    def predict(self, u: ArrayLike | None = None, *, dt: float = 1.0) -> None:
        """Move the sources by the motion model, and let their amplitudes drift.

        x = f(x), P = F P Fᵀ + Q, v = v + q_u dt; `u` must be None or 0.
        """
        if u is not None and np.any(u):
            raise ValueError("sources take no control input: put it into the motion")
        dt = not_negative("dt", dt)
        self._hold(self.by_source().predicted(self.motion, dt, self.q_u))
        self.elapsed = self.elapsed + dt

    def update(self, z: ArrayLike | None) -> None:
        """Correct the belief by readings, Np, (n_sensors,); NaN where a sensor is missing."""
        if z is None or is_missing(z):
            self._note_missed()
            return
        xi = self.measurement.readings(measurement_vector(z, self.measurement.dim_z))[None]
        told = self.told(xi, np.array([self.elapsed]))
        sources, census = self.by_source(), self.census
        if self.births:
            sources, census, found, judged = self._counted(sources, told)
        elif len(sources.u) == 0:
            sources, census, found, judged = self._started(told)
        else:
            batch, found, judged = self.correct(sources.take(None), told)
            sources = batch.take(0)
        self.census = census
        self.log_likelihood = float(found.log_likelihood[0])
        self._status = Status.of(found, judged, 0)
        self.elapsed = 0.0
        self._hold(sources)

    def told(self, xi: Float, elapsed: Float) -> WeightedReadings:
        """Return a batch of readings with their weights 1/r, times min(1, Δt/τ)."""
        heard = ~np.isnan(xi)
        full = heard / self.measurement.variance
        share = np.ones(len(xi))
        if self.correlation_time is not None:
            share = np.minimum(1.0, elapsed / self.correlation_time)
        return WeightedReadings(np.where(heard, xi, 0.0), share[:, None] * full, full)

    def correct(
        self, sources: SourceBeliefs, told: WeightedReadings
    ) -> tuple[SourceBeliefs, Solution, Quality]:
        """Return a batch of beliefs corrected; those whose solution is not finite stay."""
        problem = JointPosterior(self.measurement.field, told.xi, told.W, sources.prior(self.xy))
        found = self.solve(problem, problem.prior.mu, problem.prior.theta)
        moved = sources.corrected(
            found.u, found.theta, found.marginals, self.xy, self.motion.angles
        )  # fmt: skip
        judged = self._judged(problem._replace(W=told.full), found)
        return where_finite(moved, sources), found, judged

    def _judged(self, problem: JointPosterior, found: Solution) -> Quality:
        with np.errstate(over="ignore", invalid="ignore"):
            q = problem.misfit(problem.field.levels(found.u, found.theta))
        n_heard = (problem.W > 0).sum(axis=-1)
        return quality(q, n_heard, problem.prior, found.theta, found.log_posterior, found.start)

    # Sources that nobody told of

    def newcomers(self, heard: Bool) -> NewSourcePrior:
        """Return what is known of sources not seen yet, by the sensors that are heard."""
        mu, v = float(np.mean(np.asarray(self.mu0))), float(np.mean(np.asarray(self.v0)))
        sensors = self.measurement.sensors[heard]
        return NewSourcePrior.among(sensors, mu, v, self.area_std, self.grid_step)

    def fresh(self, fit: Candidate) -> SourceBeliefs:
        """Return the beliefs that a fit starts: at rest, as uncertain in speed as P0 says."""
        K, n = len(fit.u), self.motion.dim_x
        found, xy = found_of(fit).marginals, np.array(self.xy)
        x, P = np.zeros((K, n)), np.tile(rest(self.P0, n, self.xy), (K, 1, 1))
        x[:, xy] = fit.theta
        P[:, xy[:, None], xy] = found.Sigma[0]
        return SourceBeliefs(x, P, fit.u, found.v[0])

    def _started(
        self, told: WeightedReadings
    ) -> tuple[SourceBeliefs, TrackTable, Solution, Quality]:
        """Return the sources found in a first set of readings, as many as wanted."""
        K, xi, W = self.n_sources, told.xi[0], told.W[0]
        new, field = self.newcomers(W > 0), self.measurement.field
        if K is None:
            fit = best(grown(field, xi, W, new, self.max_sources, PATIENCE), new)
        else:
            warn_of_few_readings(int((W > 0).sum()), K)
            fits = grown(field, xi, W, new, K)
            warn_of_too_many([fit.log_evidence_of_set for fit in fits], K)
            fit = refined(fits[K], new)
        found = found_of(fit)
        judged = self._judged(in_batch(fit.problem), found)
        return self.fresh(fit), TrackTable.known(len(fit.u)), found, judged

    def _counted(
        self, sources: SourceBeliefs, told: WeightedReadings
    ) -> tuple[SourceBeliefs, TrackTable, Solution, Quality]:
        """Return the sources after births and deaths."""
        now = counted(self, sources, self.census, told.xi[0], told.W[0])
        problem = in_batch(now.fit.problem)._replace(W=told.full)
        return now.sources, now.census, now.found, self._judged(problem, now.found)

    # What comes out

    @property
    def estimate(self) -> PositionEstimate:
        """The confirmed sources."""
        sources, census, xy = self.by_source(), self.census, self.xy
        if len(census.label) != len(sources.u):
            census = TrackTable.known(len(sources.u))
        shown = census.confirmed
        return PositionEstimate(
            sources.x[shown][:, xy],
            sources.P[shown][:, xy, :][..., xy],
            sources.u[shown],
            census.existence[shown],
            census.label[shown],
            *self._status,
        )

    def run_batch(
        self, measurements: Iterable[Iterable[ArrayLike | None]], dt: float = 1.0
    ) -> list[Run]:
        """Run independent sequences, each from the present state, as one array program.

        The tracker itself stays as it is. One by one are run: sequences of unequal lengths, and
        all where sources are still to be found or may come and go.

        Parameters
        ----------
        measurements : array_like, shape (n_sequences, n_steps, n_sensors), or nested iterables
            Readings, Np; NaN or None where missing.
        dt : float
            Time between steps.
        """
        positive("dt", dt)
        sequences = [list(sequence) for sequence in measurements]
        alike = len({len(sequence) for sequence in sequences}) == 1 and len(sequences[0]) > 0
        if self.births or not alike or len(self.by_source().u) == 0:
            return super().run_batch(sequences, dt)
        m = self.measurement.dim_z
        z = [[measurement_vector(np.nan if one is None else one, m) for one in row]
             for row in sequences]  # fmt: skip
        return run_in_chunks(self, self.measurement.readings(np.array(z)), dt)
