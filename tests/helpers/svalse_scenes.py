"""Scenes and trackers' forms of the tests of SVALSE and VALSE."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models import ArraySnapshot, ElementResponse, SensorArray
from arrivals.motion_models import BernoulliVonMises
from arrivals.scenarios import Trial, create, mean_gospa
from arrivals.trackers import CoordinateSolver, Run
from arrivals.typing import Complex, Float

LINE = ArraySnapshot(SensorArray.ula(15, spacing=0.5), wavelength=1.0)
PAPER: dict[str, Any] = {
    "solver": CoordinateSolver(tolerance=1e-6, max_iterations=5000),
    "reference": "first",
}
COORDINATE: dict[str, Any] = {"engine": "coordinate"}
MIXTURE: dict[str, Any] = {"solver": CoordinateSolver(posterior="mixture")}


def short(seed: int = 0, n_steps: int = 4, name: str = "svalse_fig4") -> Trial:
    return create(name, n_steps=n_steps).sample(np.random.default_rng(seed))


def tone(doa: ArrayLike, noise: float, seed: int = 0, model: ArraySnapshot = LINE) -> Complex:
    """Snapshots (n_steps, n_sensors) of sources of amplitude 1 and random phase."""
    rng = np.random.default_rng(seed)
    doa = np.atleast_2d(np.asarray(doa, dtype=float))
    phase = np.exp(2j * np.pi * rng.random(doa.shape))
    return model.replace(noise=noise).simulate(doa, phase, rng)


def gospa_deg(trial: Trial, run: Run) -> float:
    return mean_gospa(np.rad2deg(trial.truth), np.rad2deg(run.doa), c=10.0).total


CIRCLE = ArraySnapshot(SensorArray.uca(8, radius=0.65), wavelength=1.0)
SEVERAL = CIRCLE.replace(wavelength=[1.0, 1.25, 1.6], n_snapshots=4)
FACING = 2 * np.pi * np.arange(8) / 8
OMNI = np.array([0.5, 1.0, 0.7, 1.0, 0.5, 0.5, 1.0, 1.0])
MIXED = ElementResponse.first_order(FACING, OMNI)
ELEMENTS = SEVERAL.replace(response=MIXED)  # ‖a(θ)‖² changes with the angle
SPARSE = ArraySnapshot(SensorArray(2.0 * np.arange(8.0)), [1.0, 1.1, 1.3])
LINE_SNAPSHOTS = ArraySnapshot(SensorArray.ula(15, 0.5), wavelength=1.0, n_snapshots=3)
MODELS = [CIRCLE, SEVERAL, ELEMENTS, SPARSE, LINE_SNAPSHOTS]
NAMES = ["circle", "several", "elements", "sparse line", "snapshots of a line"]
SLOW = BernoulliVonMises(sigma_doa=np.deg2rad(3.0))


def snapshots_of(model: ArraySnapshot, doa: Any, seed: int = 0, noise: float = 0.01) -> Complex:
    rng = np.random.default_rng(seed)
    doa = np.atleast_2d(np.asarray(doa, dtype=float))
    shape = (len(doa), *model.shape[:-1], doa.shape[1])
    w = np.exp(2j * np.pi * rng.random(shape)) * rng.uniform(0.7, 1.3, shape)
    return model.replace(noise=noise).simulate(doa, w, rng)


def wrapped(angle: Float) -> Float:
    return np.asarray((angle + np.pi) % (2 * np.pi) - np.pi)
