"""Batches of trials of one source, and the directions of each method, in degrees."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np

from arrivals.measurement_models import ArraySamples, FlatBand
from arrivals.measurement_models.delays.source_correlation import SourceCorrelation
from arrivals.motion_models import MotionModel
from arrivals.scenarios.bounds.delay import band_bound, tone_bound
from arrivals.scenarios.reproduce.interpolation.beamformers import Method, scan
from arrivals.scenarios.simulations.sampled_source import (
    InterpolationBand,
    InterpolationCoupled,
    InterpolationScenario,
    InterpolationTone,
)
from arrivals.trackers.interpolation import VARIANTS, InterpolationEKF
from arrivals.typing import Float

SOURCES: dict[str, InterpolationScenario] = {
    "tone": InterpolationTone(),
    "band": InterpolationBand(),
    "qpc": InterpolationCoupled(),
}
PAPER_FORMS = ("literal", "frozen", "B")  # two taps and the paper's correlation
FORMS = VARIANTS | {
    "frozen": VARIANTS["literal"].replace(sequential_update="frozen")  # with the index of (4)
}
FILTERS = ("literal", "frozen", "B", "Bw", "C", "D", "E", "E2", "phasor")


@cache
def draws(scenario: InterpolationScenario, runs: int, seed: int) -> Float:
    """Return the samples of independent trials, (runs, n_steps, n_sensors)."""
    children = np.random.SeedSequence(seed).spawn(runs)
    samples = [scenario.sample(np.random.default_rng(child)).measurements for child in children]
    array = np.array(samples).real
    array.setflags(write=False)
    return array


def tracker(
    measurement: ArraySamples, method: str, start_deg: float, n_steps: int, **params: Any
) -> InterpolationEKF:
    """Make a filter of the studies, with a fourth of the record to acquire.

    The paper's correlation is that of a flat band, also for tones. The joint filter "E" starts
    within the main lobe, with a standard deviation of 0.08 in the sine.
    """
    if method == "E":
        params = {"std": 0.08 / np.cos(np.deg2rad(start_deg))} | params
    source: SourceCorrelation = measurement.correlation
    if method in (*PAPER_FORMS, "Bw") and source.order is not None and source.order > 2:
        lowest = float(np.min(source.frequencies))  # type: ignore[attr-defined]  # tones
        measurement = measurement.replace(correlation=FlatBand(lowest, source.highest))
    plain = {name: params.pop(name) for name in ("motion", "std") if name in params}
    made = InterpolationEKF(
        measurement,
        variant=FORMS[method].replace(extrapolate=True),
        doa=np.deg2rad(start_deg),
        acquisition=max(12, n_steps // 4),
        gate=None if method in PAPER_FORMS else 5.0,  # the paper has no gate
        **plain,
    )
    return made.set_params(**params)


def filter_directions(
    scenario: InterpolationScenario, samples: Float, method: str, start_deg: float, **params: Any
) -> Float:
    """Return the directions after every snapshot, degrees, (runs, n_steps)."""
    made = tracker(scenario.measurement, method, start_deg, scenario.n_steps, **params)
    x, _ = made.trajectory(samples)
    return np.rad2deg(scenario.measurement.doa(x[..., 0]))


def scan_records(
    scenario: InterpolationScenario, samples: Float, method: Method, **params: Any
) -> Float:
    """Return the directions from whole records, degrees, (runs,)."""
    model = scenario.measurement
    return np.rad2deg([scan(record, model, method, **params) for record in samples])


def final_directions(
    scenario: InterpolationScenario, runs: int, seed: int, method: str, start_deg: float
) -> Float:
    """Return the final directions of a filter or a scan, degrees, (runs,)."""
    samples = draws(scenario, runs, seed)
    if method in FILTERS:
        return filter_directions(scenario, samples, method, start_deg)[:, -1]
    kind: Method = "mvdr" if method.startswith("mvdr") else "conventional"
    return scan_records(scenario, samples, kind, refine=not method.endswith("grid"))


def bound_deg(scenario: InterpolationScenario) -> float:
    """Return the Cramér-Rao bound of a static source, a standard deviation, degrees."""
    model, doa = scenario.measurement, np.deg2rad(scenario.doa_deg)
    bound = band_bound if isinstance(model.correlation, FlatBand) else tone_bound
    return float(np.rad2deg(bound(model, doa, scenario.n_steps)))


def rms(error: Float) -> float:
    """Return the root of the mean square.

    Examples
    --------
    >>> rms(np.array([3.0, -3.0]))
    3.0
    """
    return float(np.sqrt(np.mean(np.square(error))))


def smooth(x: Float, P: Float, motion: MotionModel) -> Float:
    """Return the means of the Rauch-Tung-Striebel smoother of a linear motion.

    Parameters
    ----------
    x, P : ndarray, shape (..., n_steps, dim_x), (..., n_steps, dim_x, dim_x)
        Posterior means and covariances of a filter.
    motion : MotionModel
        A linear motion model.
    """
    F, Q = motion.F(np.zeros(motion.dim_x)), motion.Q()
    means = x.copy()
    for k in range(x.shape[-2] - 2, -1, -1):
        predicted = F @ P[..., k, :, :] @ F.T + Q
        gain = np.swapaxes(np.linalg.solve(predicted, F @ P[..., k, :, :]), -1, -2)
        ahead = means[..., k + 1, :] - (F @ x[..., k, :, None])[..., 0]
        means[..., k, :] = x[..., k, :] + (gain @ ahead[..., None])[..., 0]
    return means


def moving_errors(
    scenario: InterpolationScenario,
    samples: Float,
    method: str,
    motion: MotionModel,
    span: slice,
    **params: Any,
) -> tuple[float, float]:
    """Return the RMSE of all trials, as those of `moving_runs`."""
    each = moving_runs(scenario, samples, method, motion, span, **params)
    return rms(each[0]), rms(each[1])


def moving_runs(
    scenario: InterpolationScenario,
    samples: Float,
    method: str,
    motion: MotionModel,
    span: slice,
    **params: Any,
) -> tuple[Float, Float]:
    """Return the RMSE over snapshots of `span`, degrees, of a filter and of its smoother, (runs,).

    Estimates are compared with the truth of their own snapshot, `latency` ago. "E" is not smoothed
    (NaN): its shifted delay line has a singular covariance.
    """
    model, truth = scenario.measurement, np.rad2deg(scenario.truth()[:, 0])
    made = tracker(model, method, scenario.doa_deg, scenario.n_steps, motion=motion, **params)
    x, P = made.trajectory(samples)
    latency = made.latency

    def error(states: Float) -> Float:
        doa = np.rad2deg(model.doa(states[:, latency:, 0]))
        e = (doa - truth[: len(truth) - latency])[:, span]
        return np.asarray(np.sqrt(np.mean(e**2, axis=1)))

    if method in ("E", "E2"):
        return error(x), np.full(len(x), np.nan)
    return error(x), error(smooth(x, P, made.state_motion))
