"""Directions tracked from snapshot to snapshot, gridless, their number unknown and changing."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, Self

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.array_snapshot import ArraySnapshot
from arrivals.measurement_models.manifolds.manifold import Manifold, Reference
from arrivals.measurement_models.observed import ObservedSnapshots, updated
from arrivals.motion_models.bernoulli_von_mises import BernoulliVonMises
from arrivals.motion_models.bessel import bessel_ratio, bessel_ratios
from arrivals.trackers.direction_tracker import padded
from arrivals.trackers.estimates import DirectionEstimate
from arrivals.trackers.registry import register
from arrivals.trackers.svalse.components import ComponentPosterior, ComponentPrior, Solver
from arrivals.trackers.svalse.coordinate.solver import PosteriorName
from arrivals.trackers.svalse.valse import VALSE, EngineName, circular_std, described, reported
from arrivals.typing import Bool, Complex, Float, Int
from arrivals.validation import instance, one_of, positive

DEFAULT_MOTION = BernoulliVonMises(sigma_doa=np.deg2rad(1.5))
Carry = Literal["von_mises", "posterior"]


@register("svalse")
class SVALSE(VALSE):
    """Sequential VALSE: what was found in one step is the prior of the next.

    The components in use at the end of a step are carried to the next one, and so, for some
    steps, are those that were in use before. Each keeps its von Mises density, widened by the
    motion model, and its label.

    Parameters
    ----------
    measurement : ArraySnapshot
        Any array, of as many frequencies and snapshots a step as it says. Its noise is not used:
        the method estimates it.
    motion : BernoulliVonMises
        Steps, births and deaths. The default has the paper's probabilities, and a step of 1.5°
        in direction; the paper's, `BernoulliVonMises()`, is one in the electrical angle,
        2π d/λ sin β, which lets sources near endfire jump by many degrees.
    engine, reference, posterior, tolerance, max_iterations, max_components, kl
        As in `VALSE`. The paper's choices are "coordinate", "first", "mixture" and 1e-6.
    temper, power_floor, max_snr_db
        As in `VALSE`, for recorded data: see docs/any_array.md.
    merge : float
        Of two active components nearer than this, rad of direction, the later is switched off;
        0 for never. (Only in the paper's program, not in its text.)
    snr_db : float, optional
        Signal-to-noise ratio from which the noise estimate of the first step starts, and, with
        coordinate ascent, of every step; above 0, so that something is left to the sources. If
        None, 20, or with at least as many snapshots a step as sensors that of their covariance;
        with coordinate ascent and several looks later steps start from the noise before. The
        fast engine's later steps start from what was found before in any case.
    carry : {"von_mises", "posterior"}
        What is kept of an angle from step to step: one von Mises density, or the whole one, which
        remembers all directions that single steps cannot tell apart.

    Attributes
    ----------
    mu, kappa, existence, label : ndarray, shape (L,)
        The carried components: mean angle, concentration, probability of being active, and
        label; NaN, 0, 0 and -1 in unused places. These are the belief, and may be assigned.
    age : ndarray of int, shape (L,)
        Steps since each was last in use; 0 for those that are.
    expected_snr_db : float or None
        Smoothed signal-to-noise ratio, where the noise estimate of the next step starts.
    moments : ndarray, shape (L, n_moments)
        ⟨exp(jiθ)⟩ of the carried components, where the whole posterior is; else none.
    nuisance : ndarray, shape (L, n_nuisance)
        Their densities over the values of an unknown slowness or elevation.
    bin_noise : ndarray, shape (n_bins,)
        Noise of each bin when it was last heard; NaN before, and with coordinate ascent on one
        look of a line.
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
    (array([0.5 , 0.51, 0.52]), array([0, 0, 0]))
    """

    mu: Float
    kappa: Float
    existence: Float
    label: Int
    age: Int
    moments: Complex
    nuisance: Float

    def __init__(
        self,
        measurement: ArraySnapshot,
        motion: BernoulliVonMises = DEFAULT_MOTION,
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
        merge: float = np.deg2rad(1.5),
        snr_db: float | None = None,
        carry: Carry = "von_mises",
    ) -> None:
        super().__init__(
            measurement,
            engine=engine,
            reference=reference,
            posterior=posterior,
            tolerance=tolerance,
            max_iterations=max_iterations,
            max_components=max_components,
            kl=kl,
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
        self.expected_snr_db: float | None = None
        none = np.zeros(0)
        self._carry(none, none, none, none.astype(np.int64), none.astype(np.int64))
        self._carry_densities(None, none.astype(np.int64))

    @property
    def solver(self) -> Solver:
        """What maximises the ELBO, with this tracker's settings."""
        single = self.measurement.is_single
        snr_db = 20.0 if self.snr_db is None and single else self.snr_db
        return self._solver(snr_db, descending=False, n_moments=self.n_moments)

    @property
    def n_moments(self) -> int:
        """Moments that a density has after a step of the motion model; 0 if none are carried."""
        if self.carry == "von_mises":
            return 0
        manifold = self.measurement.manifold(self.reference)
        slowest = manifold.slope(manifold.from_doa(np.pi / 2))
        return int(7 * np.sqrt(float(self.motion.blur(np.inf, 1.0, slowest)))) + 8

    def predict(self, u: ArrayLike | None = None, *, dt: float = 1.0) -> None:
        """Widen the angles' densities, and let sources be born and die, (62)-(65).

        The width is that of the exact convolution, A(κ') = A(κ) A(κ_r), whose limit for large
        κ (63) is.
        """
        super().predict(u, dt=dt)

    def _move(self, trackers: Sequence[Self], dt: float) -> None:
        mu, kappa, existence = (
            np.stack([getattr(tracker, name) for tracker in trackers])
            for name in ("mu", "kappa", "existence")
        )
        carried = ~np.isnan(mu)
        slope = self.measurement.manifold(self.reference).slope(np.where(carried, mu, 0.0))
        kappa = self.motion.blur(kappa, dt, slope)
        rho = np.where(carried, self.motion.predict_existence(existence, dt), 0.0)
        birth = float(self.motion.predict_existence(0.0, dt))
        for i, tracker in enumerate(trackers):
            tracker.kappa, tracker.existence, tracker.birth = kappa[i], rho[i], birth
            tracker._move_densities(slope[i], dt)

    def _move_densities(self, slope: Float, dt: float) -> None:
        """Blur whole densities by the exact convolution, and let the second unknown drift."""
        if self.moments.size:
            step = np.broadcast_to(self.motion.blur(np.inf, dt, slope), slope.shape)
            self.moments = self.moments * bessel_ratios(self.moments.shape[1] - 1, step)
        if self.nuisance.shape[1] > 1:
            self.nuisance = drifted(self.nuisance)

    def _expect(self) -> None:
        self.report(**vars(self._expected(self.measurement.manifold(self.reference))))

    def _absorb(
        self, manifold: Manifold, fit: ComponentPosterior, heard: ObservedSnapshots
    ) -> None:
        """Take in a fit: report and label what is active, carry what is to be remembered."""
        label = np.full(len(fit.theta), -1)
        label[: self.carried.sum()] = self.label[self.carried][: len(label)]
        found = reported(manifold, fit)
        fresh = found & (label < 0)
        label[fresh] = self.n_labels + np.arange(fresh.sum())
        self.n_labels += int(fresh.sum())
        self.report(**vars(described(manifold, fit, found, label[found])))
        order = np.concatenate([np.flatnonzero(fit.age == 0), np.flatnonzero(fit.age > 0)])
        self._carry(
            fit.theta[order], fit.kappa[order], fit.active[order], label[order], fit.age[order]
        )
        self._carry_densities(fit, order)
        self.expected_snr_db = fit.snr_db
        self.bin_noise = updated(self.bin_noise, heard.bins, fit.bin_noise)

    def _looks(self, z: ArrayLike | None) -> tuple[Complex, ObservedSnapshots] | None:
        """Return the data, or None also if fewer sensors gave a number than the tracks need."""
        looks = super()._looks(z)
        expected = (self.carried & (self.age == 0) & (self.existence >= 0.5)).sum()
        return None if looks is None or looks[1].sensors.sum() <= expected else looks

    @property
    def carried(self) -> Bool:
        """Which places hold a carried component, (L,)."""
        return ~np.isnan(self.mu)

    def _prediction(self, heard: ObservedSnapshots | None = None) -> ComponentPrior:
        on = self.carried
        return ComponentPrior(
            self.mu[on],
            self.kappa[on],
            self.existence[on],
            self.birth,
            self.age[on],
            self.expected_snr_db,
            noise=None if heard is None or self.snr_db else self.bin_noise[heard.bins],
            nuisance=self.nuisance[on],
            moments=self.moments[on] if self.moments.size else None,
        )

    def _carry(
        self, mu: Float, kappa: Float, existence: Float | Bool, label: Int, age: Int
    ) -> None:
        n = self.n_slots
        self.mu = padded(mu, n, np.nan)
        self.kappa = padded(kappa, n, 0.0)
        self.existence = padded(existence, n, 0.0)
        self.label = padded(label, n, -1).astype(np.int64)
        self.age = padded(age, n, 0).astype(np.int64)

    def _carry_densities(self, fit: ComponentPosterior | None, order: Int) -> None:
        """Keep the whole densities of the carried components, and those of the second unknown."""
        weights = self.measurement.manifold(self.reference).nuisance_weights
        self.nuisance = np.tile(weights, (self.n_slots, 1))
        self.moments = np.zeros((self.n_slots, self.n_moments), dtype=np.complex128)
        order = order[: self.n_slots]
        if fit is not None and fit.nuisance is not None and fit.moments is not None:
            self.nuisance[: len(order)] = fit.nuisance[order]
            self.moments[: len(order)] = fit.moments[order]

    def _expected(self, manifold: Manifold) -> DirectionEstimate:
        """Return what is likely to be there, before it is measured."""
        likely = np.flatnonzero(self.carried & (self.existence >= 0.5) & (self.label >= 0))
        std = circular_std(bessel_ratio(self.kappa[likely]))
        real = ~np.isnan(manifold.to_doa(self.mu[likely], 3 * std))
        likely, std = likely[real], std[real]
        theta = self.mu[likely]
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
