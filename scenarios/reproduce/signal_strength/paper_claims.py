"""The claims of the paper on signal strength."""

from __future__ import annotations

from arrivals.scenarios.reproduce.claims import Claim
from arrivals.scenarios.reproduce.rss import decisions as rss
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
    Claim("rss", "Fig. 4(d), Sec. 4", "three close targets: the powers of ML have a larger spread "
          "than those of VB", *rss.smaller("power_std", THREE, True)),
    Claim("rss", "Fig. 4(d), Sec. 4", "three close targets: the powers of ML have a shoulder: more "
          "of them are above 84 dB than of VB", *rss.smaller("shoulder", THREE, True)),
    Claim("rss", "Fig. 4(h), Sec. 4", "seven targets: ML outperforms VB in the powers (their "
          "error; Table 1 has the reverse)", *rss.smaller("amplitude_rms", SEVEN, False)),
    Claim("rss", "Fig. 4(c), Sec. 4", "ML has a smaller location error from a start that follows "
          "the prior than from a random one",
          rss.between_cases("location_rms", ("K=3 prior", rss.ML), (THREE, rss.ML))),
    *(Claim("rss", "Sec. 4", f"{case}: {text}", *decide) for case in (THREE, SEVEN)
      for text, decide in (
        ("ML ends near local maxima more often than VB", rss.more_stuck(case)),
        ("most ML solutions near local maxima are not visible in the fit", (rss.hidden(case),)))),
    *(Claim("rss", "Sec. 4", f"{case}: VB converges in fewer than 10 cycles in most cases: it is "
            "then within 1 m and 0.5 dB of its end", *rss.mostly("settled", case))
      for case in (THREE, SEVEN, rss.ONE)),
    *(Claim("rss", "Sec. 4", f"{case}: fewer than 10 cycles are enough: the location error after 9 "
            "is at most 1.1 times that after 30", *rss.as_good_after_few(case))
      for case in (THREE, SEVEN)),
    *(Claim("rss", "Sec. 3", f"{case}: convergence is guaranteed: within 30 cycles, 0.5 m and "
            "0.01 Np, in all trials", *rss.always("converged", case)) for case in (THREE, SEVEN)),
    *(Claim("rss", "Sec. 3.2", f"{case}: the updates are quite stable due to the prior: jumps of "
            "more than 100 m are below a hundredth", *rss.seldom("jumped", case))
      for case in (THREE, SEVEN)),
    Claim("rss", "Sec. 4", "a VB cycle is an order of magnitude faster than an ML iteration at "
          "K = 1", *rss.faster(1)),
    Claim("rss", "Sec. 4", "it is significantly faster for more targets: K = 50", *rss.faster(50)),
    Claim("rss", "Abstract, Sec. 1", "VB is linear in K: a cycle takes less than 20 times as long",
          *rss.linear()),
    Claim("rss", "Sec. 1", "the direct solution is exponential in K: an iteration takes more than "
          "1000 times as long", *rss.exponential()),
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
