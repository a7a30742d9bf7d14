"""Claims of our own on the interpolation-delay filter."""

from __future__ import annotations

from functools import partial

import numpy as np

from arrivals.scenarios.reproduce.claims import Claim, Decision, negative
from arrivals.scenarios.reproduce.interpolation import decisions as itp
from arrivals.scenarios.reproduce.interpolation.decisions import Results, standard_error
from arrivals.scenarios.reproduce.interpolation.table_2 import RECORD, SNAPSHOT, fewer_operations
from arrivals.scenarios.reproduce.interpolation.trials import SOURCES, bound_deg

SMALL = 1.0  # degrees, of a mean from its prediction


def index_bias(results: Results) -> Decision | None:
    """Decide that the loop as printed ends where the sine is 1/κ too small, for a tone."""
    ends = itp.ends_of(results, "tone", "literal")
    if not ends:
        return None
    kappa = SOURCES["tone"].measurement.kappa
    off = {
        doa: each - np.rad2deg(np.arcsin(np.sin(np.deg2rad(doa)) - 1 / kappa))
        for doa, each in ends.items()
    }
    holds = itp.all_of(
        negative(abs(float(each.mean())) - SMALL, standard_error(each)) for each in off.values()
    )
    means = ", ".join(f"{each.mean():.1f}" for each in ends.values())
    worst = max(abs(float(each.mean())) for each in off.values())
    return Decision(holds, f"{means}; within {worst:.2f} degrees of it")


def below_bound(results: Results) -> Decision | None:
    """Decide that the paper's variance at 75 degrees is below the bound for a tone."""
    if ("tone", "B", 75.0) not in results:
        return None
    bound = bound_deg(SOURCES["tone"].replace(doa_deg=75.0)) ** 2
    return Decision(bound > 0.0262, f"0.0262 and {bound:.3f} degrees²")


TABLES = (
    Claim("interpolation-table1", "", "as printed, the index of (3) and (11) makes the sine 1/κ "
          "too small: 15, 30, 45, 60 and 75 degrees become -14, 0, 12, 21.5 and 27.8", None,
          index_bias, "ours"),
    Claim("interpolation-table1", "", "a zero variance of MVDR is an effect of the grid: for a "
          "tone at 15, 30 and 45 degrees, which are candidates, all estimates are equal", None,
          partial(itp.zero_variance, "mvdr on the grid", cases=(15.0, 30.0, 45.0)), "ours"),
    Claim("interpolation-table1", "", "the paper's variance at 75 degrees is below the Cramér-Rao "
          "bound, if its source is a tone and its record as long as ours", None, below_bound,
          "ours"),
    *(Claim("interpolation-table1", "", f"{text}: the variance of E2 is below that of B, mean of "
            "five angles", None, partial(itp.lower_variance, "E2", source=source, than="B"), "ours")
      for source, text in (("tone", "a tone"), ("band", "a band"), ("qpc", "coupled tones"))),
    *(Claim("interpolation-table2", "", f"two taps take fewer operations than {name} with {reading}"
, None, partial(fewer_operations, method="B", than=than, reading=reading), "ours")
      for than, name in (("conventional", "the conventional scan"), ("mvdr", "MVDR"))
      for reading in (RECORD, SNAPSHOT)),
)  # fmt: skip
CURVES = (
    Claim("interpolation-convergence", "", "from 50 degrees, E needs fewer snapshots than B to "
          "stay within one degree of 60 at 5 dB", None,
          partial(itp.smaller, "E", than="B", cases=[("settled",)], unit="snapshots"), "ours"),
    Claim("interpolation-rmse", "", "E attains the bound for a tone from 0 to 20 dB: its mean "
          f"square error is at most {itp.CLOSE} times as large", None,
          partial(itp.near_bound, "E", cases=[("fig8", snr) for snr in (0.0, 5.0, 10.0, 15.0,
                                                                        20.0)]), "ours"),
    Claim("interpolation-rmse", "", "E has a lower RMSE than B on a band from 0 to 20 dB", None,
          partial(itp.rms_below, "E", than="B", cases=[("fig8-band", snr) for snr in
                  (0.0, 5.0, 10.0, 15.0, 20.0)]), "ours"),
    *(Claim("interpolation-moving", "", f"{text}, a tone", None,
            partial(itp.smaller, first, than=second, cases=[("tone", way)], unit="degrees"), "ours")
      for text, way, first, second in (
        ("a filter of delay and rate (C) has a smaller error than one of the delay alone", "filter",
         "C DelayDrift 1e-08", "C DelayWalk 0.0001"),
        ("the phasor with a rate has a smaller error than two taps (B)", "filter",
         "phasor DelayDrift 1e-09", "B DelayWalk 0.001"),
        ("smoothed, the phasor with a rate has a smaller error than C with a rate", "smoother",
         "phasor DelayDrift 1e-09", "C DelayDrift 1e-08"))),
)  # fmt: skip
CLAIMS = (*TABLES, *CURVES)
