"""Coordinate ascent on the ELBO of a line spectrum: the loop of VALSE and of SVALSE's update.

Support, variances and angles are improved in turn until the reconstruction no longer changes.
Equation numbers are those of Park, Meyer and Gerstoft, JASA 153(1), 2023.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, Self

from arrivals.measurement_models.manifolds.manifold import (
    AngleManifold,
    Manifold,
    angle_manifold,
)
from arrivals.trackers.svalse.components import (
    ComponentPosterior,
    ComponentPrior,
    SolverSettings,
    no_components,
)
from arrivals.trackers.svalse.coordinate.multi_snapshot import MultiSnapshotAscent
from arrivals.trackers.svalse.coordinate.single_snapshot import SingleSnapshotAscent
from arrivals.typing import Complex
from arrivals.validation import number, one_of

PosteriorName = Literal["quadrature", "mixture"]


@dataclass(frozen=True)
class CoordinateSolver(SolverSettings):
    """Coordinate ascent on the ELBO, one angle after the other: the method of the papers.

    Parameters
    ----------
    tolerance : float
        Relative change of the reconstruction at which the iteration stops; the paper's is 1e-6.
    max_iterations : int
        Largest number of iterations of a step; one that needs more is reported as not converged.
    max_components : int, optional
        Largest number of components; that of the sensors if None.
    merge : float, optional
        Distance, rad of direction, below which the later of two active components is removed; 0
        for never. None is 1.5 degrees for tracked components (SVALSE) and 0 for independent
        snapshots (VALSE).
    snr_db : float, optional
        Signal-to-noise ratio from which the noise starts in every step. None is 20, or the noise
        of the previous step if a step has several snapshots; for one snapshot of a line without a
        prior (VALSE) it is estimated from the lags.
    tempering : float
        Number of snapshots that count as one, at least 1.
    power_floor : float, optional
        Smallest power of a source, in units of the noise of one snapshot after beamforming. None
        is 0 for one snapshot a step and 3 for several.
    max_snr_db : float, optional
        Signal-to-noise ratio that bounds the noise from below: model errors count as noise.
    posterior : {"quadrature", "mixture"}
        Integration of the densities of the angles; "mixture" is the papers' Heuristic 1.
    descending : bool, optional
        Order of the mixture's factors. None is descending without a prior (VALSE) and ascending
        with one (SVALSE).
    first_existence : float, optional
        Probability, in (0, 1), of every component in a step without tracked ones; the paper has
        0.5 in the first step (section VI.B). None is that of its program: half as many components
        as sensors, rounded down, and then estimated.

    Examples
    --------
    >>> CoordinateSolver.paper().posterior
    'mixture'
    """

    posterior: PosteriorName = "quadrature"
    descending: bool | None = None
    first_existence: float | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        one_of("posterior", self.posterior, ("quadrature", "mixture"))
        one_of("descending", self.descending, (None, True, False))
        if (
            self.first_existence is not None
            and not 0 < number("first_existence", self.first_existence) < 1
        ):
            raise ValueError(f"first_existence must lie in (0, 1); got {self.first_existence}")

    @classmethod
    def paper(cls, first_existence: float | None = None) -> Self:
        """Return the solver of the published programs of SVALSE and VALSE.

        Parameters
        ----------
        first_existence : float, optional
            As in the class: 0.5 as the paper prints it, None as its program has it.

        Returns
        -------
        CoordinateSolver
            A tracker in the paper's form has `reference="first"`, and SVALSE the motion
            `BernoulliVonMises()`.

        Examples
        --------
        >>> CoordinateSolver.paper().replace(posterior="quadrature").tolerance
        1e-06
        """
        return cls(
            posterior="mixture",
            tolerance=1e-6,
            max_iterations=5000,
            first_existence=first_existence,
        )

    def check(self, manifold: Manifold, n_snapshots: int, n_moments: int) -> None:
        """Raise ValueError if the solver does not support such measurements."""
        manifold = angle_manifold("CoordinateSolver", manifold)
        if self.posterior == "quadrature":
            return
        n_bins = len(manifold.nuisance_weights)
        needs = (
            ('memory="von_mises"', n_moments == 0, 'memory="posterior"'),
            ("a line on a uniform grid, at one wavelength", manifold.coefficients is None,
             type(manifold).__name__),
            ("one snapshot a step", max(n_snapshots, n_bins) == 1,
             f"{n_snapshots} at {n_bins} wavelengths"),
        )  # fmt: skip
        for required, is_met, got in needs:
            if not is_met:
                raise ValueError(
                    f'posterior="mixture" requires {required}; got {got}: the general form is '
                    'posterior="quadrature"'
                )

    def solve(
        self, snapshots: Complex, manifold: Manifold, prior: ComponentPrior | None
    ) -> ComponentPosterior:
        """Fit the snapshots of one step (sections III and IV, Fig. 3).

        Parameters
        ----------
        snapshots : ndarray, shape (n_bins, n_sensors, n_snapshots)
        manifold : Manifold
            Of one angle.
        prior : ComponentPrior or None
            None in VALSE.
        """
        if not snapshots.any():
            return no_components(manifold)
        angle = angle_manifold("CoordinateSolver", manifold)
        state = self.initial_state(snapshots, angle, prior)
        merge, limit = self.merge_distance(prior is not None), self.max_iterations
        x, converged = state.initialize(), False  # (66)-(68)
        while not converged and state.iterations < limit and not state.is_cycling(limit):
            state.iterations += 1
            state.choose_support()  # ŝ, ŵ, Ĉ   (49)-(56)
            state.update_variances()  # ν, τ   (58), (59)
            state.update_rho()  # ρ, if no component is tracked
            state.update_angles()  # q(θ)   (32), (33), and (38)-(48) or quadrature
            state.merge(merge)
            x_old, x = x, state.reconstruction()
            converged = state.has_converged(x, x_old)
        return state.result(converged)

    def solve_batch(
        self,
        snapshots: Sequence[Complex],
        manifold: Manifold,
        priors: Sequence[ComponentPrior | None],
    ) -> list[ComponentPosterior]:
        """Fit independent snapshots of one array, one after the other."""
        return [self.solve(Y, manifold, prior) for Y, prior in zip(snapshots, priors, strict=True)]

    def initial_state(
        self, snapshots: Complex, manifold: AngleManifold, prior: ComponentPrior | None
    ) -> MultiSnapshotAscent:
        """Return the state of a step, in the fast form for one snapshot of a line if it applies."""
        single = SingleSnapshotAscent.applies(self, snapshots, manifold, prior)
        kind = SingleSnapshotAscent if single else MultiSnapshotAscent
        return kind(self, snapshots, manifold, prior)
