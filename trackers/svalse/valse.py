"""Directions of one step at a time, gridless, of an unknown number of sources."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, ClassVar, Literal, Self

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.direction_measurement import DirectionMeasurement
from arrivals.measurement_models.manifolds.manifold import Manifold, Reference
from arrivals.measurement_models.observed import ObservedSnapshots, merge_noise
from arrivals.messages import shown
from arrivals.trackers.direction_tracker import warn_of_ambiguity
from arrivals.trackers.registry import register
from arrivals.trackers.svalse.components import (
    ComponentPosterior,
    ComponentPrior,
    Solver,
    SolverSettings,
)
from arrivals.trackers.svalse.coordinate.solver import CoordinateSolver, PosteriorName
from arrivals.trackers.svalse.newton.solver import NewtonSolver
from arrivals.trackers.svalse.prediction import same_unknowns
from arrivals.trackers.svalse.report_when_read import ReportWhenRead
from arrivals.trackers.svalse.reporting import (
    amplitudes,
    detected,
    estimate_kind,
    existence_of,
    located,
    spread_of,
)
from arrivals.typing import Bool, Int
from arrivals.validation import instance, no_control, one_of, time_step

Engine = Literal["newton", "fast", "coordinate"]
DEFAULT_SOLVER = NewtonSolver()


@register("valse")
class VALSE(ReportWhenRead):
    """Variational Bayesian line spectral estimation: every step on its own.

    Parameters
    ----------
    measurement : DirectionMeasurement
        An `ArraySnapshot`, or a model with its methods: any array, with any number of frequencies
        and snapshots a step. Its noise is not used: the method estimates it.
    solver : NewtonSolver or CoordinateSolver
        Maximization of the bound, with its settings: joint Newton steps on all unknowns, or the
        paper's coordinate ascent, which takes three to thirty times as long and integrates the
        angles' densities. `NewtonSolver` serves every array, with any number of frequencies and
        snapshots; measurements with an unknown slowness or elevation it passes to coordinate
        ascent. `CoordinateSolver.paper()` is the published form.
    engine : {"newton", "fast", "coordinate"}, optional
        Shorthand for a solver of that kind ("fast" is "newton") with those settings of `solver`
        that both kinds have; the attribute is None afterwards.
    posterior : {"quadrature", "mixture"}, optional
        Shorthand for that setting of a `CoordinateSolver`; the attribute is None afterwards.
    reference : {"middle", "first"}
        Sensor at which the amplitudes' phases are counted. "first" is the paper's; with the
        middle one phase and angle are uncorrelated, which saves most of the iterations.

    Attributes
    ----------
    x, P : ndarray, shapes (L,), (L, L)
        Estimated directions, rad, NaN in unused slots, and their variances on a diagonal.
    noise : float
        Estimated variance of the noise of one sensor.
    bin_noise : ndarray, shape (n_bins,)
        Noise of each bin when it last had valid data; NaN before, and with coordinate ascent on
        one snapshot of a line.

    Notes
    -----
    `existence` of an estimate is the posterior probability of the component, the noise integrated
    out. `std` is the marginal circular standard deviation of the angle, for unknown noise; with
    coordinate ascent that of the angle given the other components, which with several sources is
    too small: of Figs 4 to 6 by factors of 4 to 7. Below half a wavelength of spacing, components
    to which no real direction belongs are left out of the estimate.

    References
    ----------
    Badiu, Hansen and Fleury, IEEE TSP 65(9), 2017. Phase reference in mid array: ours.

    Examples
    --------
    >>> from arrivals.measurement_models import ArraySnapshot, SensorArray
    >>> model = ArraySnapshot(SensorArray.ula(15, spacing=0.5), wavelength=1.0, noise=1e-3)
    >>> z = model.simulate([-0.2, 0.5], [1.0, 1.0j], np.random.default_rng(0))
    >>> tracker = VALSE(model)
    >>> tracker.update(z)
    >>> np.sort(tracker.estimate.doa).round(2)
    array([-0.2,  0.5])
    """

    renamed: ClassVar[dict[str, str]] = {
        name: f"solver__{name}"
        for name in ("tolerance", "max_iterations", "max_components", "power_floor", "max_snr_db")
    } | {"kl": "solver__kl_weight", "temper": "solver__tempering", "merge": "solver__merge"}

    def __init__(
        self,
        measurement: DirectionMeasurement,
        *,
        solver: Solver = DEFAULT_SOLVER,
        engine: Engine | None = None,
        posterior: PosteriorName | None = None,
        reference: Reference = "middle",
    ) -> None:
        protocol: type[Any] = DirectionMeasurement
        self.measurement: DirectionMeasurement = instance("measurement", measurement, protocol)
        self.solver = selected_solver(solver, engine, posterior)
        self.engine, self.posterior = None, None
        self.reference = one_of("reference", reference, ("middle", "first"))
        manifold = measurement.manifold(self.reference)
        self.solver.check(manifold, getattr(measurement, "n_snapshots", 1), self.n_moments)
        warn_of_ambiguity(measurement)
        self.reset()

    def reset(self) -> None:
        """Report no direction, and forget the noise of each bin."""
        self.estimate_kind = estimate_kind(self.full_manifold)
        self.bin_noise = np.full(self.full_manifold.n_bins, np.nan)
        super().reset()

    def set_params(self, **params: Any) -> Self:
        """Change parameters by name; reset if components do not mean the same any more."""
        before = self.full_manifold
        super().set_params(**params)
        if not same_unknowns(before, self.full_manifold):
            self.reset()
        return self

    @property
    def full_manifold(self) -> Manifold:
        """Response of all sensors at all frequencies."""
        return self.measurement.manifold(self.reference)

    @property
    def n_slots(self) -> int:
        """Largest number of components."""
        n_sensors = self.full_manifold.n_sensors
        return min(n_sensors, self.solver.max_components or n_sensors)

    @property
    def n_moments(self) -> int:
        """Number of moments of the angles' densities that are kept between steps: 0."""
        return 0

    def predict(self, u: ArrayLike | None = None, *, dt: float = 1.0) -> None:
        """Report no direction: there is no prediction of the next step."""
        no_control(u)
        self.predict_batch([self], dt)
        self.report_prior()

    def update(self, z: ArrayLike | None) -> None:
        """Fit one measurement, of the model's `shape`; sensors with NaN are left out."""
        observed = self.observe(z)
        if observed is None:
            return
        prior = self.component_prior(observed)  # None in VALSE
        posterior = self.solver.solve(observed.snapshots, observed.manifold, prior)  # (30)-(59)
        self.store(posterior, observed)  # noise per bin

    def step_batch(self, trackers: Sequence[Self], step: Sequence[Any], dt: float) -> None:
        """Predict and update copies of this tracker, those with the same sensors in one call."""
        self.predict_batch(trackers, dt)
        groups: dict[bytes, list[tuple[Self, ObservedSnapshots]]] = {}
        for tracker, z in zip(trackers, step, strict=True):
            observed = tracker.observe(z)
            if observed is None:
                tracker.report_prior()
            else:
                groups.setdefault(observed.key, []).append((tracker, observed))
        for group in groups.values():
            posteriors = self.solver.solve_batch(
                [observed.snapshots for _, observed in group],
                group[0][1].manifold,
                [tracker.component_prior(observed) for tracker, observed in group],
            )
            updated = self.updated_modes([tracker for tracker, _ in group], posteriors)
            for (tracker, observed), posterior in zip(group, updated, strict=True):
                tracker.store(posterior, observed)

    def predict_batch(self, trackers: Sequence[Self], dt: float) -> None:
        """Predict the beliefs of copies of this tracker: there are none."""
        time_step(dt)

    def report_prior(self) -> None:
        """Report the expected directions before a measurement: none."""
        self.report_none()

    def observe(self, z: ArrayLike | None) -> ObservedSnapshots | None:
        """Return the valid data of a measurement; None if it is missing."""
        return self.measurement.observe(z, self.reference)

    def component_prior(self, observed: ObservedSnapshots) -> ComponentPrior | None:
        """Return the prior of the components: None in VALSE."""
        return None

    def updated_modes(
        self, trackers: Sequence[Self], posteriors: Sequence[ComponentPosterior]
    ) -> Sequence[ComponentPosterior]:
        """Return posteriors with updated modes of the motion: unchanged in VALSE."""
        return posteriors

    def store(self, posterior: ComponentPosterior, observed: ObservedSnapshots) -> None:
        """Report the active components, and keep the noise of each bin."""
        self.bin_noise = merge_noise(self.bin_noise, observed.bins, posterior.bin_noise)
        manifold = observed.manifold
        self.report_posterior(posterior, manifold, detected(manifold, posterior))

    def report_posterior(
        self,
        posterior: ComponentPosterior,
        manifold: Manifold,
        active: Bool,
        label: Int | None = None,
    ) -> None:
        """Report the active components of a posterior as directions."""
        theta, n = posterior.theta[active], int(np.count_nonzero(active))
        curved = None if posterior.curved is None else posterior.curved[active]
        estimate = self.estimate_kind(
            **located(manifold, theta, spread_of(posterior)[active], curved),
            existence=existence_of(posterior)[active],
            amplitude=amplitudes(manifold, posterior.amplitude[active], theta),
            label=np.full(n, -1) if label is None else label,
            converged=posterior.converged,
            iterations=posterior.iterations,
            noise=posterior.noise,
        )
        self.report_estimate(estimate)


def selected_solver(
    solver: Solver, engine: Engine | None = None, posterior: PosteriorName | None = None
) -> Solver:
    """Return the solver, converted to the kind that `engine` names, with that posterior.

    Examples
    --------
    >>> selected_solver(NewtonSolver(max_iterations=9), "coordinate").max_iterations
    9
    """
    if not hasattr(solver, "solve_batch"):
        raise TypeError(f"solver must be a NewtonSolver or a CoordinateSolver; got {shown(solver)}")
    if engine is not None:
        one_of("engine", engine, ("newton", "fast", "coordinate"))
        settings = instance("solver", solver, SolverSettings)
        coordinate = engine == "coordinate"
        solver = (
            settings.converted(CoordinateSolver) if coordinate else settings.converted(NewtonSolver)
        )
    if posterior is None:
        return solver
    if not isinstance(solver, CoordinateSolver):
        raise ValueError(
            f"posterior must be None without coordinate ascent; got {shown(posterior)}: "
            'pass engine="coordinate"'
        )
    return solver.replace(posterior=posterior)
