"""Calibration of SVALSE: coverage of its intervals and reliability of its existence."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from arrivals.scenarios.experiments.workers import parallel_map
from arrivals.scenarios.metrics.calibration import Reliability, reliability
from arrivals.scenarios.metrics.consistency import circular_nees, coverage
from arrivals.scenarios.metrics.registry import METRICS, existence_and_hits, pairs_of
from arrivals.scenarios.registry import create
from arrivals.scenarios.reproduce.claims import verdict
from arrivals.scenarios.reproduce.studies import Report
from arrivals.typing import Bool, Float

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LEVELS = (0.50, 0.68, 0.90, 0.95)
SETTLED = 5  # steps after which errors count


@dataclass(frozen=True, eq=False)
class CalibrationScene:
    """One scene: scenario, signal-to-noise ratio, parameters, limits of coverage.

    Parameters
    ----------
    scenario : str
    snr_db : float
    parameters : dict
    limits : tuple of four float, or None
        Lowest and highest coverage of the 68 % interval, then of the 95 % interval.
    """

    scenario: str
    snr_db: float
    parameters: dict[str, Any] = field(default_factory=dict)
    limits: tuple[float, float, float, float] | None = None

    @property
    def label(self) -> str:
        """Name of the scene."""
        details = [f"{name} {value}" for name, value in self.parameters.items()]
        return ", ".join([self.scenario.removeprefix("svalse_"), *details, f"{self.snr_db:g} dB"])


HONEST = (0.65, 0.71, 0.93, 0.97)
ON_CIRCLES = (0.65, 0.71, 0.925, 0.97)
CONSERVATIVE = (0.65, 0.87, 0.93, 0.985)  # some sources stand still
SCENES = [
    CalibrationScene("walk", 20.0, limits=HONEST),
    CalibrationScene("walk", 20.0, {"n_sources": 4}, HONEST),
    CalibrationScene("switch", 20.0, limits=HONEST),
    CalibrationScene("circle", 20.0, {"n_snapshots": 10}, ON_CIRCLES),
    CalibrationScene("circle", 20.0, {"n_bins": 10}, ON_CIRCLES),
    CalibrationScene("circle", 10.0, {"n_bins": 10}, ON_CIRCLES),
    CalibrationScene("circle", 20.0),
    *(
        CalibrationScene(f"svalse_{figure}", snr_db, limits=CONSERVATIVE)
        for figure in ("fig4", "fig5", "fig6")
        for snr_db in (10.0, 20.0, 40.0)
    ),
    *(CalibrationScene(f"svalse_fig{n}", 0.0) for n in (4, 5, 6)),
    CalibrationScene("walk", 0.0, {"n_sources": 4}),
]


class Statements(NamedTuple):
    """What a tracker stated in some runs, and what was true.

    Attributes
    ----------
    error, std : ndarray, shape (n_pairs,)
        rad.
    existence : ndarray, shape (n_estimates,)
    hit : ndarray of bool, shape (n_estimates,)
    gospa : ndarray, shape (n_runs,)
        Degrees.
    """

    error: Float
    std: Float
    existence: Float
    hit: Bool
    gospa: Float


def statements(scene: CalibrationScene, seed: int, tracker: str = "svalse") -> Statements:
    """Return the statements of one run."""
    scenario = create(scene.scenario, snr_db=scene.snr_db, **scene.parameters)
    trial = scenario.sample(np.random.default_rng(seed))
    run = trial.tracker(tracker).run(trial.measurements)
    pairs = pairs_of(trial, run)
    late = pairs.step >= SETTLED
    std = run.fields["std"][pairs.step, pairs.slot]
    existence, hit = existence_and_hits(trial, run)
    gospa = np.array([METRICS["gospa"](trial, run)])
    return Statements(pairs.error[late], std[late], existence, hit, gospa)


def calibration(runs: int, seed: int) -> Report:
    """Coverage, NEES, reliability and GOSPA of SVALSE in every scene."""
    jobs = [(scene, seed + n) for scene in SCENES for n in range(runs)]
    each = parallel_map(statements, jobs)
    pooled = {
        scene: _pooled(each[n * runs : (n + 1) * runs]) for n, scene in enumerate(SCENES)
    }  # fmt: skip
    columns = ("scene", "50 %", "68 %", "90 %", "95 %", "NEES", "GOSPA", "ECE", "Brier",
               "log score")  # fmt: skip
    remarks = (
        "Share of errors within the stated intervals, %, of estimates within 10 degrees of a "
        f"source, from step {SETTLED} on; NEES is the squared error over the stated variance. "
        "GOSPA in degrees, cut-off 10. ECE, Brier and log score compare the stated existence "
        "with the share of estimates within 10 degrees of a source.",
        *claims(pooled),
    )
    figures = _figures(pooled)
    return Report(
        f"SVALSE: stated deviations and existence over {runs} runs",
        columns,
        [_row(scene, result) for scene, result in pooled.items()],
        remarks,
        figures,
    )


def _pooled(parts: list[Statements]) -> Statements:
    return Statements(*(np.concatenate(values) for values in zip(*parts, strict=True)))


def shares(result: Statements) -> list[float]:
    """Return the coverage at `LEVELS`."""
    return [coverage(result.error, result.std, level) for level in LEVELS]


def _row(scene: CalibrationScene, result: Statements) -> tuple[Any, ...]:
    r = reliability(result.existence, result.hit)
    covered = [100 * share for share in shares(result)]
    nees = circular_nees(result.error, result.std)
    gospa = float(result.gospa.mean())
    return (scene.label, *covered, nees, gospa, r.ece, r.brier, r.log_score)


def at_least_10_db(pooled: Mapping[CalibrationScene, Statements]) -> Reliability:
    """Return the reliability of all scenes at 10 dB and more, pooled."""
    loud = [result for scene, result in pooled.items() if scene.snr_db >= 10]
    all_of_them = _pooled(loud)
    return reliability(all_of_them.existence, all_of_them.hit)


def claims(pooled: Mapping[CalibrationScene, Statements]) -> list[str]:
    """Return the verdicts on coverage and reliability."""
    lines = []
    for scene, result in pooled.items():
        if scene.limits is None:
            continue
        low68, high68, low95, high95 = scene.limits
        _, c68, _, c95 = shares(result)
        text = f"{scene.label}: coverage within {low68:.0%} to {high68:.0%} and {low95:.1%} to {high95:.1%}"  # noqa: E501
        holds = low68 <= c68 <= high68 and low95 <= c95 <= high95
        lines.append(verdict(text, holds, f"{c68:.1%} and {c95:.1%}"))
    loud = at_least_10_db(pooled)
    for name, value, limit in (
        ("ECE", loud.ece, 0.05), ("Brier score", loud.brier, 0.007),
        ("log score", loud.log_score, 0.04),
    ):  # fmt: skip
        text = f"existence at 10 dB and more, pooled: {name} below {limit:g}"
        lines.append(verdict(text, value < limit, f"{value:.4f}"))
    return lines


def _figures(pooled: Mapping[CalibrationScene, Statements]) -> dict[str, Figure]:
    """Draw the coverage of every scene, and two reliability diagrams."""
    from matplotlib.figure import Figure

    from arrivals.plots.calibration import plot_coverage, plot_reliability

    first = Figure(figsize=(8.0, 6.0), layout="constrained")
    labelled = {scene.label: shares(result) for scene, result in pooled.items()}
    plot_coverage(labelled, LEVELS, ax=first.subplots())
    second = Figure(figsize=(5.0, 4.6), layout="constrained")
    ax = second.subplots()
    plot_reliability(at_least_10_db(pooled).table, label="10 dB and more", ax=ax)
    quiet = _pooled([result for scene, result in pooled.items() if scene.snr_db < 10])
    plot_reliability(reliability(quiet.existence, quiet.hit).table, label="0 dB", ax=ax)
    return {"coverage": first, "reliability": second}
