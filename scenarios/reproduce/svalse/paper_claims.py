"""The claims of the paper on SVALSE, simulated scenes."""

from __future__ import annotations

from arrivals.scenarios.reproduce.claims import Claim
from arrivals.scenarios.reproduce.svalse import decisions as sv
from arrivals.scenarios.reproduce.svalse.forms import STARTS, start_label
from arrivals.scenarios.reproduce.svalse.published_values import PAPER

# fmt: off
CLAIMS: tuple[Claim, ...] = (
    *(Claim(f"svalse-fig{n}", f"Fig. {n}(d), Sec. VII.D", text, *decide) for n in (4, 5, 6)
      for text, decide in (
        ("SVALSE has a lower GOSPA than VALSE", sv.lower("gospa", "svalse", "valse")),
        ("the GOSPA of SVALSE is more stable than that of VALSE: a lower std over the steps",
         sv.lower("gospa_std", "svalse", "valse")),
        ("VALSE finds fewer of the sources near endfire than SVALSE",
         sv.lower("found_near_endfire", "valse", "svalse", unit="% of them")))),
    *(Claim(f"svalse-fig{n}", f"Fig. {n}, caption", f"{method.upper()} has a GOSPA of "
            f"{value:g} degrees in one run", sv.published("gospa", method, value))
      for n in (4, 5, 6) for method, value in PAPER[f"svalse_fig{n}"].items()),
    *(Claim(f"svalse-fig{n}", "Sec. VII.D", "the update filters sources that stop: "
            "nine of ten have no estimate then",
            *sv.below_limit("ghosts", "svalse", 0.1, unit="% have one")) for n in (5, 6)),
    Claim("svalse-fig4", "Sec. IV.B", "mixtures of von Mises densities approximate the densities "
          "of the angles accurately", sv.mixture_is_accurate),
    Claim("svalse-fig4", "Sec. VI.B", f"a high initial noise ({STARTS[0]:g} dB below the "
          "measurements, in place of 20 dB) misses more sources",
          *sv.starts("missed", STARTS[0], "degrees of GOSPA")),
    Claim("svalse-fig4", "Sec. VI.B", f"a low initial noise ({STARTS[2]:g} dB below) needs more "
          "computations", *sv.starts("iterations", STARTS[2], "iterations a step")),
    Claim("svalse-fig4", "Sec. VI.B", "noise that starts at 20 dB lowers the GOSPA of VALSE, whose "
          "own start has random performance",
          sv.lower("gospa", start_label(20, ours=False), "valse")[0]),
    *(Claim("svalse-fig7", f"Fig. 7{panel}", text, sv.lower(metric, sv.DEFAULT, other)[0])
      for panel, text, metric, other in (
        ("(a)", "without deaths more directions are false", "false", sv.PANELS[0]),
        ("(b)", "without memory more sources are missed", "missed", sv.PANELS[1]),
        ("(c)", "without births more sources are missed", "missed", sv.PANELS[2]),
        ("(d)", "with certain births more directions are false", "false", sv.PANELS[3]),
        (", Sec. VII.D", "probabilities between 0 and 1 have a lower GOSPA than VALSE", "gospa",
         sv.paper_form("valse")))),
    *(Claim("svalse-fig7", f"Fig. 7({panel}), caption", f"{name} of {known[label]:g} degrees in "
            f"one run with {label}", sv.published(metric, label, known[label]))
      for panel, label in zip("abcd", sv.PANELS, strict=True)
      for name, metric, known in (("GOSPA", "gospa", sv.PANEL_GOSPA),
                                  ("RMSE", "rmse", sv.PANEL_RMSE))),
    Claim("svalse-fig7", "Fig. 7(d), caption", f"GOSPA of {sv.PANEL_GOSPA[sv.PANELS[3]]:g} degrees "
          "with certain births: by the form as printed", sv.as_printed_7d),
    *(Claim(f"svalse-fig{n}", f"Fig. {n}({panel}), Sec. VII.E", f"{text}, below 10 dB", *decide)
      for n in (8, 9) for ours, other in (("valse", "sbl"), ("svalse", "ssbl"))
      for panel, text, decide in (
        ("a", f"{ours.upper()} has a lower GOSPA than {other.upper()}",
         sv.lower("gospa", ours, other, *sv.LOW)),
        ("b", f"{ours.upper()} has a smaller distance part than {other.upper()}",
         sv.lower("distance", ours, other, *sv.LOW)),
        ("c", f"{ours.upper()} finds too few directions",
         sv.below_limit("number_bias", ours, 0.0, *sv.LOW, unit="too few or many")),
        ("c", f"missed sources are most of the GOSPA of {ours.upper()}",
         sv.mostly("missed", ("distance", "false"), ours, *sv.LOW)),
        ("d", f"{other.upper()} finds too many directions",
         sv.above_limit("number_bias", other, 0.0, *sv.LOW, unit="too few or many")[:1]))),
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
    Claim("svalse-fig10", "Sec. VII.E", "SVALSE has a smaller error of the number of sources than "
          "VALSE, all SNRs together",
          *sv.lower("cardinality", "svalse", "valse", *sv.ALL, unit="sources")),
)
# fmt: on
