"""Base of the trackers of positions from signal strength: belief, motion, detection, labels."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterable

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.base import default_position
from arrivals.measurement_models.signal_strength.log_normal import LogNormalRSS
from arrivals.measurements import real_numbers, rows
from arrivals.motion_models.base import MotionModel
from arrivals.trackers.base import Tracker
from arrivals.trackers.estimates import PositionEstimate
from arrivals.trackers.gaussian.equations import likelihood
from arrivals.trackers.rss.arguments import (
    birth_death,
    check_number,
    initial_sources,
    warn_initial,
)
from arrivals.trackers.rss.batch import BatchStart, run_apart, run_in_chunks
from arrivals.trackers.rss.belief import SourceBeliefs, keep_finite
from arrivals.trackers.rss.doppler import Doppler, check_doppler
from arrivals.trackers.rss.inference.joint_posterior import JointPosterior
from arrivals.trackers.rss.inference.solution import Diagnostics, Solution, WeightedReadings
from arrivals.trackers.rss.mirror import Line
from arrivals.trackers.rss.model_order.track_table import TrackTable
from arrivals.trackers.rss.pooled_readings import PooledReadings
from arrivals.trackers.rss.settings import AmplitudePrior, BirthDeath, GridSearch
from arrivals.trackers.run import Run
from arrivals.typing import Float
from arrivals.validation import count, instance, no_control, positive, real, time_step


class RSSTracker(Tracker):
    """Track sources that move independently by readings of signal strength.

    A subclass defines `solve`, the estimation of amplitudes and positions. The parameters are
    those of `RSSVB` except `solver`.

    Attributes
    ----------
    x : ndarray, shape (n_slots · (n + 1),)
        State of the motion model and log amplitude, source by source; NaN in unused slots.
    P : ndarray, shape (n_slots · (n + 1), n_slots · (n + 1))
        Covariance; sources are independent.
    label : ndarray of int, shape (n_slots,)
        Labels; -1 in unused slots.
    existence : ndarray, shape (n_slots,)
        Probabilities of existence; 1 without `births`.
    elapsed : float
        Time since the last readings.
    log_likelihood, likelihood : float
        Of the last readings, by Laplace's approximation; 0 and 1 if they were missing.
    """

    def __init__(
        self,
        motion: MotionModel,
        measurement: LogNormalRSS,
        x0: ArrayLike | None,
        P0: ArrayLike | None,
        *,
        n_sources: int | None,
        amplitude: AmplitudePrior,
        births: BirthDeath | bool | None,
        search: GridSearch,
        correlation_time: float | None,
    ) -> None:
        self.motion = instance("motion", motion, MotionModel)  # type: ignore[type-abstract]  # any
        model = instance("measurement", measurement, LogNormalRSS)
        self.measurement = model.for_state(motion.state_names)
        if max(self.position) >= motion.dim_x:
            raise ValueError(
                f"position of the measurement must be entries of the motion's state, below "
                f"{motion.dim_x}; got {self.position}"
            )
        self.x0, self.P0 = x0, P0
        self.n_sources = None if n_sources is None else count("n_sources", n_sources, maximum=1000)
        self.amplitude = instance("amplitude", amplitude, AmplitudePrior)
        self.births = birth_death(births)
        check_doppler(motion, amplitude.wave_speed, bool(self.births))
        self.search = instance("search", search, GridSearch)
        if correlation_time is not None:
            positive("correlation_time", correlation_time)
        self.correlation_time = correlation_time
        sources = initial_sources(x0, P0, self.amplitude, motion.dim_x, self.position)
        limit = search.max_sources if self.births else None
        check_number(sources, self.n_sources, model.dim_z, limit)
        self.tracks = TrackTable.certain(len(sources.u))
        self.label, self.existence = self.tracks.padded(0)
        self.elapsed = np.inf
        self.pool = PooledReadings.none(model.dim_z)
        self.settling = 0  # steps in which the places of detected sources are checked
        self.line: Line | None = None  # of all sensors with readings
        self.set_belief(sources, self.tracks)
        self.record_missed()
        warn_initial(sources.x[:, self.position], self.measurement.sensors)

    @abstractmethod
    def solve(self, problem: JointPosterior, u: Float, theta: Float) -> Solution:
        """Estimate amplitudes and positions of a batch of problems, from starting points."""

    @property
    def position(self) -> tuple[int, int]:
        """Entries of a source's state that are its position."""
        return self.measurement.position or default_position(self.motion.dim_x)

    @property
    def n_slots(self) -> int:
        """Number of sources that `x` and `P` have room for."""
        if self.births or (self.x0 is None and self.n_sources is None):
            return self.search.max_sources
        return len(np.atleast_2d(self.x0)) if self.x0 is not None else int(self.n_sources or 0)

    def source_beliefs(self) -> SourceBeliefs:
        """Return the belief by source, unconfirmed sources included."""
        return SourceBeliefs.from_state(real("x", self.x), real("P", self.P), self.motion.dim_x)

    def current_tracks(self, n_sources: int) -> TrackTable:
        """Return the track table, a new one if another number of sources was assigned to `x`."""
        same = len(self.tracks.label) == n_sources
        return self.tracks if same else TrackTable.certain(n_sources)

    def set_belief(self, sources: SourceBeliefs, tracks: TrackTable) -> None:
        """Set `x`, `P`, `label` and `existence`."""
        n_slots = max(self.n_slots, len(sources.u))
        self.x, self.P = sources.to_state(n_slots)
        if tracks is not self.tracks or len(self.label) != n_slots:
            self.tracks = tracks
            self.label, self.existence = tracks.padded(n_slots)

    def record_missed(self) -> None:
        """Record that the readings of a step are missing."""
        self.log_likelihood = 0.0
        self.diagnostics = Diagnostics()

    @property
    def likelihood(self) -> float:
        """Likelihood of the last readings, at least the smallest positive float."""
        return likelihood(self.log_likelihood)

    def predict(self, u: ArrayLike | None = None, *, dt: float = 1.0) -> None:
        """Predict the sources by the motion model, and their amplitudes by a random walk.

        Parameters
        ----------
        u : None or 0
            Not used; for filterpy's calling convention.
        dt : float
            Time since the last step.
        """
        dt = time_step(dt)
        no_control(u)
        sources = self.source_beliefs()
        predicted = self.predict_sources(sources, dt)
        self.set_belief(predicted, self.current_tracks(len(sources.u)))
        self.elapsed = self.elapsed + dt
        if self.births or self.settling or sources.u.size == 0:
            self.pool = self.pool.later(dt)

    def predict_sources(self, sources: SourceBeliefs, dt: float) -> SourceBeliefs:
        """Return beliefs after `dt`."""
        # x = f(x), P = F P F' + Q, v = v + q_u dt
        try:
            with np.errstate(over="ignore", invalid="ignore"):
                predicted = sources.predicted(self.motion, dt, self.amplitude.drift)
            finite = all(np.isfinite(part).all() for part in predicted)
        except OverflowError:
            finite = False
        if not finite:
            raise ValueError(f"dt must be small enough for finite covariances; got {dt:g}")
        return predicted

    def observe(self, z: ArrayLike | None) -> WeightedReadings | None:
        """Return one set of readings with its weights, batch axis in front; None if missing."""
        z = self.vector(z)
        if np.isnan(z).all():
            return None
        readings = self.weighted(self.measurement.readings(z)[None], np.array([self.elapsed]))
        return readings if readings.W.any() else None

    def vector(self, z: ArrayLike | None) -> Float:
        """Return a measurement as (n_sensors,); NaN everywhere if it is missing."""
        m = self.measurement.dim_z
        array = real_numbers("z", np.nan if z is None else z)
        if array.shape == (m,):
            return array
        if array.size == 1 and np.isnan(array).all():
            return np.full(m, np.nan)
        if array.size != m or max(array.shape, default=1) != m:
            raise ValueError(f"z must have shape ({m},) or ({m}, 1); got {array.shape}")
        return array.reshape(m)

    def weighted(self, xi: Float, elapsed: Float) -> WeightedReadings:
        """Return readings (n_batch, n_sensors) with the weights min(1, Δt/τ)/r, 0 if missing."""
        valid = ~np.isnan(xi)
        precision = valid / self.measurement.variance
        tau = self.correlation_time
        fraction = np.ones(len(xi)) if tau is None else np.minimum(1.0, elapsed / tau)
        return WeightedReadings(np.where(valid, xi, 0.0), fraction[:, None] * precision, precision)

    def joint_posterior(self, sources: SourceBeliefs, readings: WeightedReadings) -> JointPosterior:
        """Return the joint posterior (7) of predicted sources and readings."""
        prior, propagation = sources.prior(self.position), self.measurement.propagation
        if (c := self.amplitude.wave_speed) is not None:  # β of (1)
            doppler = Doppler.of(self.motion, c, bool(self.births))
            propagation = doppler.applied(propagation, prior.theta, sources.x)
        return JointPosterior(propagation, readings.xi, readings.W, prior)

    def update_sources(
        self, sources: SourceBeliefs, readings: WeightedReadings, problem: JointPosterior,
        solution: Solution,
    ) -> tuple[SourceBeliefs, Diagnostics]:  # fmt: skip
        """Return a batch of updated beliefs; those with a solution that is not finite stay."""
        updated = sources.updated(
            solution.u, solution.theta, solution.marginals, self.position, self.motion
        )
        W = np.where(problem.W > 0, readings.precision, 0.0)  # of the sensors in use
        return keep_finite(updated, sources), problem._replace(W=W).diagnose(solution)

    def store(
        self, sources: SourceBeliefs, solution: Solution, diagnostics: Diagnostics,
        tracks: TrackTable | None = None,
    ) -> None:  # fmt: skip
        """Set belief, likelihood and diagnostics; solution and diagnostics have a batch axis."""
        self.log_likelihood = float(solution.log_likelihood[0])
        self.diagnostics = Diagnostics(*(np.asarray(part)[0].item() for part in diagnostics))
        if not np.isfinite(self.log_likelihood):  # no source and no noise: nothing is explained
            self.record_missed()
        self.elapsed = 0.0
        self.set_belief(sources, tracks or self.current_tracks(len(sources.u)))

    @property
    def estimate(self) -> PositionEstimate:
        """The confirmed sources.

        If all sensors are on a line, the covariances of detected sources contain their mirror
        images, which `P` does not.
        """
        sources = self.source_beliefs()
        tracks = self.current_tracks(len(sources.u))
        xy, shown = self.position, tracks.confirmed
        position, covariance = sources.x[shown][:, xy], sources.P[shown][:, xy, :][..., xy]
        if self.line is not None:
            covariance = self.line.with_mirror(covariance, position)
        return PositionEstimate(
            position,
            covariance,
            sources.u[shown],
            tracks.existence[shown],
            tracks.label[shown],
            *self.diagnostics,  # type: ignore[arg-type]  # of one step: numbers
        )

    def run_batch(
        self, measurements: Iterable[Iterable[ArrayLike | None]], dt: float = 1.0
    ) -> list[Run]:
        """Run independent sequences, each from the present state.

        A step of all sequences is one array call. Sequences of unequal lengths, and those where
        sources are or have just been detected, or may appear and disappear, run one by one in the
        processes that `joblib.parallel_config(n_jobs=...)` sets. The tracker does not change.

        Parameters
        ----------
        measurements : array_like, shape (n_sequences, n_steps, n_sensors), or nested iterables
            Readings, Np; NaN or None where missing.
        dt : float
            Time between steps.

        Returns
        -------
        list of Run
            One for each sequence.
        """
        positive("dt", dt)
        sequences = [list(rows("measurements", one)) for one in rows("measurements", measurements)]
        sources = self.source_beliefs()
        equal = len({len(sequence) for sequence in sequences}) == 1 and len(sequences[0]) > 0
        detected = sources.u.size == 0 or self.settling or self.line is not None
        if self.births or not equal or detected:
            return run_apart(self, sequences, dt)
        z = np.array([[self.vector(one) for one in sequence] for sequence in sequences])
        tracks = self.current_tracks(len(sources.u))
        return run_in_chunks(
            BatchStart(sources, tracks, self.elapsed, self.n_slots, self.position),
            self.measurement.readings(z), dt, self.predict_sources, self._update_batch,
        )  # fmt: skip

    def _update_batch(
        self, sources: SourceBeliefs, xi: Float, elapsed: Float
    ) -> tuple[SourceBeliefs, Diagnostics]:
        readings = self.weighted(xi, elapsed)
        problem = self.joint_posterior(sources, readings)
        solution = self.solve(problem, problem.prior.mu, problem.prior.theta)
        return self.update_sources(sources, readings, problem, solution)
