"""Directions tracked from snapshot to snapshot, gridless, their number unknown and changing."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from arrivals.checks import instance, one_of, positive
from arrivals.measurement_models.manifolds import Reference
from arrivals.measurement_models.snapshots import ArraySnapshot
from arrivals.motion_models.bernoulli_von_mises import BernoulliVonMises
from arrivals.motion_models.bessel import bessel_ratio, bessel_ratios, inverse_bessel_ratio
from arrivals.trackers.base import missed
from arrivals.trackers.coordinate_ascent import CoordinateAscent, PosteriorName
from arrivals.trackers.estimates import DirectionEstimate
from arrivals.trackers.line_spectrum import Engine, Fit, Prediction
from arrivals.trackers.looks import Heard
from arrivals.trackers.registry import register
from arrivals.trackers.slots import padded
from arrivals.trackers.valse import VALSE, circular_std, described, reported
from arrivals.typing import Bool, Complex, Float, Int

Carry = Literal["von_mises", "posterior"]


@register("svalse")
class SVALSE(VALSE):
    """Sequential VALSE: what was found in one step is the prior of the next.

    The components in use at the end of a step are carried to the next one, and so, for one step,
    are those that were in use at the end of one of its iterations. Each keeps its von Mises
    density, widened by the motion model, and its label.

    Parameters
    ----------
    measurement : ArraySnapshot
        Any array, of as many frequencies and snapshots a step as it says. Its noise is not used:
        the method estimates it.
    motion : BernoulliVonMises
        Steps, births and deaths; the paper's values are the default. Its angle is the electrical
        one, 2π d/λ sin β, of a line on a uniform grid within half of one wavelength, and the
        direction of every other array.
    reference, posterior, tolerance, max_iterations, max_components
        As in `VALSE`. The paper's choices are "first", "mixture" and 1e-6.
    temper, power_floor, max_snr_db
        As in `VALSE`, for recorded data: see docs/any_array.md.
    merge : float
        Of two active components nearer than this, rad of direction, the later is switched off;
        0 for never. (Only in the paper's program, not in its text.)
    snr_db : float, optional
        Signal-to-noise ratio from which the noise estimate of each step starts; above 0, so
        that something is left to the sources. If None, 20 for one look a step; for several, the
        last step's noise, and 20 in the first step.
    carry : {"von_mises", "posterior"}
        What is kept of an angle from step to step: one von Mises density, or the whole one, which
        remembers all directions that single steps cannot tell apart.

    Attributes
    ----------
    mu, kappa, existence, label : ndarray, shape (L,)
        The carried components: mean angle, concentration, probability of being active, and
        label; NaN, 0, 0 and -1 in unused places. These are the belief, and may be assigned.
    moments : ndarray, shape (L, n_moments)
        ⟨exp(jiθ)⟩ of the carried components, where the whole posterior is; else none.
    nuisance : ndarray, shape (L, n_nuisance)
        Their densities over the values of an unknown slowness or elevation.
    bin_noise : ndarray, shape (n_bins,)
        Noise of each bin when it was last heard; NaN before, and for one look of a line.
    x, P, noise
        As in `VALSE`.

    Notes
    -----
    See `VALSE` for what `existence` and `std` of an estimate mean and do not mean. A label is
    given when a component is first reported and stays while the component is carried; two
    sources nearer than `merge` become one, and sources that cross may exchange their labels.
    Between measurements, and after a missed one, the components whose predicted existence is
    at least one half are reported; a snapshot that no more sensors heard than there are such
    components counts as missed.

    References
    ----------
    Park, Meyer and Gerstoft, JASA 153(1), 2023. Direct quadrature, and the phase reference in
    mid array: ours.

    Examples
    --------
    >>> from arrivals.measurement_models import SensorArray
    >>> model = ArraySnapshot(SensorArray.ula(15, spacing=0.5), wavelength=1.0, noise=1e-3)
    >>> z = model.simulate([[0.50], [0.51], [0.52]], 1.0, np.random.default_rng(0))
    >>> run = SVALSE(model).run(z)
    >>> run.doa[:, 0].round(2), run.label[:, 0]
    (array([0.5 , 0.51, 0.51]), array([0, 0, 0]))
    """

    mu: Float
    kappa: Float
    existence: Float
    label: Int
    moments: Complex
    nuisance: Float

    def __init__(
        self,
        measurement: ArraySnapshot,
        motion: BernoulliVonMises = BernoulliVonMises(),  # noqa: B008  (models are immutable)
        *,
        reference: Reference = "middle",
        posterior: PosteriorName = "quadrature",
        tolerance: float = 1e-4,
        max_iterations: int = 500,
        max_components: int | None = None,
        temper: float = 1.0,
        power_floor: float | None = None,
        max_snr_db: float | None = None,
        merge: float = np.deg2rad(1.5),
        snr_db: float | None = None,
        carry: Carry = "von_mises",
    ) -> None:
        super().__init__(
            measurement,
            reference=reference,
            posterior=posterior,
            tolerance=tolerance,
            max_iterations=max_iterations,
            max_components=max_components,
            temper=temper,
            power_floor=power_floor,
            max_snr_db=max_snr_db,
            merge=merge,
        )
        self.motion = instance("motion", motion, BernoulliVonMises)
        self.snr_db = snr_db if snr_db is None else positive("snr_db", snr_db)
        self.carry = one_of("carry", carry, ("von_mises", "posterior"))
        if carry == "posterior" and posterior == "mixture":
            raise ValueError('carry "posterior" wants the posterior "quadrature"')
        self.n_labels = 0
        self.birth = motion.p_activate
        self._carry(np.zeros(0), np.zeros(0), np.zeros(0), np.zeros(0, dtype=np.int64))
        self._carry_densities(None, np.zeros(0, dtype=np.int64))

    @property
    def engine(self) -> Engine:
        """What maximises the ELBO, with this tracker's settings."""
        return CoordinateAscent(
            self.posterior,
            self.tolerance,
            self.max_iterations,
            self.merge,
            20.0 if self.snr_db is None and self.measurement.is_single else self.snr_db,
            self.max_components,
            temper=self.temper,
            power_floor=self.power_floor,
            max_snr_db=self.max_snr_db,
            n_moments=self.n_moments,
        )

    @property
    def n_moments(self) -> int:
        """Moments that a density has after a step of the motion model; 0 if none are carried."""
        if self.carry == "von_mises":
            return 0
        return int(7 * np.sqrt(float(self.motion.blur(np.inf)))) + 8

    def predict(self, u: ArrayLike | None = None, *, dt: float = 1.0) -> None:
        """Widen the angles' densities, and let sources be born and die, (62)-(65).

        The width is that of the exact convolution, A(κ') = A(κ) A(κ_r), whose limit for large
        κ (63) is.
        """
        self.kappa, self.existence, self.birth = (
            self.motion.blur(self.kappa, dt),
            np.where(self.carried, self.motion.predict_existence(self.existence, dt), 0.0),
            float(self.motion.predict_existence(0.0, dt)),
        )
        if self.moments.size:
            step = float(self.motion.blur(np.inf, dt))
            self.moments = self.moments * bessel_ratios(self.moments.shape[1] - 1, step)
        if self.nuisance.shape[1] > 1:
            self.nuisance = drifted(self.nuisance)
        self._show(self._expected())

    def update(self, z: ArrayLike | None) -> None:
        """Fit one measurement given what is carried; leave out sensors that are NaN."""
        if missed(z) or self._too_few(z):
            return
        manifold, fit = self._fit(z, self._prediction())
        label = np.full(len(fit.theta), -1)
        label[: self.carried.sum()] = self.label[self.carried][: len(label)]
        found = reported(manifold, fit)
        fresh = found & (label < 0)
        label[fresh] = self.n_labels + np.arange(fresh.sum())
        self.n_labels += int(fresh.sum())
        self._show(described(manifold, fit, found, label[found]))
        # the active first, then those that were active in some iteration
        history = fit.was_active & ~fit.active
        order = np.concatenate([np.flatnonzero(fit.active), np.flatnonzero(history)])
        kappa = inverse_bessel_ratio(fit.resultant[order])
        self._carry(fit.theta[order], kappa, fit.active[order], label[order])
        self._carry_densities(fit, order)

    def _too_few(self, z: ArrayLike | None) -> bool:
        """Tell whether fewer sensors gave a number than the expected sources need."""
        heard = Heard.of(self.measurement.looks(np.asarray(z))).sensors.sum()
        return bool(heard <= (self.carried & (self.existence >= 0.5)).sum())

    @property
    def carried(self) -> Bool:
        """Which places hold a carried component, (L,)."""
        return ~np.isnan(self.mu)

    def _prediction(self) -> Prediction | None:
        on = self.carried
        if not on.any():
            return None
        return Prediction(
            self.mu[on],
            self.kappa[on],
            self.existence[on],
            self.birth,
            noise=self.bin_noise if self.snr_db is None else None,
            nuisance=self.nuisance[on],
            moments=self.moments[on] if self.moments.size else None,
        )

    def _carry(self, mu: Float, kappa: Float, existence: Float | Bool, label: Int) -> None:
        n = self.n_slots
        self.mu = padded(mu, n, np.nan)
        self.kappa = padded(kappa, n, 0.0)
        self.existence = padded(existence, n, 0.0)
        self.label = padded(label, n, -1).astype(np.int64)

    def _carry_densities(self, fit: Fit | None, order: Int) -> None:
        """Keep the whole densities of the carried components, and those of the second unknown."""
        weights = self.measurement.manifold(self.reference).nuisance_weights
        self.nuisance = np.tile(weights, (self.n_slots, 1))
        self.moments = np.zeros((self.n_slots, self.n_moments), dtype=np.complex128)
        order = order[: self.n_slots]
        if fit is not None and fit.nuisance is not None and fit.moments is not None:
            self.nuisance[: len(order)] = fit.nuisance[order]
            self.moments[: len(order)] = fit.moments[order]

    def _expected(self) -> DirectionEstimate:
        """Return what is likely to be there, before it is measured."""
        manifold = self.measurement.manifold(self.reference)
        likely = self.carried & (self.existence >= 0.5) & (self.label >= 0)
        slack = 3 * circular_std(bessel_ratio(self.kappa))
        likely &= ~np.isnan(manifold.to_doa(self.mu, slack))
        theta, std = self.mu[likely], circular_std(bessel_ratio(self.kappa[likely]))
        return DirectionEstimate(
            doa=manifold.to_doa(theta, slack=np.inf),
            std=manifold.doa_std(theta, std),
            existence=self.existence[likely],
            amplitude=np.full(len(theta), complex(np.nan, np.nan)),
            label=self.label[likely],
        )


def drifted(nuisance: Float) -> Float:
    """Return densities (..., n) of a second unknown after a step, on its grid.

    It stays with probability 0.9, and else goes to a neighbour; a trace is anywhere.

    Examples
    --------
    >>> drifted(np.array([0.0, 1.0, 0.0])).round(4)
    array([0.05  , 0.8999, 0.05  ])
    """
    left, right = nuisance[..., :1], nuisance[..., -1:]
    wide = np.concatenate([left, nuisance, right], axis=-1)
    moved = 0.9 * nuisance + 0.05 * (wide[..., :-2] + wide[..., 2:])
    return np.asarray((1 - 1e-4) * moved + 1e-4 / nuisance.shape[-1])
