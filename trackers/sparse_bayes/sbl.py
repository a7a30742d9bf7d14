"""Sparse Bayesian learning on a scan grid, each step on its own."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.array_snapshot import ArraySnapshot
from arrivals.measurement_models.manifolds.manifold import (
    UNIFORM_STD_OF_CIRCLE,
    UNIFORM_STD_OF_LINE,
)
from arrivals.measurements import numbers
from arrivals.trackers.beamforming.scan_ends import ends_coincide
from arrivals.trackers.beamforming.spectrum import scan_directions
from arrivals.trackers.direction_tracker import BatchDirectionTracker, warn_of_ambiguity
from arrivals.trackers.registry import register
from arrivals.trackers.sparse_bayes.deviations import grid_deviations
from arrivals.trackers.sparse_bayes.fixed_point import (
    FixedPointSolver,
    PowerEstimate,
    highest_peaks,
)
from arrivals.trackers.sparse_bayes.valid_snapshots import ValidSnapshots, valid_block
from arrivals.typing import Bool, Complex, Float
from arrivals.validation import count, instance, no_control, positive, probability, time_step

SLOPE_STEP = 1e-5  # rad, of central differences


@register("sbl")
class SBL(BatchDirectionTracker):
    """Sparse Bayesian learning: peaks of a sparse power spectrum, each step on its own.

    Parameters
    ----------
    measurement : ArraySnapshot
        Any array; of its noise, only the coherence is used, since the method estimates the rest.
        Several bins, scaled to equal power, share the powers; each has a noise variance.
    n_directions : int
        Scan grid: over ±90° for a line (361: every half degree), else over the circle.
    threshold : float
        Peaks below this fraction of the highest are not reported.
    initial_power : float
        Initial powers. Initial values are absolute: unlike those of `VALSE`, the results depend
        slightly on the scale of the snapshots.
    initial_noise : float
        Initial noise variance.
    max_sources : int, optional
        Maximum number of peaks; the number of sensors if None.
    solver : FixedPointSolver
        The iteration: its tolerance and limits.

    Attributes
    ----------
    doa_grid, gamma : ndarray, shape (n_directions,)
        Scan grid, rad, and the powers of the last step with data; NaN before the first.
    start : ndarray, shape (n_directions,)
        Initial powers of the next update.
    noise : float
        Estimated noise variance of one sensor.
    x, P : ndarray, shapes (n_slots,), (n_slots, n_slots)
        Reported directions, rad, NaN in unused slots, and their variances on a diagonal.

    Notes
    -----
    A step is what the model has, or of one bin any number of snapshots (n_snapshots, n_sensors)
    with the same directions. Sensors that are NaN in one of them are left out of the step.
    Directions are grid points; labels are -1. `existence` is NaN: the powers are estimates of
    largest likelihood, and the posterior that follows from them is one of amplitudes, not of
    sources. `std` is that of a direction off the grid, given the number of peaks, and of rounding
    to the grid; on `walk` with one source and on Fig. 6, 64 and 69 % of the errors lie within one
    deviation, 96 and 93 % within 1.96 (`ssbl`: 63 and 79 %, 96 and 96 %). At high signal-to-noise
    ratios the rounding is all of it, and all errors lie within 1.96. Amplitudes are the
    least-squares fit of the plane waves of the peaks to the last snapshot of the step; with
    several bins or snapshots in the model, the root of its mean power over them.

    References
    ----------
    Gerstoft, Mecklenbräuker, Xenaki and Nannuru, "Multisnapshot sparse Bayesian learning for DOA",
    IEEE Signal Process. Lett. 23(10), 2016. Several bins: Nannuru, Gemba, Gerstoft, Hodgkiss and
    Mecklenbräuker, "Sparse Bayesian learning with multiple dictionaries", Signal Process. 159,
    2019.

    Examples
    --------
    >>> from arrivals.measurement_models import SensorArray
    >>> model = ArraySnapshot(SensorArray.ula(15, spacing=0.5), wavelength=1.0, noise=1e-3)
    >>> z = model.simulate(np.deg2rad([-20.0, 30.5]), [1.0, 1.0j], np.random.default_rng(0))
    >>> tracker = SBL(model)
    >>> tracker.update(z)
    >>> np.rad2deg(np.sort(tracker.estimate.doa)).round(1)
    array([-20. ,  30.5])
    """

    renamed: ClassVar[dict[str, str]] = {
        "start_power": "initial_power",
        "start_noise": "initial_noise",
        "tolerance": "solver__tolerance",
        "max_iterations": "solver__max_iterations",
    }

    def __init__(
        self,
        measurement: ArraySnapshot,
        *,
        n_directions: int = 361,
        threshold: float = 0.01,
        initial_power: float = 1.0,
        initial_noise: float = 0.1,
        max_sources: int | None = None,
        solver: FixedPointSolver = FixedPointSolver(),  # noqa: B008  (models are immutable)
    ) -> None:
        self.measurement = instance("measurement", measurement, ArraySnapshot)
        measurement.check_one_unknown(type(self).__name__)
        if measurement.slowness is not None or measurement.elevation is not None:
            raise ValueError(
                f"slowness and elevation must be None for {type(self).__name__}; got a grid: music "
                "and mvdr scan it"
            )
        self.n_directions = count("n_directions", n_directions, 3, 100_000)
        self.threshold = probability("threshold", threshold)
        self.initial_power = positive("initial_power", initial_power)
        self.initial_noise = positive("initial_noise", initial_noise)
        self.max_sources = max_sources
        if max_sources is not None:
            count("max_sources", max_sources, maximum=1000)
        self.solver = instance("solver", solver, FixedPointSolver)
        warn_of_ambiguity(measurement)
        self.reset()

    def reset(self) -> None:
        """Return to the state after construction: no powers, no direction."""
        self.doa_grid = scan_directions(self.measurement.array, self.n_directions)
        self.gamma = np.full(self.n_directions, np.nan)
        self.predict()

    @property
    def n_slots(self) -> int:
        """Maximum number of reported peaks."""
        return self.max_sources or self.measurement.array.n_sensors

    @property
    def circular(self) -> bool:
        """True if the first direction of the grid follows the last."""
        return self.measurement.array.dim > 1

    def predict(self, u: ArrayLike | None = None, *, dt: float = 1.0) -> None:
        """Set the initial powers; report no direction until the next measurement."""
        time_step(dt)
        no_control(u)
        self.start = self.next_start()
        self.report_none()

    def next_start(self) -> Float:
        """Return the initial powers of the next update, (n_directions,)."""
        return np.full(self.n_directions, self.initial_power)

    def update(self, z: ArrayLike | None) -> None:
        """Fit the snapshots of a step; of one bin, any number of them, one a row."""
        block = self._valid_snapshots(z)
        if block is None:
            return
        powers = self._solve([block], self._start_on_grid()[None])
        self._report_peaks(powers, 0, block)

    def step_batch(self, trackers: Sequence[Self], step: Sequence[Any], dt: float) -> None:
        """Fit the steps with the same valid sensors, bins and number of snapshots as one batch."""
        groups: dict[tuple[Any, ...], list[tuple[Self, ValidSnapshots]]] = {}
        for tracker, z in zip(trackers, step, strict=True):
            tracker.predict(dt=dt)
            block = tracker._valid_snapshots(z)
            if block is not None:
                bins = b"" if block.bins is None else block.bins.tobytes()
                key = block.Y.shape, block.valid_sensors.tobytes(), bins
                groups.setdefault(key, []).append((tracker, block))
        for group in groups.values():
            starts = np.stack([tracker._start_on_grid() for tracker, _ in group])
            powers = self._solve([block for _, block in group], starts)
            for index, (tracker, block) in enumerate(group):
                tracker._report_peaks(powers, index, block)

    def _valid_snapshots(self, z: ArrayLike | None) -> ValidSnapshots | None:
        """Return the snapshots of the sensors with valid data; None if missing or zero."""
        if not self.measurement.is_plain:
            return valid_block(self.measurement, self.measurement.snapshots(z))
        z = numbers("z", np.nan if z is None else z)
        Y = self.measurement.snapshot(z, len(z) if z.ndim == 2 else None)
        Y = Y.reshape(-1, Y.shape[-1]).T
        Y = Y[:, ~np.isnan(Y).all(axis=0)]
        valid: Bool = np.asarray(~np.isnan(Y).any(axis=1))
        return ValidSnapshots(Y[valid], valid) if valid.sum() > 1 and Y[valid].any() else None

    def _start_on_grid(self) -> Float:
        """Return `start`, or equal powers if the number of directions was changed."""
        fits = self.start.shape == (self.n_directions,)
        return self.start if fits else np.full(self.n_directions, self.initial_power)

    def _steering_matrix(self, doa: Float, block: ValidSnapshots) -> Complex:
        """Return responses of the valid sensors, ([n_bins,] n, n_valid)."""
        if block.bins is None:
            return self.measurement.steering_vector(doa)[:, block.valid_sensors]
        A = self.measurement.waves.steering(doa)[0][np.ix_(block.bins, block.valid_sensors)]
        if self.measurement.coherence is not None:
            A = self.measurement.whitening(block.valid_sensors)[block.bins] @ A
        return np.swapaxes(A, 1, 2)

    def _solve(self, blocks: Sequence[ValidSnapshots], start: Float) -> PowerEstimate:
        grid = scan_directions(self.measurement.array, self.n_directions)
        A = self._steering_matrix(grid, blocks[0])
        if self.measurement.response is None and self.measurement.coherence is None:
            A = A / np.sqrt(A.shape[-1])
        else:
            A = A / np.maximum(np.linalg.norm(A, axis=-1, keepdims=True), np.finfo(float).tiny)
        Y = np.stack([block.Y * block.scale for block in blocks])
        return self.solver.solve(A, Y, start, self.initial_noise, circular=self.circular)

    def _report_peaks(self, powers: PowerEstimate, index: int, block: ValidSnapshots) -> None:
        """Report the peaks of one solution of a batch."""
        self.gamma = gamma = powers.gamma[index]
        self.doa_grid = grid = scan_directions(self.measurement.array, self.n_directions)
        ends = np.swapaxes(self._steering_matrix(grid[[0, -1]], block), 0, -2)
        joined = not self.circular and ends_coincide(*ends)
        n_peaks = min(self.n_slots, len(grid))
        peaks, exists = highest_peaks(gamma, n_peaks, self.circular, joined)
        doa = grid[peaks[exists & (gamma[peaks] > self.threshold * gamma[peaks[0]])]]
        A = np.swapaxes(self._steering_matrix(doa, block), -1, -2)
        if block.bins is None:
            W = np.asarray(np.linalg.lstsq(A, block.Y, rcond=None)[0], np.complex128)
            amplitude = W[:, -1]
        else:
            W = np.linalg.pinv(A) @ block.Y
            n_valid = max(int(block.Y.any(axis=1).sum()), 1)
            power = (W.real**2 + W.imag**2).sum(axis=(0, 2)) / n_valid
            amplitude = W[0, :, -1] if self.measurement.is_single else np.sqrt(power) + 0j
        self.report(
            doa,
            self._deviations(doa, A, W, block),
            amplitude=amplitude,
            converged=bool(powers.converged[index]),
            iterations=int(powers.iterations[index]),
            noise=float(np.mean(powers.noise[index] / np.ravel(block.scale) ** 2)),
        )

    def _deviations(self, doa: Float, A: Complex, W: Complex, block: ValidSnapshots) -> Float:
        """Return standard deviations of the peaks, rad."""
        if block.bins is None:
            slopes = [self.measurement.response_slope(beta)[block.valid_sensors] for beta in doa]
            D = np.array(slopes).reshape(A.T.shape).T
        else:
            after, before = (
                self._steering_matrix(doa + h, block) for h in (SLOPE_STEP, -SLOPE_STEP)
            )
            D = np.swapaxes(after - before, 1, 2) / (2 * SLOPE_STEP)
        largest = UNIFORM_STD_OF_CIRCLE if self.circular else UNIFORM_STD_OF_LINE
        step = float(self.doa_grid[1] - self.doa_grid[0])
        return grid_deviations(A, D, block.Y, W, step, largest)
