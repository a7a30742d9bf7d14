"""Directions from one snapshot at a time, gridless, their number unknown."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal, Self

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.array_snapshot import ArraySnapshot
from arrivals.measurement_models.manifolds.manifold import Manifold, Reference
from arrivals.measurement_models.observed import ObservedSnapshots, check_directions, updated
from arrivals.trackers.base import is_missing
from arrivals.trackers.direction_tracker import BatchDirectionTracker
from arrivals.trackers.estimates import DirectionEstimate
from arrivals.trackers.registry import register
from arrivals.trackers.svalse.components import ComponentPosterior, ComponentPrior, Solver
from arrivals.trackers.svalse.coordinate.solver import CoordinateSolver, PosteriorName
from arrivals.trackers.svalse.newton.solver import NewtonSolver
from arrivals.typing import Bool, Complex, Float, Int
from arrivals.validation import count, instance, not_negative, one_of, positive, probability

EngineName = Literal["fast", "coordinate"]


@register("valse")
class VALSE(BatchDirectionTracker):
    """Variational Bayesian line spectral estimation: every snapshot on its own.

    Parameters
    ----------
    measurement : ArraySnapshot
        Any array, of as many frequencies and snapshots a step as it says. Its noise is not used:
        the method estimates it.
    engine : {"fast", "coordinate"}
        What maximises the bound: joint Newton steps on all angles, or the paper's coordinate
        ascent, which takes three to thirty times as long and integrates the angles' densities.
        The fast one serves every array, with any number of frequencies and snapshots; an unknown
        slowness or elevation, or a whole posterior that is carried, is for coordinate ascent,
        which then steps in.
    reference : {"middle", "first"}
        The sensor at which the amplitudes' phases are counted. "first" is the paper's; with the
        middle one phase and angle are uncorrelated, which saves most of the iterations.
    posterior : {"quadrature", "mixture"}
        How coordinate ascent integrates the angles' densities; "mixture" is the paper's
        Heuristic 1.
    tolerance : float, optional
        Where the iteration rests. Fast: change of the bound, nats, 1e-4 if None. Coordinate:
        relative change of the reconstruction, 1e-4 if None; the paper's is 1e-6.
    max_iterations : int
        Iterations at most; a step that needs more is reported as not converged.
    max_components : int, optional
        Components that may be used at once; as many as there are sensors if None.
    kl : float
        Fast: share of the cost of localising a component, nats, that it must earn to be kept.
        1 is the exact bound; less finds weaker sources, and more false ones below 10 dB.
    temper : float
        Looks of a step that count as one, at least 1: overlapping windows and neighbouring bins
        of a recording are not independent, and deviate from a plane wave alike.
    power_floor : float, optional
        Power, in units of one look's noise after beamforming, below which nothing is a source. If
        None, 0 for one look a step, which is the paper's model, and 3 for several.
    max_snr_db : float, optional
        Signal-to-noise ratio beyond which what is left of the data is laid to the array's model.
    merge : float
        Of two active components nearer than this, rad of direction, the later is switched off;
        0 for never, as in the paper.

    Attributes
    ----------
    x, P : ndarray, shapes (L,), (L, L)
        The directions found, rad, NaN in unused places, and their variances on a diagonal.
    noise : float
        Estimated variance of the noise of one sensor.

    Notes
    -----
    `existence` of an estimate is the posterior probability of the component if all others are
    held: it ranks components, but is no calibrated frequency. `std` is the circular standard
    deviation of the angle, given the other components; with several sources it is too small, by a
    factor of 1.5 to 2 typically. Below half a wavelength of spacing, components to which no real
    direction belongs are left out of the estimate.

    References
    ----------
    Badiu, Hansen and Fleury, IEEE TSP 65(9), 2017. Phase reference in mid array: ours.

    Examples
    --------
    >>> from arrivals.measurement_models import SensorArray
    >>> model = ArraySnapshot(SensorArray.ula(15, spacing=0.5), wavelength=1.0, noise=1e-3)
    >>> z = model.simulate([-0.2, 0.5], [1.0, 1.0j], np.random.default_rng(0))
    >>> tracker = VALSE(model)
    >>> tracker.update(z)
    >>> np.sort(tracker.estimate.doa).round(2)
    array([-0.2,  0.5])
    """

    def __init__(
        self,
        measurement: ArraySnapshot,
        *,
        engine: EngineName = "fast",
        reference: Reference = "middle",
        posterior: PosteriorName = "quadrature",
        tolerance: float | None = None,
        max_iterations: int = 500,
        max_components: int | None = None,
        kl: float = 0.5,
        temper: float = 1.0,
        power_floor: float | None = None,
        max_snr_db: float | None = None,
        merge: float = 0.0,
    ) -> None:
        self.measurement = instance("measurement", measurement, ArraySnapshot)
        self.engine = one_of("engine", engine, ("fast", "coordinate"))
        self.reference = one_of("reference", reference, ("middle", "first"))
        self.posterior = one_of("posterior", posterior, ("quadrature", "mixture"))
        if engine == "fast" and posterior == "mixture":
            raise ValueError("posterior='mixture' needs engine='coordinate'; got engine='fast'")
        self.tolerance = tolerance if tolerance is None else positive("tolerance", tolerance)
        self.kl = probability("kl", kl)
        self.max_iterations = count("max_iterations", max_iterations)
        self.max_components = (
            None if max_components is None else count("max_components", max_components)
        )
        self.temper = positive("temper", temper)
        if temper < 1:
            raise ValueError(f"temper must be at least 1; got {temper}")
        self.power_floor = None if power_floor is None else not_negative("power_floor", power_floor)
        self.max_snr_db = None if max_snr_db is None else positive("max_snr_db", max_snr_db)
        self.merge = not_negative("merge", merge)
        check_directions(measurement, self.reference, mixture=self.posterior == "mixture")
        self.bin_noise = np.full(measurement.n_bins, np.nan)
        self.reset()

    @property
    def solver(self) -> Solver:
        """What maximises the ELBO, with this tracker's settings."""
        return self._solver(snr_db=None, descending=True)

    def _solver(self, snr_db: float | None, *, descending: bool, n_moments: int = 0) -> Solver:
        settings: dict[str, Any] = {
            "max_iterations": self.max_iterations,
            "merge": self.merge,
            "snr_db": snr_db,
            "max_components": self.max_components,
            "temper": self.temper,
            "power_floor": self.power_floor,
            "max_snr_db": self.max_snr_db,
        }
        if self.tolerance is not None:
            settings["tolerance"] = self.tolerance
        if self.is_fast and n_moments == 0:
            return NewtonSolver(kl=self.kl, **settings)
        return CoordinateSolver(
            self.posterior, descending=descending, n_moments=n_moments, **settings
        )

    @property
    def is_fast(self) -> bool:
        """Whether the fast engine is wanted, and serves this measurement: no second unknown."""
        if self.engine != "fast":
            return False
        return len(self.measurement.manifold(self.reference).nuisance_weights) == 1

    @property
    def n_slots(self) -> int:
        """Number of components that may be used at once."""
        n_sensors = self.measurement.array.n_sensors
        return min(n_sensors, self.max_components or n_sensors)

    def predict(self, u: ArrayLike | None = None, *, dt: float = 1.0) -> None:
        """Forget: nothing is carried from snapshot to snapshot."""
        self._move([self], not_negative("dt", dt))
        self._expect()

    def update(self, z: ArrayLike | None) -> None:
        """Fit one measurement, of the model's `shape`; sensors that are NaN are left out."""
        looks = self._looks(z)
        if looks is not None:
            Y, heard = looks
            manifold = self._manifold(heard)
            fit = self.solver.fit(Y, manifold, self._prediction(heard))
            self._absorb(manifold, fit, heard)

    def step_batch(self, trackers: Sequence[Self], step: Sequence[Any], dt: float) -> None:
        """Predict and update copies of this tracker, those with the same sensors in one call."""
        self._move(trackers, dt)
        groups: dict[bytes, list[tuple[Self, Complex, ObservedSnapshots]]] = {}
        for tracker, z in zip(trackers, step, strict=True):
            looks = tracker._looks(z)
            if looks is None:
                tracker._expect()
            else:
                groups.setdefault(looks[1].key, []).append((tracker, *looks))
        for group in groups.values():
            heard = group[0][2]
            manifold = self._manifold(heard)
            fits = self.solver.fit_batch(
                [Y for _, Y, _ in group],
                manifold,
                [tracker._prediction(heard) for tracker, *_ in group],
            )
            for (tracker, *_), fit in zip(group, fits, strict=True):
                tracker._absorb(manifold, fit, heard)

    def _move(self, trackers: Sequence[Self], dt: float) -> None:
        """Move the beliefs of copies of this tracker by `dt`: there are none."""

    def _expect(self) -> None:
        """Show what is expected before a measurement: nothing."""
        self.reset()

    def _looks(self, z: ArrayLike | None) -> tuple[Complex, ObservedSnapshots] | None:
        """Return the looks without gaps, and which these are; None for a missed measurement."""
        if is_missing(z):
            return None
        Y = self.measurement.looks(np.asarray(z))
        heard = ObservedSnapshots.of(Y)
        return heard.block(Y), heard

    def _manifold(self, heard: ObservedSnapshots) -> Manifold:
        """Return the manifold of the bins and sensors that gave a number."""
        manifold = self.measurement.manifold(self.reference).only(np.flatnonzero(heard.bins))
        return manifold.without(np.flatnonzero(~heard.sensors))

    def _prediction(self, heard: ObservedSnapshots | None = None) -> ComponentPrior | None:
        """Return what is known before the snapshot: nothing."""
        return None

    def _absorb(
        self, manifold: Manifold, fit: ComponentPosterior, heard: ObservedSnapshots
    ) -> None:
        """Take in a fit."""
        self.bin_noise = updated(self.bin_noise, heard.bins, fit.bin_noise)
        found = reported(manifold, fit)
        self.report(**vars(described(manifold, fit, found, np.full(found.sum(), -1))))


