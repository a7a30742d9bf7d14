"""Claims of our own on the interpolation-delay filter: of forms that they name."""

from __future__ import annotations

from functools import partial

import numpy as np

from arrivals.scenarios.experiments.statistics import standard_error
from arrivals.scenarios.reproduce.claims import Claim
from arrivals.scenarios.reproduce.decisions import Decision, all_of, negative
from arrivals.scenarios.reproduce.interpolation import decisions as itp
from arrivals.scenarios.reproduce.interpolation.decisions import Results
from arrivals.scenarios.reproduce.interpolation.forms import OURS, PAPER, SOURCE_NAMES
from arrivals.scenarios.reproduce.interpolation.trials import SOURCES, bound_deg

SMALL = 1.0  # degrees, of a mean from its prediction
PRINTED_AT_75 = 0.0262  # variance of the proposed method in Table 1, degrees²


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
    holds = all_of(
        negative(abs(float(each.mean())) - SMALL, standard_error(each)) for each in off.values()
    )
    means = ", ".join(f"{each.mean():.1f}" for each in ends.values())
    worst = max(abs(float(each.mean())) for each in off.values())
    return Decision(holds, f"{means} degrees; at most {worst:.2f} degrees from it")


def below_bound(results: Results) -> Decision | None:
    """Decide that the paper's variance at 75 degrees is below the bounds."""
    if ("qpc", PAPER, 75.0) not in results:
        return None
    bounds = {name: bound_deg(SOURCES[name].replace(doa_deg=75.0)) ** 2 for name in ("qpc", "tone")}
    each = " and ".join(f"{bound:.3f} for {SOURCE_NAMES[name]}" for name, bound in bounds.items())
    return Decision(min(bounds.values()) > PRINTED_AT_75,
                    f"printed {PRINTED_AT_75}, bounds {each}, degrees²")  # fmt: skip


TABLES = (
    Claim("interpolation-table1", "", "as printed, the index of (3) and (11) makes the sine 1/κ "
          "too small, a tone: 15, 30, 45, 60 and 75 degrees become -14, 0, 12, 21.5 and 27.8", None,
          index_bias, "ours"),
    Claim("interpolation-table1", "", "a zero variance of MVDR is an effect of the grid: for a "
          "tone at 15, 30 and 45 degrees, which are candidates, all estimates are equal", None,
          partial(itp.zero_variance, "mvdr on the grid", cases=(15.0, 30.0, 45.0)), "ours"),
    Claim("interpolation-table1", "", "the paper's variance at 75 degrees is below the Cramér-Rao "
          "bound, if its record is as long as ours", None, below_bound,
          "ours"),
    *(Claim("interpolation-table1", "", f"{text}: the variance of {form} is below that of the "
            "paper's loop (frozen), mean of five angles", None,
            partial(itp.lower_variance, form, source=source, than=PAPER), "ours")
      for source, text in SOURCE_NAMES.items() for form in (OURS, "E2")),
)  # fmt: skip
CURVES = (
    Claim("interpolation-convergence", "", "from 50 degrees, E needs fewer snapshots than the "
          "paper's loop (frozen) to stay within one degree of 60 at 5 dB", None,
          partial(itp.smaller, "E", than=PAPER, cases=[("settled",)], unit="snapshots"), "ours"),
    Claim("interpolation-rmse", "", "E attains the bound for a tone from 0 to 20 dB: its mean "
          f"square error is at most {itp.CLOSE} times as large", None,
          partial(itp.near_bound, "E", cases=[("fig8", snr) for snr in (0.0, 5.0, 10.0, 15.0,
                                                                        20.0)]), "ours"),
    Claim("interpolation-rmse", "", "E has a lower RMSE than the paper's loop (frozen) on a "
          "band from 0 to 20 dB", None,
          partial(itp.rms_below, "E", than=PAPER, cases=[("fig8-band", snr) for snr in
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
