"""SVALSE on circles and sparse lines: the gain from several snapshots and from memory.

No results are published: the figures beside ours are those of the prototype from which the method
was specified, means of 4 to 6 runs.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from arrivals.motion_models import BernoulliVonMises
from arrivals.scenarios.base import Trial
from arrivals.scenarios.experiments.statistics import standard_error
from arrivals.scenarios.experiments.workers import parallel_map
from arrivals.scenarios.metrics.gospa import Gospa, mean_gospa
from arrivals.scenarios.registry import create
from arrivals.scenarios.reproduce.claims import Claim
from arrivals.scenarios.reproduce.decisions import Decision
from arrivals.scenarios.reproduce.report import Report
from arrivals.scenarios.reproduce.svalse.decisions import compared
from arrivals.scenarios.simulations.planar_arrays import Circle
from arrivals.trackers import NewtonSolver
from arrivals.trackers.run import Run
from arrivals.typing import Float

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MERGED: dict[str, Any] = {"solver": NewtonSolver(merge=np.deg2rad(1.5))}
# The whole posterior of an angle has no modes of a walk that may stand still
WHOLE = {"memory": "posterior", "motion": BernoulliVonMises(sigma_doa=np.deg2rad(2.0))}
STRICT: dict[str, Any] = {"threshold_db": 3.0}  # of the beam peaks
NAMES = {"svalse": "SVALSE", "valse": "VALSE", "cbf": "beamformer",
         "peaks_gnn": "beamformer, tracked"}  # fmt: skip


@dataclass(frozen=True)
class ArrayExperiment:
    """One row: scenario and parameters, tracker and settings, the prototype's GOSPA."""

    scenario: str
    label: str
    parameters: dict[str, Any]
    method: str
    prototype: float
    params: dict[str, Any] = field(default_factory=dict)


def _of_circle() -> list[ArrayExperiment]:
    figures = {
        ("1 snapshot", 20.0): ({}, 6.7, 12.6, 18.5),
        ("1 snapshot", 10.0): ({}, 14.0, 18.2, 19.4),
        ("10 snapshots", 20.0): ({"n_snapshots": 10}, 1.8, 2.9, 14.5),
        ("10 snapshots", 10.0): ({"n_snapshots": 10}, 4.3, 6.3, 15.2),
        ("10 bins", 20.0): ({"n_bins": 10}, 2.0, 2.7, 11.5),
        ("10 bins", 10.0): ({"n_bins": 10}, 4.8, 10.3, 12.1),
    }
    cases = []
    for (data, snr_db), (parameters, *prototype) in figures.items():
        settings: list[dict[str, Any]] = [{}, MERGED, STRICT, STRICT]
        figures_of_all = (*prototype, np.nan)
        for method, figure, params in zip(NAMES, figures_of_all, settings, strict=True):
            label, of_case = f"circle, {data}, {snr_db:g} dB", {"snr_db": snr_db} | parameters
            cases.append(ArrayExperiment("circle", label, of_case, method, figure, params))
    return cases


def _of_sparse_line() -> list[ArrayExperiment]:
    hop = {"n_bins": 10, "hopping": True}
    figures: list[tuple[str, dict[str, Any], dict[str, Any], float, float]] = [
        ("1 bin", {}, {}, 8.32, 13.83),
        ("5 bins", {"n_bins": 5}, {}, 0.08, 0.27),
        ("10 bins", {"n_bins": 10}, {}, 0.04, 0.17),
        ("hopping", hop, {}, 2.89, 12.58),
        ("hopping, whole posterior", hop, WHOLE, 2.77, 6.28),
    ]
    cases = []
    for data, parameters, params, *figure in figures:
        for n in (1, 2):
            label = f"sparse line, {n} source{'s' * (n > 1)}, {data}"
            of_case = {"n_sources": n} | parameters
            cases.append(
                ArrayExperiment("grating", label, of_case, "svalse", figure[n - 1], params)
            )
            if not params:
                cases.append(
                    ArrayExperiment("grating", label, of_case, "peaks_gnn", np.nan, STRICT)
                )
    return cases


CASES = [*_of_circle(), *_of_sparse_line()]


