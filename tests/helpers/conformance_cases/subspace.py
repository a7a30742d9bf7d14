"""The subspace methods, and mvdr of several bins, for `test_conformance`."""

from typing import Any

import numpy as np

from arrivals.measurement_models import ArraySnapshot, SensorArray
from arrivals.measurement_models.arrays.sphere import fibonacci_sphere
from arrivals.trackers import ESPRIT, MUSIC, MVDR, PAST, RootMUSIC
from arrivals.trackers.conformance import MakeTracker, Measurements

LINE = ArraySnapshot(SensorArray.ula(6, spacing=0.5), wavelength=1.0, noise=1e-3)
GAPS = ArraySnapshot(SensorArray.ula(8, 0.4, missing=[2]), wavelength=1.0, noise=1e-3)
CIRCLE = ArraySnapshot(SensorArray.uca(7, radius=0.5), wavelength=1.0, noise=1e-3)
LINE_BLOCK = LINE.replace(wavelength=[1.0, 1.3, 0.8], n_snapshots=3)  # one beyond the alias limit
CIRCLE_BLOCK = ArraySnapshot(
    CIRCLE.array, [1.0, 1.4], 1e-3, n_snapshots=2, elevation=[0.0, 0.5], noise_coherence="diffuse"
)
SPHERE = CIRCLE.replace(unknowns="sphere")
SPACE = ArraySnapshot(
    SensorArray(0.4 * fibonacci_sphere(8)), [1.0, 1.3], 1e-3, n_snapshots=2, unknowns="sphere"
)


def two_sources(model: ArraySnapshot, n_steps: int = 12) -> Measurements:
    """Return snapshots of two sources; one sensor fails once, the last snapshot is zero."""
    rng = np.random.default_rng(5)
    phases = np.exp(2j * np.pi * rng.random((n_steps, *model.shape[:-1], 2)))
    elevation = np.full((n_steps, 2), [0.3, 0.9]) if model.unknowns == "sphere" else None
    z = model.simulate(np.full((n_steps, 2), [0.5, -0.4]), phases, rng, elevation)
    z[1, ..., 3] = np.nan
    z[-1] = 0.0
    return z


def case(name: str, kind: Any, model: ArraySnapshot, n_steps: int = 12, **params: Any) -> Any:
    return name, lambda: kind(model, **params), two_sources(model, n_steps)


TRACKERS: list[tuple[str, MakeTracker, Measurements]] = [
    case("music", MUSIC, LINE, n_directions=91),
    case("music", MUSIC, CIRCLE, n_sources="aic", max_sources=2, n_directions=90),
    case("music", MUSIC, LINE, n_sources=2, smoothing=4, backward=True, interval=3),
    case("root_music", RootMUSIC, GAPS, n_sources=2),
    case("esprit", ESPRIT, GAPS, forgetting=1.0, interval=2),
    case("past", PAST, GAPS, n_sources=2),
    case("past", PAST, LINE, max_sources=4, interval=2),
    case("past", PAST, CIRCLE, n_sources=2, method="music", n_directions=90),
    case("music", MUSIC, CIRCLE_BLOCK, n_directions=90),
    case("mvdr", MVDR, CIRCLE_BLOCK, n_directions=90),
    case("root_music", RootMUSIC, LINE_BLOCK, n_sources=2),
    case("esprit", ESPRIT, LINE_BLOCK, n_sources="aic", max_sources=2),
    case("past", PAST, LINE_BLOCK, max_sources=3, interval=2),
    case("music", MUSIC, SPHERE, n_directions=500, interval=2),
    case("music", MUSIC, SPACE, n_sources=2, n_directions=500),
    case("mvdr", MVDR, SPHERE, n_steps=5, n_directions=500),
    case("mvdr", MVDR, SPACE, n_steps=5, n_directions=500, max_sources=2),
]
