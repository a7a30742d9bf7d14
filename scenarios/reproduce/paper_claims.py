"""The claims of the papers: study, section, our words, and the functions that decide them.

A claim is decided by the form that the paper prints, by the defaults of this library, or by both
where they differ. Claims of our own and checks stand in the modules of their studies.
"""

from __future__ import annotations

from functools import partial
from typing import Any

from arrivals.scenarios.reproduce.claims import Claim, Verdict
from arrivals.scenarios.reproduce.interpolation import convergence, rmse, table_1, table_2
from arrivals.scenarios.reproduce.interpolation import decisions as itp
from arrivals.scenarios.reproduce.interpolation import own_claims as interpolation
from arrivals.scenarios.reproduce.svalse import any_array, calibration

# fmt: off
SVALSE: tuple[Claim, ...] = (
    *(Claim(f"svalse-fig{n}", f"Fig. {n}(d), Sec. VII.D", text, *decide) for n in (4, 5, 6)
      for text, decide in (
        ("SVALSE has a lower GOSPA than VALSE", sv.lower("gospa", "svalse", "valse")),
        ("the GOSPA of SVALSE is more stable than that of VALSE: its std over the steps",
         sv.lower("gospa_std", "svalse", "valse")),
        ("VALSE finds fewer of the sources near endfire than SVALSE",
         sv.lower("found_near_endfire", "valse", "svalse", unit="of them")))),
    *(Claim(f"svalse-fig{n}", f"Fig. {n}, caption", f"GOSPA of {method.upper()} in one run",
            sv.published("gospa", method, value))
      for n in (4, 5, 6) for method, value in PAPER[f"svalse_fig{n}"].items()),
    *(Claim(f"svalse-fig{n}", "Sec. VII.D", "nine of ten sources that stop have no estimate then",
            *sv.below_limit("ghosts", "svalse", 0.1, unit="have one")) for n in (5, 6)),
    Claim("svalse-fig4", "Sec. VI.B", "noise that starts at 20 dB lowers the GOSPA of VALSE, whose "
          "own start has random performance", sv.lower("gospa", FROM_20_DB, "valse")[0]),
    *(Claim("svalse-fig7", f"Fig. 7{panel}", text, sv.lower(metric, sv.DEFAULT, other)[0])
      for panel, text, metric, other in (
        ("(a)", "without deaths more directions are false", "false", sv.PANELS[0]),
        ("(b)", "without memory more sources are missed", "missed", sv.PANELS[1]),
        ("(c)", "without births more sources are missed", "missed", sv.PANELS[2]),
        ("(d)", "with certain births more directions are false", "false", sv.PANELS[3]),
        (", Sec. VII.D", "probabilities between 0 and 1 have a lower GOSPA than VALSE", "gospa",
         sv.paper_form("valse")))),
    *(Claim("svalse-fig7", f"Fig. 7({panel}), caption", f"GOSPA of {label} in one run",
            sv.published("gospa", label, sv.PANEL_GOSPA[label]))
      for panel, label in zip("abcd", sv.PANELS, strict=True)),
    Claim("svalse-fig7", "Fig. 7(d), caption", "as printed: within 10 %", sv.as_printed_7d),
    *(Claim(f"svalse-fig{n}", f"Fig. {n}({panel}), Sec. VII.E", f"{text}, below 10 dB", *decide)
      for n in (8, 9) for ours, other in (("valse", "sbl"), ("svalse", "ssbl"))
      for panel, text, decide in (
        ("a", f"{ours.upper()} has a lower GOSPA than {other.upper()}",
         sv.lower("gospa", ours, other, *sv.LOW)),
        ("b", f"{ours.upper()} has a smaller distance part than {other.upper()}",
         sv.lower("distance", ours, other, *sv.LOW)),
        ("c", f"{ours.upper()} finds too few directions",
         sv.below_limit("number_bias", ours, 0.0, *sv.LOW, unit="too many")),
        ("c", f"missed sources are most of the GOSPA of {ours.upper()}",
         sv.mostly("missed", ("distance", "false"), ours, *sv.LOW)),
        ("d", f"{other.upper()} finds too many directions",
         sv.above_limit("number_bias", other, 0.0, *sv.LOW, unit="too many")[:1]))),
    *(Claim(f"svalse-fig{n}", f"Fig. {n}({panel}), Sec. VII.E", text, *decide) for n in (8, 9)
      for panel, text, decide in (
        ("a", "from 30 dB on SSBL is slightly better than SVALSE",
         sv.lower("gospa", "ssbl", "svalse", *sv.HIGH)),
        ("b", "from 30 dB on SSBL has a smaller distance part than SVALSE",
         sv.lower("distance", "ssbl", "svalse", *sv.HIGH)),
        ("b", "that is since the sources are on its grid: halfway between its directions SVALSE "
         "has the smaller one", sv.lower("distance", "svalse", "ssbl", *sv.OFF_GRID)))),
    *(Claim("svalse-fig9", place, f"the iteration of {method.upper()} converges in every step",
            *sv.always_converges(method)) for place, method in (("Sec. I.A", "valse"),
                                                                ("Sec. IX", "svalse"))),
    *(Claim("svalse-fig10", f"Fig. 10({panel}), Sec. VII.E", f"{first.upper()} has a lower RMSE "
            f"than {second.upper()}, {where}", *sv.lower("rmse", first, second, *cases))
      for panel, where, cases, pairs in (
        ("a", "below 10 dB", sv.of_scenario(1, sv.LOW), (("sbl", "valse"), ("ssbl", "svalse"))),
        ("b", "below 10 dB", sv.of_scenario(2, sv.LOW), (("sbl", "valse"), ("ssbl", "svalse"))),
        ("b", "from 30 dB on", sv.of_scenario(2, sv.HIGH), (("svalse", "sbl"), ("svalse", "ssbl"))),
        ("a, b", "all SNRs together", sv.ALL, (("svalse", "sbl"), ("svalse", "ssbl"),
                                               ("svalse", "valse")))) for first, second in pairs),
    Claim("svalse-fig10", "Sec. VII.E", "SVALSE has a better number of sources than VALSE: mean "
          "error, all SNRs together",
          *sv.lower("cardinality", "svalse", "valse", *sv.ALL, unit="sources")),
)
AT_SEA: tuple[Claim, ...] = (
    *(Claim("swellex96", "Sec. VIII, Fig. 12", f"{text}, steps 1 to 100", *sea.lower(*decide))
      for text, decide in (
        ("VALSE has a better resolution than CBF: less missed", ("missed", "valse", "cbf")),
        ("SVALSE has a better resolution than CBF: less missed", ("missed", "svalse", "cbf")),
        ("SVALSE is more accurate than VALSE: GOSPA", ("gospa", "svalse", "valse")),
        ("SVALSE distinguishes more of the paths than VALSE: less missed",
         ("missed", "svalse", "valse")))),
    *(Claim("swellex96", "Sec. VIII", text, decide) for text, decide in sea.FIELD),
)
# fmt: on
AUTOREGRESSIVE: tuple[Claim, ...] = ()
# fmt: off
INTERPOLATION: tuple[Claim, ...] = (
    *(Claim("interpolation-table1", place, f"{text}: {claim}", *itp.by_both(decide, source=source,
            **options))
      for source, text in (("tone", "a tone (narrow band)"), ("band", "a broad band"),
                           ("qpc", "coupled tones"))
      for place, claim, decide, options in (
        ("Abstract, Sec. 5", f"the mean is close to the truth, within {itp.LARGEST} degrees, the "
         "largest error of Table 1", itp.accurate, {}),
        ("Abstract, Sec. 5", "the variance is less than that of the conventional method, mean of "
         "five angles", itp.lower_variance, {"than": "conventional"}),
        ("Abstract", f"the variance is very close to that of MVDR: at most {itp.CLOSE} times, mean "
         "of five angles", itp.lower_variance, {"than": "mvdr", "factor": itp.CLOSE}))),
    Claim("interpolation-table1", "Sec. 4, Table 1", "MVDR has zero variance for all directions",
          partial(itp.zero_variance, "mvdr on the grid"), partial(itp.zero_variance, "mvdr")),
    Claim("interpolation-table1", "Sec. 4", "the errors of the proposed method are -1.32 to 12.86 "
          "% of the direction, for a tone",
          *itp.by_both(itp.percentage_within, source="tone", low=-1.325, high=12.865)),
    Claim("interpolation-table1", "Sec. 4", "those of the conventional method are -0.0958 to 7.78 "
          "%", partial(itp.percentage_within, "conventional", source="tone", low=-0.09585,
                       high=7.785)),
    Claim("interpolation-table1", "Sec. 4", "the variances of the proposed method are 0.0262 to "
          "0.0543 degrees², for a tone",
          *itp.by_both(itp.variances_within, source="tone", low=0.0262, high=0.0543)),
    Claim("interpolation-table1", "Sec. 4", "those of the conventional method are 0.000099 to "
          "0.2377", partial(itp.variances_within, "conventional", source="tone", low=0.000099,
                            high=0.2377)),
    *(Claim("interpolation-table1", "Table 1", f"the means of {text} are those of a tone",
            *decide)
      for text, decide in (
        ("the proposed method", itp.by_both(itp.published_means,
                                            published=table_1.PAPER["proposed"])),
        ("the conventional method", (partial(itp.published_means, "conventional",
                                             published=table_1.PAPER["conventional"]),)),
        ("MVDR", (partial(itp.published_means, "mvdr on the grid",
                          published=table_1.PAPER["mvdr"]),)))),
    Claim("interpolation-table1", "Table 1", "the variance of the proposed method is smaller at 75 "
          "degrees than at 15", *itp.by_both(itp.smaller_at_75)),
    *(Claim("interpolation-table2", "Sec. 4, Table 2", f"the proposed method takes less time than "
            f"{name} with {reading}",
            *itp.by_both(table_2.faster, "E", than=than, reading=reading))
      for than, name in (("conventional", "the conventional method"), ("mvdr", "MVDR"))
      for reading in table_2.READINGS),
    Claim("interpolation-table2", "Table 2", "MVDR takes more time than the conventional method",
          table_2.mvdr_slower),
    Claim("interpolation-table2", "Sec. 4", "the proposed method is fast enough for real time; no "
          "sampling rate is named",
          *itp.by_both(table_2.real_time, "C")),
    *(Claim("interpolation-convergence", f"Fig. {number}", f"the estimate of {doa:g} degrees "
            f"converges at {snr:g} dB: most trials end within {itp.NEAR:g} degrees",
            *itp.by_both(itp.converges, "E", doa=doa, snr_db=snr))
      for number, doa in ((2, 30.0), (3, 70.0)) for snr in (-10.0, -5.0, 0.0, 5.0)),
    *(Claim("interpolation-convergence", f"Fig. {number}, Sec. 5", f"coefficient {name} converges: "
            "within 0.1 of its true value in most trials",
            itp.by_both(itp.mostly_near, key=(name,), limit=0.1, unit="")[0])
      for number, name in ((4, "b"), (5, "a"))),
    *(Claim("interpolation-convergence", "Abstract, Fig. 6", f"faster convergence than {name}: "
            "fewer snapshots from which the error stays below one degree",
            *itp.by_both(itp.smaller, "E", than=than, cases=[("settled",)], unit="snapshots"))
      for than, name in (("conventional", "the conventional method"), ("mvdr", "MVDR"))),
    Claim("interpolation-convergence", "Sec. 1", f"robust to an uncertain direction: from "
          f"{convergence.FAR:g} degrees most trials end within {itp.NEAR:g} degrees of 60, at 5 dB",
          *itp.by_both(itp.mostly_near, "C", key=("from afar",), limit=itp.NEAR, unit="degrees")),
    *(Claim("interpolation-rmse", place, f"a lower RMSE than {name}, {where}",
            *itp.by_both(itp.rms_below, ours, than=than, cases=cases))
      for than, name in (("conventional", "the conventional method"), ("mvdr", "MVDR"))
      for place, where, ours, cases in (
        ("Fig. 7, Sec. 5", "mean square of all numbers of snapshots", "E2",
         [("fig7", n) for n in rmse.LENGTHS]),
        ("Fig. 8, Sec. 5", "mean square from -10 to 5 dB", "E",
         [("fig8", snr) for snr in rmse.SNRS_DB[:4]]),
        ("Fig. 8, Sec. 5", "mean square from 10 to 20 dB", "E",
         [("fig8", snr) for snr in rmse.SNRS_DB[4:]]))),
    Claim("interpolation-rmse", "Sec. 4, Fig. 8", "MVDR has zero variance for all SNRs, for a tone",
          partial(itp.zero_variance_by_snr, "mvdr on the grid"),
          partial(itp.zero_variance_by_snr, "mvdr")),
)
# fmt: on
SIGNAL_STRENGTH: tuple[Claim, ...] = ()

CLAIMS = (
    *SVALSE,
    *AT_SEA,
    *AUTOREGRESSIVE,
    *INTERPOLATION,
    *SIGNAL_STRENGTH,
    *interpolation.CLAIMS,
    *any_array.CLAIMS,
    *calibration.CLAIMS,
)


def verdicts_of(study: str, results: Any) -> list[Verdict]:
    """Return the verdicts on all claims of a study.

    Parameters
    ----------
    study : str
        Name of the study.
    results : object
        `Report.results` of that study.

    Returns
    -------
    list of Verdict

    Examples
    --------
    >>> verdicts_of("interpolation-table9", None)
    []
    """
    return [claim.decide(results) for claim in CLAIMS if claim.study == study]
