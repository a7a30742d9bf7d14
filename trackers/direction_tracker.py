"""Base classes of trackers that estimate a varying number of directions."""

from __future__ import annotations

import copy
import time
import warnings
from abc import abstractmethod
from collections.abc import Iterable, Sequence
from itertools import zip_longest
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.direction_measurement import DirectionMeasurement
from arrivals.measurement_models.manifolds.manifold import UNIFORM_STD_OF_CIRCLE
from arrivals.measurements import rows
from arrivals.trackers.base import Tracker
from arrivals.trackers.direction_estimates import SphereEstimate
from arrivals.trackers.estimates import DirectionEstimate
from arrivals.trackers.run import Run, RunRecorder
from arrivals.typing import Bool, Complex, Float, Int
from arrivals.validation import positive

MISSING = complex(np.nan, np.nan)
ENDED: Any = object()  # in place of a measurement after the end of a shorter sequence


def padded(values: Float | Int | Bool, n: int, filler: float) -> Float:
    """Return the first n values as floats, padded to length n.

    Parameters
    ----------
    values : ndarray, shape (n_values, ...)
        Values.
    n : int
        Length of the result.
    filler : float
        Padding value.

    Returns
    -------
    ndarray, shape (n, ...)
        Padded values.

    Examples
    --------
    >>> padded(np.array([1.0, 2.0]), 4, np.nan)
    array([ 1.,  2., nan, nan])
    """
    full = np.empty((n, *values.shape[1:]))
    full[: len(values)], full[len(values) :] = values[:n], filler
    return full


def warn_of_ambiguity(measurement: DirectionMeasurement) -> None:
    """Warn if two directions have the same response at every frequency.

    Parameters
    ----------
    measurement : DirectionMeasurement
        Model of a tracker that is constructed.

    Warns
    -----
    UserWarning
        With the two directions, degrees.
    """
    if (pair := measurement.ambiguity()) is not None:
        one, other = np.rad2deg(pair)
        warnings.warn(
            f"directions {one:.1f} and {other:.1f} degrees are ambiguous: they have the same "
            "response at every frequency, so sources may be reported at either. Several "
            "frequencies, or a smaller spacing of the sensors, resolve them",
            stacklevel=4,
        )