def any_array(runs: int, seed: int) -> Report:
    """Mean GOSPA of every case, and one run on the circle as a figure."""
    runs_of_cases = [(case, seed + n) for case in CASES for n in range(runs)]
    scores = np.array(parallel_map(_scores, runs_of_cases)).reshape(len(CASES), runs, 4)
    rows = []
    for case, parts in zip(CASES, scores, strict=True):
        error = standard_error(parts[:, 0])
        name = NAMES[case.method]
        rows.append((case.label, name, *parts.mean(axis=0).tolist(), float(error), case.prototype))
    columns = ("scene", "method", "GOSPA", "distance", "missed", "false", "std error", "prototype")
    remarks = (
        "GOSPA in degrees, wrapped, with a cut-off of 10 degrees: the sum of distance, missed "
        "and false, its parts by errors of directions, missed sources and false estimates. Std "
        "error: standard error of the mean of the runs. The prototype's figures are "
        "means of 4 to 6 runs; its beamformer has the best of several thresholds, ours has 3 dB. "
        "'beamformer, tracked' is `peaks_gnn` on the beamformer's peaks. VALSE merges components "
        "within 1.5 degrees, as SVALSE does. The sparse line has eight sensors two wavelengths "
        "apart: every source has grating lobes.",
    )
    title = f"Any array: GOSPA over {runs} runs"
    keys = [(case.label, case.method) for case in CASES]
    results = dict(zip(keys, scores[:, :, 0], strict=True))
    return Report(title, columns, rows, remarks, {"circle": _draw(seed)}, results=results,
                  captions={"circle": "SVALSE on the circle, one trial"})  # fmt: skip


# Claims on the same draws: (label, method) of the lower and the higher GOSPA, and the claim
ORDER = [
    (("circle, 1 snapshot, 20 dB", "svalse"), ("circle, 1 snapshot, 20 dB", "valse"),
     "on the circle SVALSE has a lower GOSPA than VALSE with one snapshot"),
    (("circle, 10 snapshots, 20 dB", "svalse"), ("circle, 10 snapshots, 20 dB", "valse"),
     "on the circle SVALSE has a lower GOSPA than VALSE with ten snapshots"),
    (("circle, 10 bins, 20 dB", "svalse"), ("circle, 10 bins, 20 dB", "valse"),
     "on the circle SVALSE has a lower GOSPA than VALSE with ten frequencies"),
    (("circle, 1 snapshot, 20 dB", "svalse"), ("circle, 1 snapshot, 20 dB", "peaks_gnn"),
     "on the circle SVALSE has a lower GOSPA than the tracked beamformer with one snapshot"),
    (("sparse line, 2 sources, 5 bins", "svalse"), ("sparse line, 2 sources, 1 bin", "svalse"),
     "five frequencies resolve the grating lobes: two sources have a lower GOSPA than with one"),
    (("sparse line, 2 sources, hopping", "svalse"), ("sparse line, 2 sources, 1 bin", "svalse"),
     "one random frequency a step resolves the grating lobes over time: lower GOSPA than "
     "one fixed"),
    (("sparse line, 2 sources, hopping, whole posterior", "svalse"),
     ("sparse line, 2 sources, hopping", "svalse"),
     "with one random frequency, whole posteriors by coordinate ascent are better than Newton "
     "steps"),
]  # fmt: skip


def _decided(low: tuple[str, str], high: tuple[str, str], results: Any) -> Decision | None:
    n = int(low[1] != high[1])  # what differs: the scene, or the method
    return compared((low[n], high[n]), results[low], results[high], "degrees")


CLAIMS = tuple(
    Claim("any-array", "", text, by_ours=partial(_decided, low, high), source="ours")
    for low, high, text in ORDER
)


def _scores(case: ArrayExperiment, seed: int) -> tuple[float, float, float, float]:
    trial = create(case.scenario, **case.parameters).sample(np.random.default_rng(seed))
    g = _gospa(trial, _run(trial, case.method, case.params))
    return g.total, g.distance, g.missed, g.false


def _run(trial: Trial, method: str, params: dict[str, Any]) -> Run:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # the sparse line is ambiguous
        if method == "peaks_gnn":
            params = {"detector": trial.tracker("cbf", **params)}
        return trial.tracker(method, **params).run(trial.measurements)


def _gospa(trial: Trial, run: Run) -> Gospa:
    return mean_gospa(np.rad2deg(trial.truth), np.rad2deg(run.doa), c=10.0, period=360.0)


def _draw(seed: int) -> Figure:
    """Draw one run of SVALSE on the circle, with one and with ten snapshots a step."""
    from matplotlib.figure import Figure

    from arrivals.plots.bearing_time import plot_bearing_time

    figure = Figure(figsize=(9.0, 7.5), layout="constrained")
    panels = figure.subplots(2, sharex=True)
    for ax, n_snapshots in zip(panels, (1, 10), strict=True):
        scenario = Circle(n_snapshots=n_snapshots)
        trial = scenario.sample(np.random.default_rng(seed))
        run, model = _run(trial, "svalse", {}), scenario.measurement
        plot_bearing_time(run, snapshots=trial.measurements, measurement=model, ax=ax)
        truth: Float = np.rad2deg(trial.truth)
        ax.plot(truth, linestyle="none", marker="+", markersize=4, color="black", zorder=5)
        ax.set_title(f"SVALSE, {n_snapshots} snapshot{'s' * (n_snapshots > 1)} a step, 20 dB; "
                     "crosses: truth", fontsize=11)  # fmt: skip
        ax.label_outer()
    return figure
