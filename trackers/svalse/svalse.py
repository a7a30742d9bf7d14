"""Directions tracked from step to step, gridless, of an unknown and changing number of sources."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar, Literal, Self

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.direction_measurement import DirectionMeasurement
from arrivals.measurement_models.manifolds.manifold import Reference
from arrivals.measurement_models.observed import ObservedSnapshots, merge_noise
from arrivals.motion_models.bernoulli_von_mises import BernoulliVonMises
from arrivals.motion_models.bessel import bessel_ratios
from arrivals.trackers.direction_state import padded
from arrivals.trackers.registry import register
from arrivals.trackers.svalse.components import (
    ComponentPosterior,
    ComponentPrior,
    Solver,
    no_components,
)
from arrivals.trackers.svalse.coordinate.solver import PosteriorName
from arrivals.trackers.svalse.prediction import (
    DEFAULT_MOTION,
    drifted,
    motion_on,
    n_mode_rows,
    n_moments,
    nuisance_weights,
    predicted_components,
    stacked,
    with_modes,
)
from arrivals.trackers.svalse.report_when_read import PredictedReport
from arrivals.trackers.svalse.reporting import detected, existence_of
from arrivals.trackers.svalse.valse import DEFAULT_SOLVER, VALSE, Engine
from arrivals.typing import Bool, Complex, Float, Int
from arrivals.validation import instance, no_control, one_of, time_step

Memory = Literal["von_mises", "posterior"]
CarriedExistence = Literal["active", "probability"]
INITIAL_SNR_DB = 20.0  # of the first step, for one snapshot a step


@register("svalse")
class SVALSE(VALSE):
    """Sequential VALSE: the components of one step are the prior of the next.

    The components active at the end of a step are tracked to the next one, and so, for some
    steps, are those that were active before. Each keeps its von Mises density, widened by the
    motion model, and its label.

    Parameters
    ----------
    measurement : DirectionMeasurement
        An `ArraySnapshot`, or a model with its methods: any array, with any number of frequencies
        and snapshots a step. Its noise is not used: the method estimates it.
    motion : BernoulliVonMises
        Steps, births and deaths. The default has the paper's probabilities, a step of 1.5° in
        direction, and may stand still; the paper's, `BernoulliVonMises()`, has one in the
        electrical angle, 2π d/λ sin β, which lets sources near endfire jump by many degrees.
    solver : NewtonSolver or CoordinateSolver
        Maximization of the bound, with its settings; see `VALSE`. The published program's choices
        are `CoordinateSolver.paper()` and `reference="first"`; the paper prints a probability of
        0.5 in the first step, `CoordinateSolver.paper(first_existence=0.5)`.
    engine : {"newton", "fast", "coordinate"}, optional
        Shorthand for a solver of that kind ("fast" is "newton") with those settings of `solver`
        that both kinds have; the attribute is None afterwards.
    posterior : {"quadrature", "mixture"}, optional
        Shorthand for that setting of a `CoordinateSolver`; the attribute is None afterwards.
    reference : {"middle", "first"}
        Sensor at which the amplitudes' phases are counted; "first" is the paper's.
    memory : {"von_mises", "posterior"}
        What is kept of an angle from step to step: one von Mises density, or the whole density,
        with all directions that single steps leave ambiguous. The whole density needs coordinate
        ascent: `NewtonSolver` passes it on to a `CoordinateSolver`.
    carry_existence : {"active", "probability"}
        What is kept of a component's existence: 1 where it is active, which is the paper's, or
        its probability, a Bernoulli filter. The latter is better where sources start and stop as
        often as the motion model says, and loses weak ones where they stay on for long.

    Attributes
    ----------
    mu, kappa, existence, label : ndarray, shape (L,)
        Tracked components: mean angle, concentration, probability of being active, and label;
        NaN, 0, 0 and -1 in unused slots. These are the belief, and may be assigned. With two
        unknowns a source `mu` has points of the manifold, (L, point_size), and `kappa` the upper
        triangles of precisions in its chart, (L, 3).
    curved : ndarray of bool, shape (L,)
        Which of them are curved waves, where sources have a range.
    age : ndarray of int, shape (L,)
        Steps since each was last active; 0 for those that are.
    expected_snr_db : float or None
        Smoothed signal-to-noise ratio, from which the noise of the next step starts.
    moments : ndarray, shape (L, n_moments)
        ⟨exp(jiθ)⟩ of the tracked components, where the memory is the posterior; else none.
    nuisance : ndarray, shape (L, n_nuisance)
        Their densities over the values of an unknown slowness or elevation.
    modes : ndarray, shape (3, L, 2)
        Their modes where the motion may stand still, as in `MoveStopWalk`; else zeros. With two
        unknowns a source the offsets, covariances and weights, (6, L, 2).
    bin_noise : ndarray, shape (n_bins,)
        Noise of each bin when it last had valid data; NaN before.

    Notes
    -----
    See `VALSE` for the limits of `existence` and `std` of an estimate. A label is
    assigned when a component is first reported and stays while the component is tracked; two
    sources nearer than the solver's `merge` become one, and sources that cross may exchange their
    labels. Between measurements, and after a missing one, components of predicted existence 0.5 and
    more are reported; a snapshot of no more valid sensors than such components counts as missing.

    References
    ----------
    Park, Meyer and Gerstoft, JASA 153(1), 2023; quadrature and the reference in mid array: ours.

    Examples
    --------
    >>> from arrivals.measurement_models import ArraySnapshot, SensorArray
    >>> model = ArraySnapshot(SensorArray.ula(15, spacing=0.5), wavelength=1.0, noise=1e-3)
    >>> z = model.simulate([[0.50], [0.51], [0.52]], 1.0, np.random.default_rng(0))
    >>> run = SVALSE(model).run(z)
    >>> run.doa[:, 0].round(2), run.label[:, 0]
    (array([0.5 , 0.51, 0.52]), array([0, 0, 0]))
    """

    moments: Complex
    nuisance: Float
    renamed: ClassVar[dict[str, str]] = {"carry": "memory", "snr_db": "solver__snr_db"}

    def __init__(
        self,
        measurement: DirectionMeasurement,
        motion: BernoulliVonMises = DEFAULT_MOTION,
        *,
        solver: Solver = DEFAULT_SOLVER,
        engine: Engine | None = None,
        posterior: PosteriorName | None = None,
        reference: Reference = "middle",
        memory: Memory = "von_mises",
        carry_existence: CarriedExistence = "active",
    ) -> None:
        self.motion = instance("motion", motion, BernoulliVonMises)
        self.memory = one_of("memory", memory, ("von_mises", "posterior"))
        self.carry_existence = one_of("carry_existence", carry_existence, ("active", "probability"))
        super().__init__(
            measurement, solver=solver, engine=engine, posterior=posterior, reference=reference
        )
        self.motion = motion_on(self.full_manifold, motion, self.memory)

    def reset(self) -> None:
        """Forget all components, labels and noise estimates."""
        self.n_labels, self.birth = 0, self.motion.p_activate
        self.expected_snr_db: float | None = None
        self._keep(no_components(self.full_manifold), np.zeros(0, dtype=np.int64))
        super().reset()

    @property
    def n_moments(self) -> int:
        """Number of moments that a density has after a step of the motion model; 0 if not kept."""
        return 0 if self.memory == "von_mises" else n_moments(self.full_manifold, self.motion)

    @property
    def tracked(self) -> Bool:
        """Slots that hold a tracked component, (L,)."""
        return ~np.isnan(self.mu if self.mu.ndim == 1 else self.mu[:, 0])

    def predict(self, u: ArrayLike | None = None, *, dt: float = 1.0) -> None:
        """Predict the densities, births and deaths, (62)-(65)."""
        no_control(u)
        self.predict_batch([self], dt)
        self.report_prior()

    def update(self, z: ArrayLike | None) -> None:
        """Fit one measurement: sections III and IV."""
        observed = self.observe(z)
        if observed is None:
            return
        prior = self.component_prior(observed)  # (65)
        posterior = self.solver.solve(observed.snapshots, observed.manifold, prior)  # (30)-(59)
        posterior = self.updated_modes([self], [posterior])[0]  # of a walk that may stand still
        self.store(posterior, observed)  # labels, components, noise per bin

    def predict_batch(self, trackers: Sequence[Self], dt: float) -> None:
        """Predict the beliefs of copies of this tracker by `dt`."""
        dt = time_step(dt)
        existence = stacked([tracker.existence for tracker in trackers])
        tracked = stacked([tracker.tracked for tracker in trackers])
        # μ' = μ   (62);  A(κ') = A(κ) A(κ_r), of which (63) is the limit for large κ
        moved = predicted_components(self.full_manifold, self.motion, trackers, tracked, dt)
        mu, kappa, modes, slope = moved
        # ρ' = (1 - p_d) ρ + p_a (1 - ρ)   (64)
        rho = np.where(tracked, self.motion.predict_existence(existence, dt), 0.0)
        # ρ' = p_a of a component that was not tracked   (65)
        birth = float(self.motion.predict_existence(0.0, dt))
        for i, tracker in enumerate(trackers):
            tracker.mu, tracker.kappa, tracker.modes = mu[i], kappa[i], modes[:, i]
            tracker.existence, tracker.birth = rho[i], birth
            tracker._predict_densities(slope[i], dt)

    def updated_modes(
        self, trackers: Sequence[Self], posteriors: Sequence[ComponentPosterior]
    ) -> Sequence[ComponentPosterior]:
        """Return posteriors with updated modes of a walk that may stand still."""
        return with_modes(self.motion.move_stop, self.full_manifold, trackers, posteriors)

    def _predict_densities(self, slope: Float, dt: float) -> None:
        """Predict whole densities by the exact convolution, and those of the second unknown."""
        if self.moments.size:
            step = np.broadcast_to(self.motion.blur(np.inf, dt, slope), slope.shape)
            self.moments = self.moments * bessel_ratios(self.moments.shape[1] - 1, step)
        if self.nuisance.shape[1] > 1:
            self.nuisance = drifted(self.nuisance)

    def report_prior(self) -> None:
        """Report the components that are expected before a measurement."""
        self.report_when_read(
            PredictedReport(
                self.estimate_kind, self.full_manifold, self.mu.copy(), self.kappa.copy(),
                self.existence.copy(), self.label.copy(), self.curved.copy(),
            )
        )  # fmt: skip

    def observe(self, z: ArrayLike | None) -> ObservedSnapshots | None:
        """Return the valid data; None also if there are too few sensors for the components."""
        observed = super().observe(z)
        expected = np.count_nonzero(self.tracked & (self.age == 0) & (self.existence >= 0.5))
        enough = observed is not None and np.count_nonzero(observed.sensors) > expected
        return observed if enough else None

    def component_prior(self, observed: ObservedSnapshots) -> ComponentPrior:
        """Return the predicted densities and probabilities of the tracked components, (65)."""
        on, snr_db = self.tracked, self.expected_snr_db
        if snr_db is None and self.measurement.is_single:
            snr_db = getattr(self.solver, "snr_db", None) or INITIAL_SNR_DB
        return ComponentPrior(
            self.mu[on],
            self.kappa[on],
            self.existence[on],
            self.birth,
            self.age[on],
            snr_db,
            noise=self.bin_noise[observed.bins],
            nuisance=self.nuisance[on],
            moments=self.moments[on] if self.moments.size else None,
            n_moments=self.moments.shape[1],
            curved=self.curved[on],
        )

    def store(self, posterior: ComponentPosterior, observed: ObservedSnapshots) -> None:
        """Report and label the active components, and track them and recent ones."""
        label = np.full(len(posterior.theta), -1)
        label[: self.tracked.sum()] = self.label[self.tracked][: len(label)]
        manifold = observed.manifold
        active = detected(manifold, posterior)
        unlabelled = active & (label < 0)
        n_new = int(np.count_nonzero(unlabelled))
        label[unlabelled] = self.n_labels + np.arange(n_new)
        self.n_labels += n_new
        self.report_posterior(posterior, manifold, active, label[active])
        self._keep(posterior, label)
        self.expected_snr_db = posterior.snr_db
        self.bin_noise = merge_noise(self.bin_noise, observed.bins, posterior.bin_noise)

    def _keep(self, posterior: ComponentPosterior, label: Int) -> None:
        """Track active components and recent ones, as many as there are slots."""
        n, age = self.n_slots, posterior.age
        order = np.concatenate([(age == 0).nonzero()[0], (age > 0).nonzero()[0]])[:n]
        existence: Float = posterior.active.astype(np.float64)
        if self.carry_existence == "probability":
            existence = existence * existence_of(posterior)
        self.mu = padded(posterior.theta[order], n, np.nan)
        self.kappa = padded(posterior.kappa[order], n, 0.0)
        self.curved: Bool = np.arange(n) < len(order)
        if posterior.curved is not None:
            self.curved[: len(order)] = posterior.curved[order]
        self.existence: Float = padded(existence[order], n, 0.0)
        self.label: Int = padded(label[order], n, -1).astype(np.int64)
        self.age: Int = padded(age[order], n, 0).astype(np.int64)
        weights = nuisance_weights(self.full_manifold)
        self.nuisance = np.zeros((n, len(weights))) + weights
        self.moments = np.zeros((n, self.n_moments), dtype=np.complex128)
        self.modes = np.zeros((n_mode_rows(self.full_manifold), n, 2))
        if posterior.modes is not None:
            self.modes[:, : len(order)] = posterior.modes[:, order]
        if posterior.nuisance is not None and posterior.moments is not None:
            self.nuisance[: len(order)] = posterior.nuisance[order]
            self.moments[: len(order)] = posterior.moments[order]