class DirectionTracker(Tracker):
    """Base of trackers that estimate a varying number of directions.

    A subclass has `n_slots` and calls `report` at the end of `update`, and `reset` in its
    constructor.

    Attributes
    ----------
    x : ndarray, shape (n_slots,)
        Directions reported last, rad; NaN in unused slots.
    P : ndarray, shape (n_slots, n_slots)
        Their variances on the diagonal, rad²; 0 where unknown.
    estimate : DirectionEstimate
        Directions reported last; read-only.
    estimate_kind : type of DirectionEstimate
        Its class; with two unknowns a source `x` and `P` have both, source by source.
    noise : float
        Estimated noise variance of one sensor; NaN where the method gives none; read-only.

    Examples
    --------
    >>> class PhaseStep(DirectionTracker):
    ...     n_slots = 1
    ...     def __init__(self):
    ...         self.reset()
    ...     def predict(self, u=None, *, dt=1.0):
    ...         pass
    ...     def update(self, z):
    ...         if z is not None:
    ...             self.report([np.arcsin(np.angle(np.vdot(z[:-1], z[1:])) / np.pi)])
    >>> snapshot = np.exp(1j * np.pi * np.sin(0.3) * np.arange(4))
    >>> PhaseStep().run([snapshot, None]).doa
    array([[0.3],
           [0.3]])
    """

    estimate_kind: type[DirectionEstimate] = DirectionEstimate

    @property
    @abstractmethod
    def n_slots(self) -> int:
        """Largest number of directions in one estimate."""

    @property
    def estimate(self) -> DirectionEstimate:
        """Directions reported last."""
        return self._estimate

    @property
    def noise(self) -> float:
        """Estimated noise variance of one sensor; NaN where the method gives none."""
        return self._estimate.noise

    def reset(self) -> None:
        """Report no direction; a subclass with a belief also returns to its initial one."""
        self.report_none()

    def set_params(self, **params: Any) -> Self:
        """Change parameters and keep the belief, unless sources have other unknowns then."""
        before = getattr(getattr(self, "measurement", None), "unknowns", None)
        super().set_params(**params)
        if getattr(getattr(self, "measurement", None), "unknowns", None) != before:
            self.reset()
        return self

    def report_none(self) -> None:
        """Report no direction, as between measurements."""
        n = self.n_slots * self.estimate_kind.n_unknowns
        self._estimate = self.estimate_kind.empty()
        self.x, self.P = np.full(n, np.nan), np.zeros((n, n))

    def report(
        self,
        doa: ArrayLike,
        std: ArrayLike | None = None,
        existence: ArrayLike | None = None,
        amplitude: ArrayLike | None = None,
        label: ArrayLike | None = None,
        *,
        converged: bool = True,
        iterations: int = 0,
        noise: float = np.nan,
    ) -> None:
        """Make directions the present estimate, and set `x` and `P`.

        Parameters
        ----------
        doa : array_like, shape (n_sources,)
            Directions of arrival, rad; at most `n_slots` of them.
        std, existence, amplitude : array_like, shape (n_sources,), optional
            As in `DirectionEstimate`; NaN if None.
        label : array_like of int, shape (n_sources,), optional
            As in `DirectionEstimate`; -1 if None.
        converged : bool
            False if an iterative method stopped before it met its tolerance.
        iterations : int
            Number of iterations of this step.
        noise : float
            Estimated noise variance of one sensor.
        """
        doa = np.asarray(doa, dtype=np.float64)
        n, unknown = len(doa), np.full(len(doa), np.nan)
        amplitude = np.full(n, MISSING) if amplitude is None else amplitude
        estimate = DirectionEstimate(
            doa=doa,
            std=np.asarray(unknown if std is None else std, np.float64),
            existence=np.asarray(unknown if existence is None else existence, np.float64),
            amplitude=np.asarray(amplitude, np.complex128),
            label=np.full(n, -1) if label is None else np.asarray(label, np.int64),
            converged=converged,
            iterations=iterations,
            noise=noise,
        )
        self.report_estimate(estimate)

    def report_estimate(self, estimate: DirectionEstimate) -> None:
        """Make an estimate the present one, and set `x` and `P`, of one block a source.

        Parameters
        ----------
        estimate : DirectionEstimate
            Of class `estimate_kind`, with at most `n_slots` sources.
        """
        self._estimate = estimate
        values, covariance = estimate.unknowns()
        n, d = self.n_slots, values.shape[1]
        self.x = padded(values.ravel(), n * d, np.nan)
        blocks, known = np.zeros((n, d, n, d)), ~np.isnan(covariance[:n])
        if known.any():
            index = np.arange(len(known))
            blocks[index, :, index] = np.where(known, covariance[:n], 0.0)
        self.P = blocks.reshape(n * d, n * d)

    def report_directions(
        self,
        directions: Float,
        covariance: Float | None = None,
        existence: Float | None = None,
        amplitude: Complex | None = None,
        label: Int | None = None,
    ) -> None:
        """Make directions of one or two unknowns the present estimate, and set `x` and `P`.

        Parameters
        ----------
        directions : ndarray, shape (1, n_sources) or (2, n_sources)
            Directions, or azimuths and elevations, rad.
        covariance : ndarray, shape (n_sources, n_unknowns, n_unknowns), optional
            Variances, or covariances in the tangent plane as in `SphereEstimate`; NaN if None.
        existence, amplitude, label : ndarray, shape (n_sources,), optional
            As in `report`.
        """
        doa, d = directions[0], len(directions)
        std = None
        if covariance is not None:
            std = np.sqrt(covariance[:, -1, -1])
        if d > 1 and std is not None:
            with np.errstate(divide="ignore"):
                std = np.minimum(std / np.cos(directions[1]), UNIFORM_STD_OF_CIRCLE)
        self.report(doa, std, existence, amplitude, label)
        if d > 1:
            unknown = np.full((len(doa), d, d), np.nan)
            fields = {each: getattr(self._estimate, each) for each in DirectionEstimate.per_source}
            self.report_estimate(
                SphereEstimate(
                    **fields,
                    elevation=directions[1],
                    covariance=unknown if covariance is None else covariance,
                )
            )


class BatchDirectionTracker(DirectionTracker):
    """Base of direction trackers that process a step of several sequences in one array call."""

    @abstractmethod
    def step_batch(self, trackers: Sequence[Self], step: Sequence[Any], dt: float) -> None:
        """Predict and update copies of this tracker, each with its own measurement.

        Parameters
        ----------
        trackers : sequence of trackers
            Copies whose sequences have not ended.
        step : sequence
            A measurement for each.
        dt : float
            Time step.
        """

    def run_batch(
        self, measurements: Iterable[Iterable[ArrayLike | None]], dt: float = 1.0
    ) -> list[Run]:
        """Run independent sequences, each starting from the present state.

        A step of all sequences is one array call. Results equal those of single runs up to
        rounding. The tracker itself does not change.

        Parameters
        ----------
        measurements : array_like, shape (n_sequences, n_steps, ...), or nested iterables
            Sequences of measurements, as in `run`.
        dt : float
            Time between steps.

        Returns
        -------
        list of Run
            One per sequence.
        """
        positive("dt", dt)
        sequences = [list(rows("a sequence", each)) for each in rows("measurements", measurements)]
        trackers = [copy.deepcopy(self) for _ in sequences]
        recorders = [RunRecorder(type(self.estimate)) for _ in sequences]
        started = time.perf_counter()
        for step in zip_longest(*sequences, fillvalue=ENDED):
            active = [n for n, z in enumerate(step) if z is not ENDED]
            self.step_batch([trackers[n] for n in active], [step[n] for n in active], dt)
            for n in active:
                recorders[n].add(trackers[n].estimate, trackers[n].x)
        elapsed = (time.perf_counter() - started) / max(len(sequences), 1)
        return [each.run(dt=dt, elapsed=elapsed).made_by(self) for each in recorders]
