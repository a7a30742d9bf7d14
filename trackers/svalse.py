"""Directions tracked from snapshot to snapshot, gridless, their number unknown and changing."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from arrivals.checks import instance, not_negative, positive
from arrivals.measurement_models.manifolds import Manifold, Reference
from arrivals.measurement_models.snapshots import ArraySnapshot
from arrivals.motion_models.bernoulli_von_mises import BernoulliVonMises
from arrivals.motion_models.bessel import bessel_ratio
from arrivals.trackers.coordinate_ascent import PosteriorName
from arrivals.trackers.estimates import DirectionEstimate
from arrivals.trackers.line_spectrum import Engine, Fit, Prediction
from arrivals.trackers.registry import register
from arrivals.trackers.slots import padded
from arrivals.trackers.valse import VALSE, EngineName, circular_std, described, reported
from arrivals.typing import Bool, Complex, Float, Int

DEFAULT_MOTION = BernoulliVonMises(sigma_doa=np.deg2rad(1.5))


@register("svalse")
class SVALSE(VALSE):
    """Sequential VALSE: what was found in one step is the prior of the next.

    The components in use at the end of a step are carried to the next one, and so, for some
    steps, are those that were in use before. Each keeps its von Mises density, widened by the
    motion model, and its label.

    Parameters
    ----------
    measurement : ArraySnapshot
        Its array must be a line on a uniform grid, gaps allowed. Its noise is not used: the
        method estimates it.
    motion : BernoulliVonMises
        Steps, births and deaths. The default has the paper's probabilities, and a step of 1.5°
        in direction; the paper's, `BernoulliVonMises()`, is one in the electrical angle,
        2π d/λ sin β, which lets sources near endfire jump by many degrees.
    engine, reference, posterior, tolerance, max_iterations, max_components, kl
        As in `VALSE`. The paper's choices are "coordinate", "first", "mixture" and 1e-6.
    merge : float
        Of two active components nearer than this, rad of direction, the later is switched off;
        0 for never. (Only in the paper's program, not in its text.)
    snr_db : float
        Signal-to-noise ratio from which the noise estimate of the first step starts, and, with
        coordinate ascent, of every step; above 0, so that something is left to the sources.

    Attributes
    ----------
    mu, kappa, existence, label : ndarray, shape (L,)
        The carried components: mean angle, concentration, probability of being active, and
        label; NaN, 0, 0 and -1 in unused places. These are the belief, and may be assigned.
    age : ndarray of int, shape (L,)
        Steps since each was last in use; 0 for those that are.
    expected_snr_db : float or None
        Smoothed signal-to-noise ratio, where the noise estimate of the next step starts.
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
    age: Int

    def __init__(
        self,
        measurement: ArraySnapshot,
        motion: BernoulliVonMises = DEFAULT_MOTION,
        *,
        engine: EngineName = "fast",
        reference: Reference = "middle",
        posterior: PosteriorName = "quadrature",
        tolerance: float = 1e-4,
        max_iterations: int = 500,
        max_components: int | None = None,
        kl: float = 0.5,
        merge: float = np.deg2rad(1.5),
        snr_db: float = 20.0,
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
        )
        self.motion = instance("motion", motion, BernoulliVonMises)
        self.merge = not_negative("merge", merge)
        self.snr_db = positive("snr_db", snr_db)
        self.n_labels = 0
        self.birth = motion.p_activate
        self.expected_snr_db: float | None = None
        none = np.zeros(0)
        self._carry(none, none, none, none.astype(np.int64), none.astype(np.int64))

    @property
    def solver(self) -> Engine:
        """What maximises the ELBO, with this tracker's settings."""
        return self._solver(self.merge, self.snr_db)

    def predict(self, u: ArrayLike | None = None, *, dt: float = 1.0) -> None:
        """Widen the angles' densities, and let sources be born and die, (62)-(65).

        The width is that of the exact convolution, A(κ') = A(κ) A(κ_r), whose limit for large
        κ (63) is.
        """
        super().predict(u, dt=dt)

    def _move(self, trackers: Sequence[Self], dt: float, manifold: Manifold) -> None:
        mu, kappa, existence = (
            np.stack([getattr(tracker, name) for tracker in trackers])
            for name in ("mu", "kappa", "existence")
        )
        carried = ~np.isnan(mu)
        slope = manifold.slope(np.where(carried, mu, 0.0))
        kappa = self.motion.blur(kappa, dt, slope)
        rho = np.where(carried, self.motion.predict_existence(existence, dt), 0.0)
        birth = float(self.motion.predict_existence(0.0, dt))
        for i, tracker in enumerate(trackers):
            tracker.kappa, tracker.existence, tracker.birth = kappa[i], rho[i], birth

    def _absorb(self, manifold: Manifold, fit: Fit) -> None:
        """Take in a fit: report and label what is active, carry what is to be remembered."""
        label = np.full(len(fit.theta), -1)
        label[: self.carried.sum()] = self.label[self.carried][: len(label)]
        found = reported(manifold, fit)
        fresh = found & (label < 0)
        label[fresh] = self.n_labels + np.arange(fresh.sum())
        self.n_labels += int(fresh.sum())
        self._show(described(manifold, fit, found, label[found]))
        order = np.concatenate([np.flatnonzero(fit.age == 0), np.flatnonzero(fit.age > 0)])
        self._carry(
            fit.theta[order], fit.kappa[order], fit.active[order], label[order], fit.age[order]
        )
        self.expected_snr_db = fit.snr_db

    def _looks(self, z: ArrayLike | None) -> tuple[Complex, Bool] | None:
        """Return the data, or None also if fewer sensors gave a number than the tracks need."""
        looks = super()._looks(z)
        expected = (self.carried & (self.age == 0) & (self.existence >= 0.5)).sum()
        return None if looks is None or (~looks[1]).sum() <= expected else looks

    @property
    def carried(self) -> Bool:
        """Which places hold a carried component, (L,)."""
        return ~np.isnan(self.mu)

    def _prediction(self) -> Prediction | None:
        on = self.carried
        return Prediction(
            self.mu[on],
            self.kappa[on],
            self.existence[on],
            self.birth,
            self.age[on],
            self.expected_snr_db,
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

    def _expect(self, manifold: Manifold) -> None:
        """Show what is likely to be there, before it is measured."""
        likely = np.flatnonzero(self.carried & (self.existence >= 0.5) & (self.label >= 0))
        std = circular_std(bessel_ratio(self.kappa[likely]))
        real = ~np.isnan(manifold.to_doa(self.mu[likely], 3 * std))
        likely, std = likely[real], std[real]
        theta = self.mu[likely]
        expected = DirectionEstimate(
            doa=manifold.to_doa(theta, slack=np.inf),
            std=manifold.doa_std(theta, std),
            existence=self.existence[likely],
            amplitude=np.full(len(theta), complex(np.nan, np.nan)),
            label=self.label[likely],
        )
        self._show(expected)
