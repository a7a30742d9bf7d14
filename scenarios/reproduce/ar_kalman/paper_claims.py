"""The claims of the paper and the report on autoregressive sources."""

from __future__ import annotations

from arrivals.scenarios.reproduce.ar_kalman import decisions as ar
from arrivals.scenarios.reproduce.ar_kalman.experiments import WIDE
from arrivals.scenarios.reproduce.claims import Claim

# fmt: off
CLAIMS: tuple[Claim, ...] = tuple(
    Claim("ar-kf", place, text, *decide) for place, text, decide in (
        ("Fig. 1", "the AR coefficients converge: rms error below 0.05",
         ar.under("ar error", 0.05, "30 dB", unit="rms of the coefficients")),
        ("Fig. 2", "the directions converge from 10 degrees off: RMSE below 0.5 degrees",
         ar.under("rmse", ar.CONVERGED, "30 dB")),
        ("Sec. 2, Fig. 2", "still sources have less error than by PAST",
         ar.better_than("past", "30 dB")),
        ("Fig. 3", "a moving source is tracked, N = 3: RMSE below half of the initial error",
         ar.under("rmse", ar.HALF, "N = 3, d = .5, .5", "N = 3, d = .5, 1")),
        ("Fig. 4", "a moving source is tracked, N = 30: RMSE below half of the initial error",
         ar.under("rmse", ar.HALF, "N = 30, d = .5, .5", "N = 30, d = .5, 1")),
        ("Sec. 2, Fig. 3", "a moving source has less error than by PAST, N = 3",
         ar.better_than("past", "N = 3, d = .5, 1")),
        ("Sec. 2, Fig. 4", "a moving source has less error than by PAST, N = 30",
         ar.better_than("past", "N = 30, d = .5, 1")),
        ("Sec. 4.2.1, Fig. 5", "lower SNR affects the directions more than the AR models, 10 to "
         "1 dB", ar.grows_more("1 dB", "10 dB")),
        ("Sec. 4.2.1, Fig. 5", "lower SNR mainly biases the directions: 10, 5, 1 dB",
         ar.mainly_bias("10 dB", "5 dB", "1 dB")),
        ("Sec. 4.2.2, Fig. 6", "more sensors bias less, M = 4 and 2",
         ar.lower("bias", "M = 4", "M = 2")),
        ("Sec. 4.2.2, Fig. 6", "more sensors have less variance, M = 4 and 2: spread",
         ar.lower("spread", "M = 4", "M = 2")),
        ("Sec. 4.2.2", "averaging over the pairs reduces the variance, M = 2: all, the inner one",
         ar.averaging()),
        ("Sec. 4.2.2, Fig. 6", "more sensors have no effect above 25 % on the AR models",
         ar.same("ar error", "M = 4", "M = 2", "rms of the coefficients")),
        ("Sec. 4.2.3, Fig. 7", "order 3 has no effect above 25 % on the directions",
         ar.same("rmse", "order 3", "30 dB")),
        ("Sec. 4.3", "the partial autocorrelation of speech gives order 1",
         (ar.order_of_voices, None)),
        ("Sec. 4.3, Fig. 8", "speech is tracked with order 1, 30, 10, 5 dB: RMSE below half of the "
         "initial error", ar.under("rmse", ar.HALF, *(f"speech, {n} dB" for n in (30, 10, 5)))),
        ("Sec. 4.3, Fig. 9", "order 2 fails on speech most of the time, 30, 10 dB: RMSE above "
         "half of the initial error",
         ar.fails(ar.HALF, *(f"speech, order 2, {n} dB" for n in (30, 10)))),
        ("Sec. 5", "it fails if the order is wrong, 1 in place of 2, 10 dB: RMSE more than twice "
         "that of the right order", ar.doubles("rmse", "order 1 for 2", "10 dB")),
        ("Sec. 5", "it fails if the order is wrong, 3 in place of 2, 10 dB: RMSE more than twice "
         "that of the right order", ar.doubles("rmse", "order 3 for 2", "10 dB")),
        ("Sec. 5", "it needs other methods for the initial AR models, 10 dB: from zero the RMSE "
         "is more than twice that from the right ones",
         ar.doubles("rmse", "a = 0 at the start", "10 dB")),
        ("Sec. 5", "it runs in real time", ar.in_real_time("speech, 10 dB")),
        ("Sec. 2", "it resolves as many sources as sensors, 3, 10 dB: RMSE below half of the "
         "initial error", ar.under("rmse", 1.5, "3 sources, 3 sensors")),
        ("Sec. 3, 5", "two sensors suffice for two sources, 10 dB: RMSE below half of the initial "
         "error",
         ar.under("rmse", 5.0, "2 sources, 2 sensors")),
        ("Sec. 3, 5", "two sensors suffice for three sources, 10 dB: RMSE below half of the "
         "initial error",
         ar.under("rmse", 5.0, "3 sources, 2 sensors")),
        *(("Sec. 5", f"accurate for a wide range of angles, {', '.join(f'±{d:g}' for d in WIDE)} "
           f"degrees, {n} dB: RMSE below half of the initial error",
           ar.under("rmse", 5.0, *(f"±{d:g}, {n} dB" for d in WIDE))) for n in (30, 10)),
        ("Abstract, Sec. 5", "robust to parameter changes: sensors and AR order of Sec. 4.2 "
         "and the window keep the RMSE below half of the initial error",
         ar.under("rmse", 5.0, "M = 2", "M = 3", "M = 4", "order 3", "still, N = 3")),
        ("Abstract, Sec. 5", "robust to parameter changes: the SNR of Sec. 4.2 keeps the RMSE "
         "below half of the initial error", ar.under("rmse", 5.0, "10 dB", "5 dB", "1 dB")),
        ("Sec. 5", "sources 10 degrees apart are resolved, 30 dB: RMSE below half of the initial "
         "error", ar.under("rmse", 1.25, "close, 30 dB")),
        ("Sec. 5", "sources 10 degrees apart are resolved, 10 dB: RMSE below half of the initial "
         "error", ar.under("rmse", 1.25, "10 degrees apart")),
        ("Sec. 5", "sources 10 degrees apart have less error than by MUSIC, 10 dB",
         ar.better_than("music", "10 degrees apart")),
        ("Sec. 5", "sources 5 degrees apart are resolved, 10 dB: RMSE below half of the initial "
         "error",
         ar.under("rmse", 0.625, "5 degrees apart")),
        ("Sec. 5", "sources 5 degrees apart have less error than by MUSIC, 10 dB",
         ar.better_than("music", "5 degrees apart")),
        ("Sec. 5", "small windows suffice: no effect above 25 % of N = 3 in place of 30, still "
         "sources, 10 dB", ar.same("rmse", "still, N = 3", "10 dB")),
        ("Sec. 5", "small windows adapt faster: a fast source has less error by N = 3 than by 30",
         ar.lower("rmse", "N = 3, d = .5, 1", "fast, N = 30")),
    )
)
# fmt: on
