"""The claims of the paper on the interpolation-delay filter."""

from __future__ import annotations

from functools import partial

from arrivals.scenarios.reproduce.claims import Claim
from arrivals.scenarios.reproduce.interpolation import convergence, rmse, table_1, table_2
from arrivals.scenarios.reproduce.interpolation import decisions as itp

# fmt: off
CLAIMS: tuple[Claim, ...] = (
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
