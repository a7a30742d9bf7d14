"""Wideband sources in diffuse sound, tracked by a variational mixture over time-frequency bins."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.direction_measurement import DirectionMeasurement
from arrivals.motion_models.bernoulli_von_mises import BernoulliVonMises
from arrivals.trackers.direction_tracker import DirectionTracker, warn_of_ambiguity
from arrivals.trackers.kinds_of_estimates import kind_of_estimate
from arrivals.trackers.registry import register
from arrivals.trackers.wideband.bin_evidence import (
    bin_evidence,
    mean_powers,
    scan_response,
    unit_snapshots,
)
from arrivals.trackers.wideband.bin_selection import BinLevels
from arrivals.trackers.wideband.density_grid import DensityGrid
from arrivals.trackers.wideband.mixture import fit_with_births
from arrivals.trackers.wideband.scan import Scan
from arrivals.trackers.wideband.settings import MixtureSettings
from arrivals.trackers.wideband.support import updated
from arrivals.trackers.wideband.tracked_sources import TrackedSources
from arrivals.typing import Float
from arrivals.validation import instance, no_control, positive, time_step

# per second; per step of 128 ms: 3 degrees, 0.05 and 0.02
DEFAULT_MOTION = BernoulliVonMises(
    sigma_doa=float(np.deg2rad(8.4)), p_activate=0.31, p_deactivate=0.124
)
DEFAULT_SETTINGS = MixtureSettings()


@register("wideband_mixture")
class WidebandMixture(DirectionTracker):
    """Directions of wideband sources whose spectra overlap little, speech above all.

    Every frequency bin of every snapshot is taken to hold one source or diffuse sound: room
    reverberation, wind, the noise of many. Bins that are louder than the noise and rise, so that
    they come before their echoes, are shared out among the tracked sources and the background; a
    new source is one that explains many of them better. The number of sources is estimated.

    Parameters
    ----------
    measurement : DirectionMeasurement
        An `ArraySnapshot`, or a model with its methods: any array, several frequency bins, tens of
        them as a rule, and several snapshots a step; an `ArraySnapshot` also of azimuth and
        elevation. Its noise is not used; white noise of an `ArraySnapshot` is replaced by diffuse
        noise where `settings.diffuse` is set.
    motion : BernoulliVonMises, optional
        Steps, births and deaths per unit of time; `still` must be 0. By default 3 degrees, 0.05
        and 0.02 in 128 ms, whatever the unit.
    settings : MixtureSettings
        All other numbers, by name; times in seconds.
    step_duration : float
        Duration of one unit of time, s: with the default a step, `dt=1`, has 128 ms. It must be
        that of the steps; 1.0 if `dt` is in seconds.

    Attributes
    ----------
    sources : TrackedSources
        Densities on the grid, existence, labels and ages of the tracked sources.
    levels : BinLevels
        Noise floor and recent peak of every frequency bin.
    grid : DensityGrid
        Scan directions of the densities.

    Raises
    ------
    ValueError, TypeError
        If a parameter is out of its range, or directions are not identifiable by the array.

    Notes
    -----
    Reported are sources of existence `settings.min_existence` and more: mean and standard deviation
    of the density about its peak, and as amplitude the root of the mean power over the bins and
    snapshots of the step of what is assigned to the source. A source that pauses keeps its density
    and label for `settings.memory`. Echoes from one direction that arrive within a window of the
    direct sound, as those of floor and ceiling do on a line, may be reported as a source.

    References
    ----------
    Ito, Araki and Nakatani, "Complex angular central Gaussian mixture model for directional
    statistics in mask-based microphone array signal processing", EUSIPCO 2016, (4): the density
    of a bin. Bernoulli filter and von Mises walk as in `SVALSE`.

    Examples
    --------
    >>> from arrivals.measurement_models import ArraySnapshot, SensorArray
    >>> array = SensorArray.uca(6, radius=0.046, speed=343.0)
    >>> model = ArraySnapshot(array, [array.wavelength(f) for f in range(500, 4000, 50)],
    ...                       noise=0.01, n_snapshots=8)
    >>> rng = np.random.default_rng(0)
    >>> speech = rng.laplace(size=(3, 70, 8, 1)) * rng.gamma(0.3, size=(3, 70, 8, 1))
    >>> run = WidebandMixture(model).run(model.simulate([[0.5], [0.5], [0.5]], 3 * speech, rng))
    >>> run.doa[:, 0].round(1), run.label[:, 0]
    (array([0.5, 0.5, 0.5]), array([0, 0, 0]))
    """

    def __init__(
        self,
        measurement: DirectionMeasurement,
        motion: BernoulliVonMises | None = None,
        *,
        settings: MixtureSettings = DEFAULT_SETTINGS,
        step_duration: float = 0.128,
    ) -> None:
        self.measurement = instance("measurement", measurement, DirectionMeasurement)  # type: ignore[type-abstract]  # a protocol
        self.motion = motion
        if motion is not None and instance("motion", motion, BernoulliVonMises).still:
            raise ValueError(f"still must be 0 for densities on a grid; got {motion.still}")
        self.settings = instance("settings", settings, MixtureSettings)
        self.step_duration = positive("step_duration", step_duration)
        warn_of_ambiguity(measurement)
        self.reset()

    def reset(self) -> None:
        """Return to the state after construction: no source, no noise floor."""
        name = type(self).__name__
        self.estimate_kind = kind_of_estimate(self.measurement, name, "azimuth", "sphere")
        self.scan = Scan.of(self.measurement, self.settings)
        self.scanned = self.measurement, self.settings
        self.sources = TrackedSources.none(self.scan.n_points)
        self.levels = BinLevels.empty(self.scan.manifold.n_bins)
        self.elapsed, self.gap, self.n_labels = 0.0, 0.0, 0
        self.report_none()

    @property
    def grid(self) -> DensityGrid:
        """Scan directions of the densities."""
        return self.scan.grid

    @property
    def n_slots(self) -> int:
        """Maximum number of reported sources."""
        return self.settings.max_sources

    def predict(self, u: ArrayLike | None = None, *, dt: float = 1.0) -> None:
        """Predict densities and existence; end sources that were inactive for long."""
        dt = time_step(dt)
        seconds = dt * self.step_duration
        no_control(u)
        self._apply_changed_parameters()
        motion, time = (DEFAULT_MOTION, seconds) if self.motion is None else (self.motion, dt)
        variance = float(motion.Q(time)[0, 0]) if time else 0.0
        sources = self.scan.walk(self.sources, variance)  # q ← q * kernel(σ)
        # q ← (1 - λ) q + λ / G of an inactive source
        sources = sources.relocated(-np.expm1(-self.settings.relocation * seconds))
        existence = np.asarray(motion.predict_existence(sources.existence, time))
        sources = replace(sources, existence=existence, age=sources.age + seconds)
        self.sources = sources.select(sources.remembered(self.settings))
        self.gap, self.elapsed = self.gap + self.elapsed, seconds
        self._report()

    def update(self, z: ArrayLike | None) -> None:
        """Fit the mixture to the bins of one measurement that count."""
        self._apply_changed_parameters()
        observed, settings = self.scan.observe(z), self.settings
        if observed is None:
            return
        manifold = self.scan.manifold
        if not observed.sensors.all():
            manifold = manifold.without(np.flatnonzero(~observed.sensors))
        response = scan_response(manifold, self.scan.grid, settings.source_ratio)
        unit, energy = unit_snapshots(observed.snapshots, observed.bins)
        levels = self.levels.later(self.gap, settings)
        levels, loud, onset = levels.after(energy, self.elapsed, settings)
        evidence = bin_evidence(response, unit, loud & onset)  # ℓ_i(θ)
        sources, power = self.sources, None
        if len(evidence) < max(settings.min_rate * self.elapsed, 1):  # a pause
            decay = float(np.exp(-self.elapsed / settings.pause))
            sources = replace(sources, existence=sources.existence * decay)
        else:
            sources, mixture = fit_with_births(evidence, sources, self.scan.grid, settings)
            at_sources = response.at(mixture.density.argmax(axis=1))
            power = mean_powers(at_sources, unit, energy, loud, mixture.share)
            sources, kept = updated(sources, mixture, self.scan.grid, settings, self.elapsed)
            power = power[kept]
        self.levels, self.gap, self.elapsed = levels, 0.0, 0.0
        sources = sources.labelled(self.n_labels, settings)
        self.n_labels = max(self.n_labels, int(sources.label.max(initial=-1)) + 1)
        remembered = sources.remembered(settings)
        self.sources = sources.select(remembered)
        self._report(None if power is None else power[remembered])

    def _apply_changed_parameters(self) -> None:
        """Start anew where `set_params` changed the model or the grid."""
        if self.scanned != (self.measurement, self.settings):
            scan = Scan.of(self.measurement, self.settings)
            if not scan.is_like(self.scan):
                self.reset()
            self.scan, self.scanned = scan, (self.measurement, self.settings)

    def _report(self, power: Float | None = None) -> None:
        """Report the sources that exist, with the powers of this step."""
        sources, settings = self.sources, self.settings
        active = np.flatnonzero(sources.active(settings) & (sources.label >= 0))
        half_width = settings.peak_half_width
        directions, covariance = self.scan.located(sources.density[active], half_width)
        # bins are T times fewer than they seem; the direction is T_std times as uncertain
        sharpening = settings.deviation_tempering / settings.tempering
        covariance = sharpening * covariance
        covariance = covariance + settings.model_deviation**2 * np.eye(len(directions))
        amplitude = None if power is None else np.sqrt(power[active])
        existence, label = sources.existence[active], sources.label[active]
        self.report_directions(directions, covariance, existence, amplitude, label)
