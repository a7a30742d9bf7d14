"""Coverage of the stated deviations and reliability of the stated existence, tracker by tracker.

    python benchmarks/stated_deviations.py [--runs 20] [--seed 0] [TRACKER ...]

Each tracker on scenes of its own kind (a `doa_deg` of None is drawn from the tracker's prior):
share of errors within the stated 68 and 95 % intervals, the squared error over the stated variance
(NEES), and the calibration error (ECE) of the existence.
"""

import argparse
import warnings
from typing import Any

import numpy as np

from arrivals.scenarios import create
from arrivals.scenarios.experiments.workers import parallel_map
from arrivals.scenarios.metrics import METRICS
from arrivals.trackers.rss.settings import VariationalSolver

COLUMNS = ("coverage68", "coverage95", "nees", "ece")
MODES = {"solver": VariationalSolver(covariance="modes")}
FROM_PRIOR = {"doa_deg": None}  # 0 ± 15 degrees in sine, the default of the tracker
Row = tuple[str, dict[str, Any], dict[str, Any]]  # scene, its parameters, those of the tracker
LINE: list[Row] = [("walk", {}, {}), ("svalse_fig6", {}, {})]
RSS: list[Row] = [
    ("rss_table1_k3", {}, {}),
    ("rss_walk", {"n_sources": 1}, {}),
    ("rss_walk", {}, {}),
    ("rss_crossing", {}, {}),
    ("rss_birth_death", {}, {"births": True}),
]


def near(doa_deg: float) -> dict[str, Any]:
    """Return the parameters of a tracker that starts at a direction, ± 3 degrees."""
    return {"doa": float(np.deg2rad(doa_deg)), "std": float(np.deg2rad(3.0))}


SCENES: dict[str, list[Row]] = {
    "svalse": [("walk", {"n_sources": 4}, {}), *LINE],
    "valse": [("walk", {"n_sources": 4}, {}), *LINE],
    "sbl": LINE,
    "ssbl": LINE,
    "peaks_gnn": LINE,
    "wideband_mixture": [
        ("room", {"array": array, "n_talkers": 2, "rt60": rt60, "snr_db": snr_db}, {})
        for array in ("circle", "line", "square")
        for rt60, snr_db in ((0.0, 20.0), (0.25, 20.0), (0.5, 10.0))
    ],
    "interpolation_ekf": [
        *(
            (f"interpolation_{source}", FROM_PRIOR, {"variant": variant})
            for source, variants in (("tone", ("B", "C", "D", "E2")), ("band", ("C", "D", "E2")))
            for variant in variants
        ),
        ("interpolation_tone", {"doa_deg": 60.0}, {}),
        ("interpolation_band", {"doa_deg": 60.0}, {}),
        ("interpolation_tone", {"doa_deg": 15.0, "snr_db": 20.0}, {"variant": "B"} | near(15.0)),
        ("interpolation_tone", {"doa_deg": 15.0, "snr_db": 20.0}, {"variant": "C"} | near(15.0)),
        ("interpolation_band", {"doa_deg": 60.0, "snr_db": 20.0}, {"variant": "C"} | near(60.0)),
    ],
    "ar_kalman_qrd_rls": [
        ("ar_fig1", {}, {}),
        ("ar_fig5", {}, {}),
        ("ar_fig5", {"snr_db": 1.0}, {}),
        ("ar_fig6", {}, {}),
        ("ar_three_on_three", {}, {}),
        ("ar_fig4", {}, {}),
        ("ar_fig4", {"snr_db": 0.0}, {}),
    ],
    "rss_vb": [*RSS, ("rss_table1_k3", {}, MODES), ("rss_table1_k7", {}, MODES)],
    "rss_ml": RSS,
}


def measure(
    tracker: str, scene: str, parameters: dict[str, Any], options: dict[str, Any], seed: int
) -> list[float]:
    """Return the figures of one run; NaN where the tracker does not state what they need."""
    if parameters == FROM_PRIOR:
        sine = np.random.default_rng([seed, 1]).normal(0.0, np.deg2rad(15.0))
        parameters = {"doa_deg": float(np.rad2deg(np.arcsin(sine)))}
    trial = create(scene, **parameters).sample(np.random.default_rng(seed))
    values = []
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        run = trial.tracker(tracker, **options).run(trial.measurements)
    for name in COLUMNS:
        try:
            values.append(METRICS[name](trial, run))
        except ValueError:
            values.append(np.nan)
    return values


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("trackers", nargs="*", metavar="TRACKER")
    parser.add_argument("--runs", type=int, default=20)
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args()
    print(f"{'tracker':18} {'scene':62}", *(f"{name:>11}" for name in COLUMNS))
    for tracker in arguments.trackers or SCENES:
        for scene, parameters, options in SCENES[tracker]:
            jobs = [
                (tracker, scene, parameters, options, arguments.seed + n)
                for n in range(arguments.runs)
            ]
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", RuntimeWarning)  # means of nothing but NaN
                means = np.nanmean(np.array(parallel_map(measure, jobs)), axis=0)
            named = {name: value for name, value in options.items() if isinstance(value, str)}
            label = f"{scene} {parameters or ''} {named or ', '.join(options)}"
            print(f"{tracker:18} {label:62}", *(f"{value:11.3f}" for value in means), flush=True)


if __name__ == "__main__":
    main()
