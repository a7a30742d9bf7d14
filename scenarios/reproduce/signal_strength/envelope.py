"""The statistic of signal strength: Fig. 2, its approximations, detection, and the bounds."""

from __future__ import annotations

from typing import Any

import numpy as np

from arrivals.scenarios.bounds.detection import exact_detection
from arrivals.scenarios.reproduce.report import Report
from arrivals.scenarios.reproduce.signal_strength.drive_by import (
    FAR_SEGMENTS,
    N_SEGMENTS,
    SEGMENT,
    drive_by,
    envelope_law,
)
from arrivals.scenarios.reproduce.signal_strength.envelope_decisions import (
    NUMBERS,
    EnvelopeResults,
    normalised_square,
)
from arrivals.scenarios.reproduce.signal_strength.envelope_plots import (
    draw_detection,
    draw_drive_by,
    draw_ranges,
)
from arrivals.scenarios.reproduce.signal_strength.range_estimates import (
    FORMS,
    distribution_distance,
    position_errors,
    range_bound,
    range_errors,
)

RECORDS = 400  # of the synthetic sound
SNR_DB = -3.0
FALSE_ALARM, CHECKED, DRAWS = 0.01, 50, 100_000
REMARKS = (
    "One sensor: the range of a source of known power 30 m away, 20 000 draws of the exact "
    "statistic; the variance of each form grows with the level. Network: the position by 100 "
    "sensors in a disc of 100 m, noise of one variance for all of them added to the logarithm, "
    "the amplitude or the energy, the search started at the truth. Stated / actual: deviation "
    "of the range by the form over that of its errors; of positions, the root of the mean square "
    "of errors over their stated deviations, inverted.",
    "The bound is that of Cramér and Rao; estimates of the range are biased, and may lie below it.",
    f"The paper's recording of a car (Fig. 2) is not available: the sound is synthetic, lines at "
    f"the multiples of 25 Hz with drifting phases and a resonance at 1100 Hz. Far apart are "
    f"samples {FAR_SEGMENTS} segments of 2.5 ms apart.",
    "The paper leaves the receiver operating characteristics to its reference 2; here by one "
    f"sensor at an SNR (signal-to-noise ratio) of {SNR_DB:g} dB.",
    "N is the number of snapshots. Bars in the pictures are two standard errors. Bias: mean error "
    "of the range, length of the mean error of positions; error: standard deviation of the range, "
    "root mean square of positions.",
)


def envelope_study(runs: int, seed: int) -> Report:
    """Fig. 2, approximations of the statistic, detection, and Cramér-Rao bounds."""
    rng = np.random.default_rng(seed)
    law, sound = envelope_law(RECORDS, rng), drive_by(N_SEGMENTS * SEGMENT, rng)
    ranges = {(form, N): range_errors(form, N, np.random.default_rng(seed))
              for N in NUMBERS for form in FORMS}  # fmt: skip
    positions, bounds = {}, {}
    for N in NUMBERS:
        found, bounds[N] = position_errors(N, runs, seed)
        positions.update({(form, N): one for form, one in found.items()})
    rows: list[tuple[Any, ...]] = []
    for (form, N), one in ranges.items():
        std = float(one.error.std())
        rows.append((
            "range, %", N, form, 100 * float(one.error.mean()), 100 * std, 100 * range_bound(N),
            float(np.median(one.stated)) / std,
        ))  # fmt: skip
    for (form, N), one in positions.items():
        rms = float(np.sqrt(np.square(one.error).sum(axis=1).mean()))
        bias = float(np.linalg.norm(one.error.mean(axis=0)))
        bound = float(np.sqrt(np.square(bounds[N]).mean()))
        rows.append(
            ("network, m", N, form, bias, rms, bound, 1 / float(np.sqrt(normalised_square(one))))
        )
    columns = ("estimate", "N", "form", "bias", "error", "bound", "stated / actual")
    distances = {(form, N): distribution_distance(form, N) for form in FORMS for N in NUMBERS}
    results = EnvelopeResults(ranges, positions, bounds, distances, law, _detected(rng))
    figures = {
        "fig2": draw_drive_by(sound, law),
        "detection": draw_detection(SNR_DB, NUMBERS),
        "range": draw_ranges(results),
    }
    title = f"Statistic of signal strength, Fig. 2 and Sec. 2: {runs} networks"
    captions = {
        "fig2": f"Fig. 2: one synthetic sound; right: {RECORDS} sounds",
        "detection": "Detection by one sensor: formulas",
        "range": f"(a) formulas; (b), (c) 20 000 draws of one sensor; (d) {runs} networks",
    }
    return Report(title, columns, rows, REMARKS, figures, columns, results, captions)


def _detected(rng: np.random.Generator) -> tuple[float, float, float]:
    """Return P_D by the formula, by simulation, and the standard error of that."""
    from scipy.special import gammainccinv

    snr, N = 10 ** (SNR_DB / 10), CHECKED
    exact = float(exact_detection(FALSE_ALARM, N, snr))
    energy = (1 + snr) * rng.gamma(N, size=DRAWS)
    found = float(np.mean(energy > gammainccinv(N, FALSE_ALARM)))
    return exact, found, float(np.sqrt(exact * (1 - exact) / DRAWS))
