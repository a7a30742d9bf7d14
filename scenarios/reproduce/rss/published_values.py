"""Table 1 of the paper on signal strength."""

from __future__ import annotations

from typing import NamedTuple


class Published(NamedTuple):
    """A row of Table 1: amplitude bias and RMS error, dB; location bias and RMS error, m."""

    amplitude_bias: float
    amplitude_rms: float
    location_bias: float
    location_rms: float


THREE, SEVEN = "K=3 random", "K=7 prior"
# The second column is headed K=1 in the text that we have; its prose has seven targets.
TABLE_1: dict[tuple[str, str], Published] = {
    (THREE, "vb_literal"): Published(0.17, 2.41, 0.43, 8.47),
    (THREE, "lm"): Published(1.24, 3.1, 2.14, 14.1),
    (SEVEN, "vb_literal"): Published(0.15, 2.28, 0.54, 7.33),
    (SEVEN, "lm"): Published(-0.12, 2.36, 0.08, 9.12),
}
VB_ITERATIONS = 30  # VBIts of the paper
FEW_ITERATIONS = 9  # fewer than 10
