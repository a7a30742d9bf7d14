"""Directions from one snapshot at a time, gridless, their number unknown."""

from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from arrivals.checks import count, instance, not_negative, one_of, positive
from arrivals.measurement_models.manifolds import Manifold, Reference
from arrivals.measurement_models.snapshots import ArraySnapshot
from arrivals.trackers.base import Tracker, missed
from arrivals.trackers.coordinate_ascent import CoordinateAscent, PosteriorName
from arrivals.trackers.estimates import DirectionEstimate
from arrivals.trackers.line_spectrum import Engine, Fit, Prediction
from arrivals.trackers.looks import Heard, updated
from arrivals.trackers.registry import register
from arrivals.trackers.slots import padded
from arrivals.typing import Bool, Float, Int


@register("valse")
class VALSE(Tracker):
    """Variational Bayesian line spectral estimation: every snapshot on its own.

    Parameters
    ----------
    measurement : ArraySnapshot
        Any array, of as many frequencies and snapshots a step as it says. Its noise is not used:
        the method estimates it.
    reference : {"middle", "first"}
        The sensor at which the amplitudes' phases are counted. "first" is the paper's; with the
        middle one phase and angle are uncorrelated, which saves most of the iterations.
    posterior : {"quadrature", "mixture"}
        How the angles' densities are integrated; "mixture" is the paper's Heuristic 1, for one
        look of a line on a uniform grid.
    tolerance : float
        Relative change of the reconstruction at which the iteration rests; the paper's is 1e-6.
    max_iterations : int
        Iterations at most; a step that needs more is reported as not converged.
    max_components : int, optional
        Components that may be used at once; as many as there are sensors if None.
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
        reference: Reference = "middle",
        posterior: PosteriorName = "quadrature",
        tolerance: float = 1e-4,
        max_iterations: int = 500,
        max_components: int | None = None,
        temper: float = 1.0,
        power_floor: float | None = None,
        max_snr_db: float | None = None,
        merge: float = 0.0,
    ) -> None:
        self.measurement = instance("measurement", measurement, ArraySnapshot)
        self.reference = one_of("reference", reference, ("middle", "first"))
        self.posterior = one_of("posterior", posterior, ("quadrature", "mixture"))
        self.tolerance = positive("tolerance", tolerance)
        self.max_iterations = count("max_iterations", max_iterations)
        self.max_components = max_components
        if max_components is not None:
            count("max_components", max_components)
        self.temper = positive("temper", temper)
        if temper < 1:
            raise ValueError(f"temper must be at least 1; got {temper}")
        self.power_floor, self.max_snr_db = power_floor, max_snr_db
        if power_floor is not None:
            not_negative("power_floor", power_floor)
        if max_snr_db is not None:
            positive("max_snr_db", max_snr_db)
        self.merge = not_negative("merge", merge)
        check_directions(measurement, self.reference, self.posterior)
        self.bin_noise = np.full(measurement.n_bins, np.nan)
        self._nothing()

    @property
    def engine(self) -> Engine:
        """What maximises the ELBO, with this tracker's settings."""
        return CoordinateAscent(
            self.posterior,
            self.tolerance,
            self.max_iterations,
            merge=self.merge,
            snr_db=None,
            max_components=self.max_components,
            descending=True,
            temper=self.temper,
            power_floor=self.power_floor,
            max_snr_db=self.max_snr_db,
        )

    @property
    def n_slots(self) -> int:
        """Number of components that may be used at once."""
        n_sensors = self.measurement.array.n_sensors
        return min(n_sensors, self.max_components or n_sensors)

    def predict(self, u: ArrayLike | None = None, *, dt: float = 1.0) -> None:
        """Forget: nothing is carried from snapshot to snapshot."""
        not_negative("dt", dt)
        self._nothing()

    def update(self, z: ArrayLike | None) -> None:
        """Fit one measurement, of the model's `shape`; sensors that are NaN are left out."""
        if missed(z):
            return
        manifold, fit = self._fit(z, None)
        found = reported(manifold, fit)
        self._show(described(manifold, fit, found, np.full(found.sum(), -1)))

    def _fit(self, z: ArrayLike | None, prediction: Prediction | None) -> tuple[Manifold, Fit]:
        """Fit the looks and sensors that gave a number; a silent step holds nothing."""
        Y = self.measurement.looks(np.asarray(z))
        heard = Heard.of(Y)
        manifold = self.measurement.manifold(self.reference).only(np.flatnonzero(heard.bins))
        manifold, Y = manifold.without(np.flatnonzero(~heard.sensors)), heard.block(Y)
        if not Y.any():
            return manifold, SILENCE
        if prediction is not None and prediction.noise is not None:
            prediction = replace(prediction, noise=prediction.noise[heard.bins])
        fit = self.engine.fit(Y, manifold, prediction)
        self.bin_noise = updated(self.bin_noise, heard.bins, fit.bin_noise)
        return manifold, fit

    def _show(self, estimate: DirectionEstimate) -> None:
        self._estimate = estimate
        self.noise = estimate.noise
        self.x = padded(estimate.doa, self.n_slots, np.nan)
        self.P = np.diag(padded(estimate.std**2, self.n_slots, 0.0))

    def _nothing(self) -> None:
        self._show(DirectionEstimate.nothing())

    @property
    def estimate(self) -> DirectionEstimate:
        """The sources found in the last snapshot."""
        return self._estimate


def check_directions(
    measurement: ArraySnapshot, reference: Reference, posterior: PosteriorName
) -> None:
    """Refuse arrays that give no directions, and warn of those that give several for one.

    Raises
    ------
    ValueError
        If the measurement has no manifold, or none for the posterior wanted.
    """
    manifold = measurement.manifold(reference)
    if manifold.coefficients is None:
        if posterior == "mixture" and not measurement.is_single:
            raise ValueError('posterior "mixture" takes one look a step')
        return
    if posterior == "mixture":
        raise ValueError('posterior "mixture" wants a line on a uniform grid, at one wavelength')
    if (pair := measurement.ambiguity()) is not None:
        one, other = np.rad2deg(pair)
        warnings.warn(
            f"directions {one:.1f} and {other:.1f} degrees look alike to this array at every "
            "frequency: sources may be reported at either. Several frequencies, or sensors "
            "nearer to each other, would tell them apart",
            stacklevel=4,
        )


SILENCE = Fit(
    theta=np.zeros(0),
    resultant=np.zeros(0),
    active=np.zeros(0, dtype=np.bool_),
    was_active=np.zeros(0, dtype=np.bool_),
    amplitude=np.zeros(0, dtype=np.complex128),
    evidence=np.zeros(0),
    noise=0.0,
    power=0.0,
    iterations=0,
    converged=True,
)


def reported(manifold: Manifold, fit: Fit) -> Bool:
    """Tell which components are active and belong, within three std, to a real direction."""
    doa = manifold.to_doa(fit.theta, slack=3 * circular_std(fit.resultant))
    return np.asarray(fit.active & ~np.isnan(doa))


def described(manifold: Manifold, fit: Fit, found: Bool, label: Int) -> DirectionEstimate:
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
