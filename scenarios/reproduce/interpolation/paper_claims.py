"""The claims of the paper on the interpolation-delay filter."""

from __future__ import annotations

from functools import partial

from arrivals.scenarios.reproduce.claims import Claim
from arrivals.scenarios.reproduce.interpolation import convergence, rmse, table_1, table_2
from arrivals.scenarios.reproduce.interpolation import decisions as itp
from arrivals.scenarios.reproduce.interpolation.forms import PAPER, by_both, by_scan

# The paper's source, "quadratic coupled signals" (Sec. 4), with the numbers of a tone beside it
COUPLED = {"source": "qpc", "beside": "tone"}

# fmt: off
CLAIMS: tuple[Claim, ...] = (
    *(Claim("interpolation-table1", place, f"{text}: {claim}", *by_both(decide, also="E2",
            source=source, **options))
      for source, text in (("qpc", "coupled tones, the source of Sec. 4"),
                           ("tone", "a tone (narrow band)"), ("band", "a broad band"))
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
          "% of the direction, coupled tones",
          *by_both(itp.percentage_within, **COUPLED, low=-1.325, high=12.865)),
    Claim("interpolation-table1", "Sec. 4", "those of the conventional method are -0.0958 to 7.78 "
          "%, coupled tones",
          *by_scan(itp.percentage_within, "conventional", **COUPLED, low=-0.09585, high=7.785)),
    Claim("interpolation-table1", "Sec. 4", "the variances of the proposed method are 0.0262 to "
          "0.0543 degrees², coupled tones",
          *by_both(itp.variances_within, **COUPLED, low=0.0262, high=0.0543)),
    Claim("interpolation-table1", "Sec. 4", "those of the conventional method are 0.000099 to "
          "0.2377 degrees², coupled tones",
          *by_scan(itp.variances_within, "conventional", **COUPLED, low=0.000099, high=0.2377)),
    *(Claim("interpolation-table1", "Table 1", f"the means of {text} at 15, 30, 45, 60 and 75 "
            f"degrees are the printed ones within {itp.SAME} degrees, coupled tones", *decide)
      for text, decide in (
        ("the proposed method", by_both(itp.published_means, **COUPLED,
                                        published=table_1.PAPER["proposed"])),
        ("the conventional method", by_scan(itp.published_means, "conventional", **COUPLED,
                                            published=table_1.PAPER["conventional"])),
        ("MVDR", by_scan(itp.published_means, "mvdr on the grid", **COUPLED,
                         published=table_1.PAPER["mvdr"])))),
    Claim("interpolation-table1", "Table 1", "the variance of the proposed method is smaller at 75 "
          "degrees than at 15, coupled tones", *by_both(itp.smaller_at_75, **COUPLED)),
    *(Claim("interpolation-table2", "Sec. 4, Table 2", f"the proposed method takes less time than "
            f"{name} with {reading}",
            *by_both(table_2.faster, than=than, reading=reading))
      for than, name in (("conventional", "the conventional method"), ("mvdr", "MVDR"))
      for reading in table_2.READINGS),
    Claim("interpolation-table2", "Table 2", "the conventional method takes less time than MVDR, "
          f"{table_2.SNAPSHOT}", table_2.mvdr_slower),
    *(Claim("interpolation-table2", "Sec. 5", "computationally not very demanding: fewer "
            f"operations than {name} with {reading}",
            partial(table_2.fewer_operations, method=PAPER, than=than, reading=reading))
      for than, name in (("conventional", "the conventional method"), ("mvdr", "MVDR"))
      for reading in table_2.READINGS),
    Claim("interpolation-table2", "Sec. 4", "the proposed method is fast enough for real time; no "
          "sampling rate is named", *by_both(table_2.real_time)),
    *(Claim("interpolation-convergence", f"Fig. {number}", f"the estimate of {doa:g} degrees "
            f"converges at {snr:g} dB: most trials end within {itp.NEAR:g} degrees, a tone",
            *by_both(itp.converges, doa=doa, snr_db=snr))
      for number, doa in ((2, 30.0), (3, 70.0)) for snr in (-10.0, -5.0, 0.0, 5.0)),
    *(Claim("interpolation-convergence", f"Fig. {number}, Sec. 5", f"coefficient {name} converges: "
            "within 0.1 of its true value in most trials, a tone",
            by_both(itp.mostly_near, key=(name,), limit=0.1, unit="")[0])
      for number, name in ((4, "b"), (5, "a"))),
    *(Claim("interpolation-convergence", "Abstract, Fig. 6", f"faster convergence than {name}: "
            "fewer snapshots from which the error stays below one degree, a tone",
            *by_both(itp.smaller, also="E", than=than, cases=[("settled",)], unit="snapshots"))
      for than, name in (("conventional", "the conventional method"), ("mvdr", "MVDR"))),
    Claim("interpolation-convergence", "Sec. 1", f"robust to an uncertain direction: from "
          f"{convergence.FAR:g} degrees most trials end within {itp.NEAR:g} degrees of 60, at 5 "
          "dB, a tone",
          *by_both(itp.mostly_near, key=("from afar",), limit=itp.NEAR, unit="degrees")),
    *(Claim("interpolation-rmse", f"{place}; {figure}", f"{text}, mean {where}, a tone",
            *by_both(itp.variance_below, also=also, than=than, cases=cases, factor=factor))
      for place, text, than, factor in (
        ("Abstract, Sec. 5", "the variance is less than that of the conventional method",
         "conventional", 1.0),
        ("Abstract", f"the variance is very close to that of MVDR: at most {itp.CLOSE} times",
         "mvdr", itp.CLOSE))
      for figure, where, also, cases in (
        ("Fig. 7", "of all numbers of snapshots", "E2", [("fig7", n) for n in rmse.LENGTHS]),
        ("Fig. 8", "from -10 to 5 dB", "E", [("fig8", snr) for snr in rmse.SNRS_DB[:4]]),
        ("Fig. 8", "from 10 to 20 dB", "E", [("fig8", snr) for snr in rmse.SNRS_DB[4:]]))),
    Claim("interpolation-rmse", "Sec. 4, Fig. 8", "MVDR has zero variance for all SNRs, a tone",
          partial(itp.zero_variance_by_snr, "mvdr on the grid"),
          partial(itp.zero_variance_by_snr, "mvdr")),
)
# fmt: on
