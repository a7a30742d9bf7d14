"""Figures on the statistic of signal strength."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from arrivals.plots.colours import PALETTE
from arrivals.plots.labels import legend_above
from arrivals.scenarios.bounds.detection import (
    amplitude_gaussian_detection,
    exact_detection,
    log_gaussian_detection,
    true_false_alarm,
)
from arrivals.scenarios.reproduce.signal_strength.drive_by import (
    CARRIER,
    FAR_SEGMENTS,
    RATE,
    SEGMENT,
    EnvelopeLaw,
    envelope,
)
from arrivals.scenarios.reproduce.signal_strength.envelope_decisions import (
    NUMBERS,
    EnvelopeResults,
)
from arrivals.scenarios.reproduce.signal_strength.range_estimates import (
    AMPLITUDE,
    ENERGY,
    EXACT,
    LOG,
    distribution_distance,
    range_bound,
)
from arrivals.typing import Float

if TYPE_CHECKING:
    from matplotlib.figure import Figure

COLOURS = {LOG: PALETTE[0], EXACT: PALETTE[2], AMPLITUDE: PALETTE[3], ENERGY: PALETTE[6]}
MARKS = {LOG: "o", EXACT: "s", AMPLITUDE: "^", ENERGY: "v"}


def draw_drive_by(sound: Float, law: EnvelopeLaw) -> Figure:
    """Draw Fig. 2, sound and envelope, and the law of envelope samples."""
    from matplotlib.figure import Figure
    from scipy.special import ndtri

    figure = Figure(figsize=(12.0, 5.4), layout="constrained")
    grid = figure.add_gridspec(2, 2, width_ratios=[1.3, 1])
    top, bottom, normal, lags = (figure.add_subplot(grid[n % 2, n // 2]) for n in range(4))
    t = 1e3 * np.arange(len(sound)) / RATE
    top.plot(t, sound, color=PALETTE[0], linewidth=1, label="sound")
    z = envelope(sound)
    part = SEGMENT * 1e3 / RATE
    centres = part * (np.arange(len(z)) + 0.5)
    segment = np.repeat(z, SEGMENT) * np.exp(2e-3j * np.pi * CARRIER * t)
    top.plot(t, segment.real, "--", color=PALETTE[1], linewidth=0.9,
             label="sinusoid of 1100 Hz with the envelope of the segment")  # fmt: skip
    bottom.plot(centres, z.real, "-", color=PALETTE[0], label="real part")
    bottom.plot(centres, z.imag, "o", color=PALETTE[3], label="imaginary part")
    for ax in (top, bottom):
        for edge in part * np.arange(1, len(z)):
            ax.axvline(edge, color="0.7", linewidth=0.8, zorder=0)
        legend_above(ax, 2)
    top.set_title("synthetic drive-by sound, 48 kHz, N = 4 segments", pad=24)
    top.set(ylabel="amplitude", ylim=(1.1 * sound.min(), 1.1 * sound.max()))
    bottom.set(xlabel="time, ms", ylabel="complex envelope", xlim=top.get_xlim())
    x = np.sort(law.samples)
    normal.plot(ndtri((np.arange(len(x)) + 0.5) / len(x)), x, ".", markersize=2, color=PALETTE[0],
                label="real and imaginary parts")  # fmt: skip
    normal.plot([-3, 3], [-3, 3], color="0.4", linewidth=0.8, label="Gaussian")
    normal.set(xlabel="Gaussian quantile", ylabel="quantile of the envelope")
    lags.plot(part * np.arange(len(law.correlation)), law.correlation, "o-", color=PALETTE[0],
              label="correlation of the envelope")  # fmt: skip
    lags.axhline(law.limit, color="0.4", linestyle="--", label="95 % of independent samples")
    lags.axvline(part * FAR_SEGMENTS, color="0.7", linewidth=0.8, label="far apart")
    lags.set(xlabel="lag, ms", ylabel="correlation", ylim=(0, 1.05))
    legend_above(normal, 2)
    legend_above(lags, 3)
    return figure


def draw_detection(snr_db: float, numbers: tuple[int, ...]) -> Figure:
    """Draw receiver operating characteristics: what each form states, and what is true."""
    from matplotlib.figure import Figure
    from matplotlib.layout_engine import ConstrainedLayoutEngine

    figure = Figure(figsize=(12.0, 4.0), layout=ConstrainedLayoutEngine(wspace=0.06))
    alarm, snr = np.logspace(-4, -0.02, 200), 10 ** (snr_db / 10)
    for n, (ax, N) in enumerate(zip(figure.subplots(1, 3, sharey=True), numbers, strict=True)):
        log, amplitude = true_false_alarm(alarm, N)
        stated_log = log_gaussian_detection(alarm, N, snr)
        stated_amplitude = amplitude_gaussian_detection(alarm, N, snr)
        ax.semilogx(alarm, exact_detection(alarm, N, snr), color="k", label="exact")
        ax.semilogx(alarm, stated_log, "--", color=COLOURS[LOG], label="log-Gaussian, as stated")
        ax.semilogx(alarm, stated_amplitude, "-.", color=COLOURS[AMPLITUDE],
                    label="Gaussian amplitude, as stated")  # fmt: skip
        for nominal, true, colour, stated in (
            (0.01, log, COLOURS[LOG], stated_log),
            (0.01, amplitude, COLOURS[AMPLITUDE], stated_amplitude),
        ):
            here = float(np.interp(nominal, alarm, true))
            ax.plot(nominal, np.interp(nominal, alarm, stated), "o", color=colour, fillstyle="none",
                    label="_")  # fmt: skip
            ax.plot(here, float(exact_detection(here, N, snr)), "o", color=colour, label="_")
        ax.set(xlabel="probability of false alarm", title=f"({'abc'[n]}) N = {N}", ylim=(0, 1.02),
               xlim=(1e-4, 1))  # fmt: skip
        ax.grid(alpha=0.3)
    first = figure.axes[0]
    first.set_ylabel(f"probability of detection at {snr_db:g} dB")
    lines = first.get_lines()
    handles = [lines[0], lines[1], lines[2], lines[3], lines[4]]
    names = ["exact", "log-Gaussian, as stated", "Gaussian amplitude, as stated",
             "threshold for 1 %, as stated", "the same threshold, true"]  # fmt: skip
    figure.legend(handles, names, fontsize=8, loc="outside upper center", ncols=5, frameon=False)
    return figure


def draw_ranges(results: EnvelopeResults) -> Figure:
    """Draw distances of distributions, biases and errors of ranges, and errors of positions."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(14.0, 4.2), layout="constrained")
    axes = figure.subplots(1, 4)
    many = np.array([1, 2, 4, 8, 16, 32, 64, 128, 256])
    for form, colour in COLOURS.items():
        distance = [distribution_distance(form, int(N)) for N in many]
        axes[0].loglog(many, distance, color=colour, marker=MARKS[form], label=form, markersize=4)
        ranges = [100 * results.ranges[form, N].error for N in NUMBERS]
        error = [2 * float(e.std()) / np.sqrt(len(e)) for e in ranges]
        axes[1].errorbar(NUMBERS, [float(e.mean()) for e in ranges], error, color=colour,
                         marker=MARKS[form], capsize=3, label="_")  # fmt: skip
        spread = np.array([float(e.std()) for e in ranges])
        axes[2].errorbar(NUMBERS, spread, 2 * spread / np.sqrt(2 * len(ranges[0])), color=colour,
                         marker=MARKS[form], capsize=3, label="_")  # fmt: skip
        if form != EXACT:
            e2 = [np.square(results.positions[form, N].error).sum(axis=1) for N in NUMBERS]
            rms = np.array([float(np.sqrt(e.mean())) for e in e2])
            half = [
                float(e.std() / np.sqrt(len(e)) / r)  # 2 errors of the root
                for e, r in zip(e2, rms, strict=True)
            ]
            axes[3].errorbar(NUMBERS, rms, half, color=colour, marker=MARKS[form], capsize=3,
                             label="_")  # fmt: skip
    axes[2].plot(NUMBERS, [100 * range_bound(N) for N in NUMBERS], "k:", label="Cramér-Rao bound")
    bounds = [float(np.sqrt(np.square(results.bounds[N]).mean())) for N in NUMBERS]
    axes[3].plot(NUMBERS, bounds, "k:", label="_")
    for ax in axes[1:]:
        ax.set(xscale="log", yscale="log")
        ax.set_xticks(NUMBERS, [str(N) for N in NUMBERS])
    labels = ("distance of distributions", "bias of the range, %", "deviation of the range, %",
              "error of the position, network, m")  # fmt: skip
    for letter, ax, label in zip("abcd", axes, labels, strict=True):
        ax.set(xlabel="snapshots N", title=f"({letter}) {label}")
        ax.title.set_fontsize(10)
    handles = [line for ax in (axes[0], axes[2]) for line in ax.get_lines()
               if not str(line.get_label()).startswith("_")]  # fmt: skip
    figure.legend(handles=handles, fontsize=8, loc="outside upper center", ncols=5, frameon=False,
                  title="bars: two standard errors", title_fontsize=8)  # fmt: skip
    return figure