def reported(manifold: Manifold, fit: ComponentPosterior) -> Bool:
    """Tell which components are active and belong, within three std, to a real direction."""
    doa = manifold.to_doa(fit.theta, slack=3 * circular_std(fit.resultant))
    return np.asarray(fit.active & ~np.isnan(doa))


def described(
    manifold: Manifold, fit: ComponentPosterior, found: Bool, label: Int
) -> DirectionEstimate:
    """Return the found components of a fit as directions."""
    theta, std = fit.theta[found], circular_std(fit.resultant[found])
    return DirectionEstimate(
        doa=manifold.to_doa(theta, slack=np.inf),
        std=manifold.doa_std(theta, std),
        existence=1 / (1 + np.exp(-np.maximum(fit.evidence[found], -700))),
        amplitude=manifold.to_amplitude(fit.amplitude[found], theta),
        label=label.astype(np.int64),
        converged=fit.converged,
        iterations=fit.iterations,
        noise=fit.noise,
    )


def circular_std(resultant: ArrayLike) -> Float:
    """Return the circular standard deviation √(-2 ln R), rad, of densities of resultant R.

    Examples
    --------
    >>> circular_std([1.0, 0.5]).round(4) + 0
    array([0.    , 1.1774])
    """
    return np.asarray(np.sqrt(-2 * np.log(np.maximum(resultant, 1e-300))))
