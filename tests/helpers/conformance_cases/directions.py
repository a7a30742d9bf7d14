"""Beamforming, SBL, (S)VALSE and peaks_gnn, for `test_conformance`."""

import numpy as np

from arrivals.measurement_models import ArraySnapshot, ElementResponse, SensorArray
from arrivals.measurement_models.arrays.sphere import fibonacci_sphere
from arrivals.motion_models import BernoulliVonMises
from arrivals.trackers import (
    CBF,
    SBL,
    SSBL,
    SVALSE,
    VALSE,
    CoordinateSolver,
    MixtureSettings,
    NewtonSolver,
    PeaksGNN,
    WidebandMixture,
)
from arrivals.trackers.conformance import MakeTracker, Measurements

LINE = ArraySnapshot(SensorArray.ula(9, spacing=0.5), wavelength=1.0, noise=1e-3)
CIRCLE = ArraySnapshot(SensorArray.uca(7, radius=0.5), wavelength=1.0, noise=1e-3)
WIDEBAND = CIRCLE.replace(wavelength=[1.0, 1.4], n_snapshots=2)
SLOWNESS = WIDEBAND.replace(
    slowness=[0.9, 1.0, 1.1], response=ElementResponse.first_order([0.3] * 7)
)
MANY_BINS = CIRCLE.replace(wavelength=list(np.linspace(1.0, 3.0, 24)), n_snapshots=6)
MANY_BINS_OF_A_LINE = LINE.replace(wavelength=list(np.linspace(1.0, 2.0, 16)), n_snapshots=4)
DIFFUSE = WIDEBAND.replace(noise_coherence="diffuse")
LINE_DIFFUSE = LINE.replace(noise_coherence="diffuse", white=0.3)
SPHERE = CIRCLE.replace(unknowns="sphere")
SPACE = ArraySnapshot(
    SensorArray(0.7 * fibonacci_sphere(12)), [1.0, 1.3], 1e-3, n_snapshots=2, unknowns="sphere"
)
RANGE = LINE.replace(unknowns="range")
RANGE_BLOCK = LINE.replace(wavelength=[1.0, 1.3], n_snapshots=2, unknowns="range")
NEAR = LINE.replace(unknowns="range", nearest=2.0)
GAPS = ArraySnapshot(SensorArray.ula(10, 0.4, missing=[2]), wavelength=1.0, noise=1e-3)


def two_sources(model: ArraySnapshot, n_steps: int = 4) -> Measurements:
    """Return snapshots of two sources: the second starts late, a sensor fails, the end is zero."""
    on = np.arange(n_steps) > 0
    doa = np.stack([0.5 + 0.02 * np.arange(n_steps), np.where(on, -0.4, np.nan)], axis=-1)
    elevation = np.array([0.1, 1.0]) + 0 * doa if model.unknowns == "sphere" else None
    distance = np.array([3.0, np.inf]) + 0 * doa if model.unknowns == "range" else None
    z = model.simulate(doa, [1.0, 0.8j], np.random.default_rng(5), elevation, distance)
    z[1, ..., 3] = np.nan
    z[-1] = 0.0
    return z


def talkers(model: ArraySnapshot, n_steps: int = 5) -> Measurements:
    """Return bins of two sources of few bins each: the second starts late, a sensor fails."""
    rng = np.random.default_rng(5)
    doa = np.stack([np.full(n_steps, 0.5), np.where(np.arange(n_steps) > 0, -0.4, np.nan)], axis=-1)
    level = rng.exponential(size=(n_steps, *model.shape[:-1], 2)) ** 4
    elevation = np.array([0.1, 1.0]) + 0 * doa if model.unknowns == "sphere" else None
    z = model.simulate(doa, level, rng, elevation)
    z[1, ..., 3] = np.nan
    z[-1] = 0.0
    return z


