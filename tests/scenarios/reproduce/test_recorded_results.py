"""Agreement with the recorded per-step results of the published program (section 12.5).

The recordings do not ship. Run by hand: ARRIVALS_DATA=FOLDER python -m pytest
tests/scenarios/reproduce/test_recorded_results.py; FOLDER has svalse/fig4_001.npz and fig6_001.npz.
"""

import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from arrivals.measurement_models import AngleManifold, ArraySnapshot, SensorArray
from arrivals.motion_models import BernoulliVonMises
from arrivals.trackers import SBL, SSBL, SVALSE
from arrivals.trackers.svalse.components import ComponentPrior
from arrivals.trackers.svalse.coordinate.single_snapshot import SingleSnapshotAscent
from arrivals.trackers.svalse.coordinate.solver import CoordinateSolver
from arrivals.typing import Complex, Float, Int

FOLDER = os.environ.get("ARRIVALS_DATA")
pytestmark = pytest.mark.skipif(FOLDER is None, reason="ARRIVALS_DATA does not name the folder")

# e^{-jmπ sin β}: the recorded line has its sensors in reverse order
LINE = ArraySnapshot(SensorArray(-0.5 * np.arange(15.0)), wavelength=1.0)


class PublishedAscent(SingleSnapshotAscent):
    """With the error of the published program: columns of C by running number (section 10, 1)."""

    def covariances(self, on: Int) -> Complex:
        """Return columns 0, 1... of C in place of those of the active components."""
        C: Complex = self.C[0][np.ix_(on, np.arange(len(on)))]
        np.fill_diagonal(C, 0)
        return C


REPLAYED: dict[str, Any] = {  # also of the first step, which has no prior
    "tolerance": 1e-6, "max_iterations": 5000, "merge": np.deg2rad(1.5), "snr_db": 20.0,
    "descending": False,
}  # fmt: skip


class PublishedProgram(CoordinateSolver):
    """The published program: the paper's settings, and its error."""

    def initial_state(
        self, snapshots: Complex, manifold: AngleManifold, prior: ComponentPrior | None
    ) -> SingleSnapshotAscent:
        """Return the solver state with the error."""
        return PublishedAscent(self, snapshots, manifold, prior)


def replayed(name: str, n_steps: int, engine: CoordinateSolver) -> tuple[Float, Int, Any]:
    """Return the largest deviation of each step, degrees, from the recorded prior; iterations."""
    z = np.load(Path(FOLDER or "") / "svalse" / f"{name}.npz")
    manifold = LINE.angle_manifold("first")
    worst, iterations = [], []
    for t in range(n_steps):
        known = None
        if t > 0:
            mu, kappa = z["svalse_carried_mu"][t - 1], z["svalse_carried_kappa"][t - 1]
            carried = ~np.isnan(mu)
            active = np.arange(carried.sum()) < z["svalse_K"][t - 1]
            widened = 1 / (1 / 148 + 1 / kappa[carried])  # (63), the large-κ limit
            known = ComponentPrior(-mu[carried], widened, np.where(active, 0.75, 0.1), 0.1)
        fit = engine.solve(z["y"].T[t][None, :, None], manifold, known)
        result = np.sort(np.rad2deg(manifold.to_doa(fit.theta[fit.active], slack=np.inf)))
        recorded = np.sort(z["svalse_doa_deg"][t][: z["svalse_K"][t]])
        assert len(result) == len(recorded)
        worst.append(np.abs(result - recorded).max())
        iterations.append(fit.iterations)
    return np.array(worst), np.array(iterations), z["svalse_iterations"][:n_steps] - 1


@pytest.mark.parametrize(
    ("name", "n_steps", "worst"), [("fig4_001", 24, 0.01), ("fig6_001", 30, 0.001)]
)
def test_heuristic_1_with_the_error_matches_the_program(
    name: str, n_steps: int, worst: float
) -> None:
    engine = PublishedProgram(posterior="mixture", **REPLAYED)
    off, iterations, recorded = replayed(name, n_steps, engine)
    assert off.max() < worst
    assert np.abs(iterations - recorded).max() <= 3


@pytest.mark.parametrize(
    ("name", "n_steps", "shares"), [("fig4_001", 24, (0.70, 0.95)), ("fig6_001", 30, (0.83, 1.0))]
)
def test_heuristic_1_without_the_error_is_close_to_the_program(
    name: str, n_steps: int, shares: tuple[float, float]
) -> None:
    engine = CoordinateSolver(posterior="mixture", **REPLAYED)
    off, _, _ = replayed(name, n_steps, engine)
    assert (off < 0.01).mean() >= shares[0]
    assert (off < 0.5).mean() >= shares[1]


@pytest.mark.parametrize(
    ("name", "n_steps", "shares", "median"),
    [("fig4_001", 24, (0.37, 0.79), 0.15), ("fig6_001", 30, (0.5, 0.99), 0.10)],
)
def test_direct_quadrature_is_close_to_the_program(
    name: str, n_steps: int, shares: tuple[float, float], median: float
) -> None:
    engine = CoordinateSolver(**REPLAYED)
    off, _, _ = replayed(name, n_steps, engine)
    assert (off < 0.1).mean() >= shares[0]
    assert (off < 0.5).mean() >= shares[1]
    assert np.median(off) == pytest.approx(median, abs=0.01)


@pytest.mark.parametrize("name", ["fig4_001", "fig6_001"])
def test_free_running_mixture_keeps_the_recorded_number_of_sources(name: str) -> None:
    """The tracker itself, in the paper's form, without the error: K as recorded in most steps."""
    z = np.load(Path(FOLDER or "") / "svalse" / f"{name}.npz")
    tracker = SVALSE(
        LINE,
        BernoulliVonMises(),
        solver=CoordinateSolver.paper(),
        reference="first",
    )
    run = tracker.run(z["y"].T)
    assert (run.n_found == z["svalse_K"]).mean() >= 0.85


@pytest.mark.parametrize("name", ["fig4_001", "fig6_001"])
@pytest.mark.parametrize(("method", "kind"), [("sbl", SBL), ("ssbl", SSBL)])
def test_free_running_sbl_matches_the_program(name: str, method: str, kind: type[SBL]) -> None:
    z = np.load(Path(FOLDER or "") / "svalse" / f"{name}.npz")
    tracker = kind(LINE)
    for t, y in enumerate(z["y"].T):
        tracker.predict()
        tracker.update(y)
        recorded, gamma = z[f"{method}_doa_deg"][t], z[f"{method}_gamma"][:, t]
        np.testing.assert_allclose(
            np.rad2deg(tracker.estimate.doa), recorded[~np.isnan(recorded)], atol=1e-9
        )
        np.testing.assert_allclose(tracker.gamma, gamma, atol=1e-6 * gamma.max())
        if tracker.estimate.converged:  # else the program returns the last σ² with the best γ
            assert tracker.noise == pytest.approx(z[f"{method}_sigma2"][t], rel=1e-6)
        assert tracker.estimate.iterations == z[f"{method}_iterations"][t]
