"""The claims of the paper on signal strength."""

from __future__ import annotations

from arrivals.scenarios.reproduce.claims import Claim
from arrivals.scenarios.reproduce.rss import convergence_decisions as ends
from arrivals.scenarios.reproduce.rss import decisions as rss
from arrivals.scenarios.reproduce.rss import time_decisions as times
from arrivals.scenarios.reproduce.rss.published_values import SEVEN, THREE
from arrivals.scenarios.reproduce.signal_strength import doppler
from arrivals.scenarios.reproduce.signal_strength import envelope_decisions as env
from arrivals.scenarios.reproduce.signal_strength.range_estimates import (
    AMPLITUDE,
    ENERGY,
    EXACT,
    LOG,
)

# fmt: off
CLAIMS: tuple[Claim, ...] = (
    *(Claim("rss", "Table 1", f"{case}: the {name} of {'VB' if vb else 'ML'} is smaller than that "
            f"of {'ML' if vb else 'VB'}", *rss.smaller(metric, case, vb))
      for case, of_vb in ((THREE, (True, True, True, True)), (SEVEN, (False, True, False, True)))
      for vb, (metric, name) in zip(of_vb, (
        ("amplitude_bias", "amplitude bias"), ("amplitude_rms", "amplitude error"),
        ("location_bias", "location bias"), ("location_rms", "location error")), strict=True)),
    Claim("rss", "Fig. 4(d), Sec. 4", "three close targets: the powers of VB have a smaller spread "
          "than those of ML", *rss.smaller("power_std", THREE, True)),
    Claim("rss", "Fig. 4(d), Sec. 4", "three close targets: the powers of ML have a shoulder: "
          "fewer powers of VB than of ML are above 84 dB", *rss.smaller("shoulder", THREE, True)),
    Claim("rss", "Fig. 4(h), Sec. 4", "seven targets: ML outperforms VB in the powers (their "
          "RMS error; Table 1 has the reverse)", *rss.smaller("amplitude_rms", SEVEN, False)),
    Claim("rss", "Fig. 4(c), Sec. 4", "ML has a smaller location error from a start that follows "
          "the prior than from a random one",
          rss.between_cases("location_rms", ("K=3 prior", rss.ML), (THREE, rss.ML))),
    *(Claim("rss", "Sec. 4", f"{case}: {text}", *decide) for case in (THREE, SEVEN)
      for text, decide in (
        ("VB is more susceptible to divergence than ML: more trials end more than 30 m outside "
         "the sensors", ends.more_divergent(case)),
        ("ML is more susceptible to local maxima than VB", ends.more_stuck(case)),
        ("ML quite often cannot find an initial direction: in more than a tenth of the trials",
         ends.without_direction(case)),
        ("the divergence of VB is easily seen, as its large jumps are easy to detect: diverged "
         "trials have the larger step in 90 % of the pairs or more", ends.visible(case)),
        ("it is harder to detect whether ML is at a local maximum than whether VB diverges",
         ends.harder(case)))),
    *(Claim("rss", "Sec. 4", f"{case}: VB converges in fewer than 10 cycles in most cases: it is "
            "then within 1 m and 0.5 dB of its end", *ends.mostly("settled", case))
      for case in (THREE, SEVEN, rss.ONE)),
    *(Claim("rss", "Sec. 4", f"{case}: fewer than 10 cycles are enough: the location error after 9 "
            "is at most 1.1 times that after 30", *ends.as_good_after_few(case))
      for case in (THREE, SEVEN)),
    *(Claim("rss", "Sec. 3", f"{case}: convergence is guaranteed: within 30 cycles, 0.5 m and "
            "0.09 dB, in all trials", *ends.always("converged", case)) for case in (THREE, SEVEN)),
    *(Claim("rss", "Sec. 3.2", f"{case}: the search for the mode of a position is quite stable due "
            "to the prior: without the prior more trials have a search that moves a source by more "
            "than 100 m", ends.stable_by_prior(case))
      for case in (THREE, SEVEN)),
    *(Claim("rss", "Sec. 5", f"{case}: VB is competitive with ML: its location error is at most "
            "1.2 times as large", *rss.competitive(case)) for case in (THREE, SEVEN)),
    Claim("rss", "Sec. 4", "a VB cycle is an order of magnitude (here 5 times or more) faster than "
          "an ML iteration at K = 1", *times.faster(1, times.ORDER_OF_MAGNITUDE)),
    Claim("rss", "Sec. 4", "a VB cycle is significantly (2 times or more) faster than an ML "
          "iteration for more targets: K = 50", *times.faster(50, times.SIGNIFICANT)),
    Claim("rss", "Abstract, Sec. 1", "VB is linear in K: a cycle takes less than 20 times as long "
          "for 10 times the sources", *times.linear()),
    Claim("rss", "Sec. 1", "the direct solution is exponential in K: an iteration of ML takes more "
          "than 1000 times as long for 10 times the sources", *times.exponential()),
    Claim("rss-envelope", "Abstract, Sec. 2", "multiplicative Gaussian noise is accurate at "
          "moderate N: the distributions differ by at most 0.05, N = 10", env.accurate(LOG, 10),
          env.accurate(EXACT, 10)),
    Claim("rss-envelope", "Sec. 1", "so is the Gaussian approximation of the Chi distribution by "
          "moment matching, N = 10", env.accurate(AMPLITUDE, 10)),
    *(Claim("rss-envelope", "Sec. 2", f"{text} than with a {other}, N = 50", *decide)
      for other in (AMPLITUDE, ENERGY) for text, decide in (
        ("the bias of the range is smaller", (env.less_biased(LOG, other, 50),
                                              env.less_biased(EXACT, other, 50))),
        ("the error of the position is smaller", (env.nearer(LOG, other, 50),)),
        ("the stated error of the position is better", (env.better_stated(LOG, other, 50),)))),
    Claim("rss-envelope", "Sec. 1", "the envelope of a harmonic sound is circular Gaussian "
          "(synthetic sound)", env.gaussian),
    Claim("rss-envelope", "Sec. 2", "its samples are uncorrelated if they are sufficiently far "
          "apart, 15 ms", env.uncorrelated),
    *(Claim("rss-doppler", "Sec. 3", "Doppler's factor can be ignored at a moderate speed, "
            f"{speed} m/s: the error is at most 1.1 times that without it",
            *doppler.negligible(speed))
      for speed in doppler.SPEEDS),
)
# fmt: on
