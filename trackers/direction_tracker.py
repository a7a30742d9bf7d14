"""Base classes of trackers that estimate a varying number of directions."""

from __future__ import annotations

import copy
import time
import warnings
from abc import abstractmethod
from collections.abc import Callable, Iterable, Sequence
from itertools import zip_longest
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.direction_measurement import DirectionMeasurement
from arrivals.measurement_models.manifolds.manifold import UNIFORM_STD_OF_CIRCLE
from arrivals.measurements import rows
from arrivals.trackers.base import Tracker
from arrivals.trackers.direction_estimates import SphereEstimate
from arrivals.trackers.direction_state import no_direction, state_of
from arrivals.trackers.estimates import DirectionEstimate
from arrivals.trackers.run import Run, RunRecorder
from arrivals.typing import Complex, Float, Int
from arrivals.validation import positive

MISSING = complex(np.nan, np.nan)
ENDED: Any = object()  # in place of a measurement after the end of a shorter sequence


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
    _x: Float | None = None  # None until x or P is read

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
        return self.estimate.noise

    @property
    def x(self) -> Float:
        """Directions reported last, rad; NaN in unused slots."""
        estimate = self.estimate
        if self._x is None:
            self._x, self._P = state_of(estimate, self._n_reported)
        return self._x

    @x.setter
    def x(self, value: Float) -> None:
        self._x, self._P = value, self.P

    @property
    def P(self) -> Float:
        """Their variances on the diagonal, rad²; 0 where unknown."""
        self.x  # noqa: B018  (computes both)
        return self._P

    @P.setter
    def P(self, value: Float) -> None:
        self._x, self._P = self.x, value

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
        self.report_estimate(no_direction(self.estimate_kind))

    def report(
        self,
        doa: ArrayLike,
        std: ArrayLike | None = None,
        existence: ArrayLike | None = None,
        amplitude: ArrayLike | Callable[[], Complex] | None = None,
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
        std, existence : array_like, shape (n_sources,), optional
            As in `DirectionEstimate`; NaN if None.
        amplitude : array_like, shape (n_sources,), or function, optional
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
        fields = _fields(doa, std, existence, amplitude, label)
        self.report_estimate(
            DirectionEstimate(**fields, converged=converged, iterations=iterations, noise=noise)
        )

    def report_estimate(self, estimate: DirectionEstimate) -> None:
        """Make an estimate the present one, and that of `x` and `P`, of one block a source.

        Parameters
        ----------
        estimate : DirectionEstimate
            Of class `estimate_kind`, with at most `n_slots` sources.
        """
        self._estimate, self._x, self._n_reported = estimate, None, self.n_slots

    def report_directions(
        self,
        directions: Float,
        covariance: Float | None = None,
        existence: Float | None = None,
        amplitude: Complex | Callable[[], Complex] | None = None,
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
        if d == 1:
            std = None if covariance is None else np.sqrt(covariance[:, 0, 0])
            self.report(doa, std, existence, amplitude, label)
            return
        if covariance is None:
            covariance = np.full((len(doa), d, d), np.nan)
        with np.errstate(divide="ignore"):
            std = np.sqrt(covariance[:, -1, -1]) / np.cos(directions[1])
        fields = _fields(doa, np.minimum(std, UNIFORM_STD_OF_CIRCLE), existence, amplitude, label)
        self.report_estimate(
            SphereEstimate(**fields, elevation=directions[1], covariance=covariance)
        )


def _fields(
    doa: ArrayLike,
    std: ArrayLike | None,
    existence: ArrayLike | None,
    amplitude: ArrayLike | Callable[[], Complex] | None,
    label: ArrayLike | None,
) -> dict[str, Any]:
    """Return the fields of an estimate, NaN or -1 in place of None."""
    doa = np.asarray(doa, dtype=np.float64)
    n, unknown = len(doa), np.full(len(doa), np.nan)
    if amplitude is None:
        amplitude = np.full(n, MISSING)
    elif not callable(amplitude):
        amplitude = np.asarray(amplitude, np.complex128)
    return {
        "doa": doa,
        "std": unknown if std is None else np.asarray(std, np.float64),
        "existence": unknown if existence is None else np.asarray(existence, np.float64),
        "amplitude": amplitude,
        "label": np.full(n, -1) if label is None else np.asarray(label, np.int64),
    }


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