TRACKERS: list[tuple[str, MakeTracker, Measurements]] = [
    ("cbf", lambda: CBF(LINE, n_directions=91), two_sources(LINE)),
    ("cbf", lambda: CBF(CIRCLE, n_directions=90, max_sources=2), two_sources(CIRCLE)),
    ("valse", lambda: VALSE(GAPS, solver=NewtonSolver(max_components=3)), two_sources(GAPS)),
    ("sbl", lambda: SBL(CIRCLE, n_directions=90, max_sources=2), two_sources(CIRCLE)),
    ("ssbl", lambda: SSBL(GAPS, n_directions=91, n_neighbours=1), two_sources(GAPS)),
    ("peaks_gnn", lambda: PeaksGNN(CIRCLE, detector="mvdr", confirm_steps=1), two_sources(CIRCLE)),
    ("peaks_gnn", lambda: PeaksGNN(LINE, detector=CBF(LINE, threshold_db=6.0)), two_sources(LINE)),
    ("valse", lambda: VALSE(LINE, engine="coordinate"), two_sources(LINE)),
    ("svalse", lambda: SVALSE(GAPS, BernoulliVonMises(kappa=50.0)), two_sources(GAPS)),
    ("svalse", lambda: SVALSE(GAPS, engine="coordinate"), two_sources(GAPS)),
    (
        "svalse",
        lambda: SVALSE(
            LINE,
            solver=CoordinateSolver(posterior="mixture", tolerance=1e-6),
            reference="first",
        ),
        two_sources(LINE, n_steps=3),
    ),
    ("sbl", lambda: SBL(WIDEBAND, n_directions=90, max_sources=3), two_sources(WIDEBAND)),
    ("ssbl", lambda: SSBL(WIDEBAND, n_directions=90, n_neighbours=1), two_sources(WIDEBAND)),
    ("cbf", lambda: CBF(SLOWNESS, n_directions=90), two_sources(SLOWNESS)),
    (
        "valse",
        lambda: VALSE(WIDEBAND, solver=NewtonSolver(tempering=2.0, max_snr_db=25.0)),
        two_sources(WIDEBAND),
    ),
    (
        "svalse",
        lambda: SVALSE(SLOWNESS, BernoulliVonMises(sigma_doa=0.05), memory="posterior"),
        two_sources(SLOWNESS),
    ),
    ("wideband_mixture", lambda: WidebandMixture(MANY_BINS), talkers(MANY_BINS)),
    (
        "wideband_mixture",
        lambda: WidebandMixture(
            MANY_BINS_OF_A_LINE.replace(slowness=[0.9, 1.0, 1.1]),
            BernoulliVonMises(sigma_doa=0.2, p_activate=0.2, p_deactivate=0.2),
            settings=MixtureSettings(tempering=10.0, max_sources=2),
            step_duration=0.064,
        ),
        talkers(MANY_BINS_OF_A_LINE),
    ),
    ("cbf", lambda: CBF(DIFFUSE, n_directions=90), two_sources(DIFFUSE)),
    ("cbf", lambda: CBF(LINE_DIFFUSE, n_directions=91), two_sources(LINE_DIFFUSE)),
    ("svalse", lambda: SVALSE(DIFFUSE, BernoulliVonMises(kappa=50.0)), two_sources(DIFFUSE)),
    ("valse", lambda: VALSE(LINE_DIFFUSE), two_sources(LINE_DIFFUSE)),
    ("cbf", lambda: CBF(SPHERE, n_directions=500, max_sources=3), two_sources(SPHERE)),
    (
        "peaks_gnn",
        lambda: PeaksGNN(
            SPHERE, detector=CBF(SPHERE, n_directions=500, max_sources=3), confirm_steps=1
        ),
        two_sources(SPHERE),
    ),
    (
        "peaks_gnn",
        lambda: PeaksGNN(SPACE, detector=CBF(SPACE, n_directions=500, threshold_db=6.0)),
        two_sources(SPACE),
    ),
    (
        "wideband_mixture",
        lambda: WidebandMixture(
            MANY_BINS.replace(unknowns="sphere"),
            settings=MixtureSettings(sphere_step=np.deg2rad(8.0)),
        ),
        talkers(MANY_BINS.replace(unknowns="sphere")),
    ),
    ("cbf", lambda: CBF(SPACE, n_directions=500, max_sources=3), two_sources(SPACE)),
    ("svalse", lambda: SVALSE(SPHERE), two_sources(SPHERE)),
    ("svalse", lambda: SVALSE(SPACE, BernoulliVonMises(kappa=50.0)), two_sources(SPACE)),
    ("svalse", lambda: SVALSE(RANGE), two_sources(RANGE)),
    ("svalse", lambda: SVALSE(NEAR), two_sources(NEAR)),
    ("valse", lambda: VALSE(SPHERE), two_sources(SPHERE)),
    ("valse", lambda: VALSE(SPACE), two_sources(SPACE)),
    ("valse", lambda: VALSE(RANGE_BLOCK), two_sources(RANGE_BLOCK)),
    ("valse", lambda: VALSE(NEAR), two_sources(NEAR)),
]
