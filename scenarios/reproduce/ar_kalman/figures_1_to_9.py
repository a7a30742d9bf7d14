"""Figs 1 to 9 of the report on joint tracking of directions and source signals.

The report (Magakian, 2024, on Gu, Chan, Zhu and Swamy, 2013) has figures without numbers.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from arrivals.scenarios.experiments.workers import parallel_map
from arrivals.scenarios.reproduce.ar_kalman.experiments import (
    LITERAL,
    OURS,
    REPORT,
    Experiment,
    cases,
)
from arrivals.scenarios.reproduce.ar_kalman.plots import draw_array, draw_figure, draw_pacf
from arrivals.scenarios.reproduce.ar_kalman.scores import (
    SUBSPACE,
    Results,
    evaluate,
    pacf_of_voices,
    time_of_intervals,
)
from arrivals.scenarios.reproduce.report import Report

COLUMNS = (
    "figure", "case", "RMSE", "bias", "RMSE, report", "bias, report", "ESPRIT", "PAST", "MUSIC",
    "10 %", "90 %", "AR error", "AR error, report", "NMSE dB", "NMSE dB, report",
    "RMSE, word for word",
)  # fmt: skip
SHOWN = COLUMNS[1:9]


def ar_kf(runs: int, seed: int) -> Report:
    """Directions and AR models of the report's scenarios, by its method, ours and three others."""
    parts = cases()
    evaluated = parallel_map(evaluate, [(case, runs, seed) for case in parts])
    results: dict[tuple[str, str, str], Any] = pacf_of_voices()
    for one, _ in evaluated:
        results |= one
    for case in parts:
        if case.name == "speech, 10 dB":
            results |= time_of_intervals(case, seed)
    lines = [line for _, line in evaluated]
    widest = max(parts, key=lambda case: len(case.scene.distances))
    figures = {"array": draw_array(parts[0].scene, widest.scene)}
    for number in range(1, 10):
        drawn = [(case, line) for case, line in zip(parts, lines, strict=True)
                 if case.figure == (1 if number == 2 else number)]  # fmt: skip
        if drawn:
            figures[f"fig{number}"] = draw_figure(number, drawn)
    figures["pacf"] = draw_pacf(results)
    rows = [_row(case, results) for case in parts]
    title = f"The report's Figs 1 to 9, {runs} trials, degrees: median over trials of the RMSE"
    return Report(title, COLUMNS, rows, REMARKS, figures, SHOWN, results, _captions(figures, runs))


def _captions(figures: Iterable[str], runs: int) -> dict[str, str]:
    """Return what each picture shows: tracks of one run, sketches, recordings."""
    tracks = f"lines: run 0; bands: 10 to 90 % of {runs} runs"
    captions = {name: f"Fig. {name[3:]} of the report, {tracks}"
                for name in figures if name.startswith("fig")}  # fmt: skip
    return captions | {
        "array": "sketch of the sensors, no data",
        "pacf": "two shipped synthetic voices, no trials",
    }


def _row(case: Experiment, results: Results) -> tuple[Any, ...]:
    """Return a part's row of the table."""

    def median(metric: str, form: str) -> float:
        values = results.get((metric, form, case.name))
        return float("nan") if values is None else float(np.median(values))

    def bias(form: str) -> float:
        return float(results["bias", form, case.name].mean())

    place = f"Fig. {case.figure}: " if case.figure else ""
    spread = np.percentile(results["rmse", OURS, case.name], [10, 90])
    return (
        str(case.figure or "-"), f"{place}{case.name}",
        median("rmse", OURS), bias(OURS), median("rmse", REPORT), bias(REPORT),
        *(median("rmse", name) for name in SUBSPACE), *map(float, spread),
        median("ar error", OURS), median("ar error", REPORT),
        median("nmse", OURS), median("nmse", REPORT), median("rmse", LITERAL),
    )  # fmt: skip


REMARKS: Sequence[str] = (
    "MUSIC: multiple signal classification; ESPRIT: estimation of signal parameters via rotational "
    "invariance; PAST: projection approximation subspace tracking; AR: autoregressive; NMSE: mean "
    "square error of the signals in their mean power; rms: root of the mean square; N: snapshots "
    "of an interval; M: pairs of sensors; d: distances of the pairs to the centre, wavelengths; an "
    "octave is a factor of 2.",
    "RMSE over the intervals after the 100th (the 40th for moving sources), all sources together; "
    "bias: mean error of the source with the largest. Initial directions are 10 degrees off, 5 for "
    "moving sources and speech, 3 for three sources, a quarter of the separation for close ones. "
    "'Report' is the report's form: regression without the covariance of the estimated samples, "
    "mean of the pairs up to half a wavelength, phases by atan2, the manifold rebuilt from the "
    "directions. Both forms have the same forgetting factors and intervals, chosen for each scene. "
    "'Word for word' (CSV) takes the arctangent of the quotient of two rows, (7), and puts the "
    "estimated rows back.",
    "ESPRIT, PAST and MUSIC estimate unlabelled directions, scored by the best assignment (4 "
    "trials or 1); they need more sensors than sources and, here, a uniform line. In the "
    "pauses of speech they have no signal.",
    "M pairs of sensors and the centre sensor are 2M + 1 sensors: the report's M = 2, 3, 4 are 5, "
    "7, 9 sensors, and its smallest array, one pair, has 3. Two sensors alone have no row of ones: "
    "scale and sign of a source then follow from cos² + sin² = 1 and its last sign, half a turn of "
    "the phase remains open, and convergence takes longer.",
    "Why low SNR biases the report's form: its regressors are estimates, and their covariance is "
    "missing from the regression. With it a tenth of the bias remains.",
    "What makes it fail on speech, with order 1 as with order 2: the arctangent of the quotient, "
    "estimated rows put back, and innovation variances estimated in pauses; not the order. The "
    "partial autocorrelation of the shipped voices gives order 20, the largest considered, not 1.",
    "Errors in the report: the transformed manifold (its rows lack a factor √2 against the ones, "
    "and are reversed in one half, which swaps distances for M of 2 and more); the length of the "
    "state; and the missing measurement update in its algorithm 1. Its d1 = d2 = λ/2 is two "
    "sensors at one position, denoted '.5, .5' here.",
    "The report's recordings are not published: two synthetic voices that count replace them.",
)
