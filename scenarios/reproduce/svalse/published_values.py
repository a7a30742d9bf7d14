"""Published values of the paper on SVALSE, and those of its methods as reimplemented.

The paper has single runs. "Rebuilt": the published programs, or the methods as the paper prints
them (first sensor as phase reference, tolerance 1e-6), many runs; GOSPA and RMSE in degrees.
"""

from __future__ import annotations

from typing import NamedTuple


class Rebuilt(NamedTuple):
    """Mean and standard deviation over runs of GOSPA, its range, and the mean RMSE, degrees."""

    gospa: float
    std: float
    minimum: float
    maximum: float
    rmse: float


# Figs 4 to 6 at 20 dB, 20 runs
REBUILT: dict[str, dict[str, Rebuilt]] = {
    "svalse_fig4": {
        "valse": Rebuilt(13.48, 0.88, 11.30, 15.62, 4.63),
        "svalse": Rebuilt(5.81, 0.47, 5.05, 6.64, 1.84),
        "sbl": Rebuilt(11.63, 0.78, 10.10, 13.74, 3.16),
        "ssbl": Rebuilt(6.43, 0.52, 5.51, 7.48, 1.95),
    },
    "svalse_fig5": {
        "valse": Rebuilt(4.24, 0.53, 3.28, 5.24, 2.15),
        "svalse": Rebuilt(2.83, 0.42, 2.25, 3.94, 1.11),
        "sbl": Rebuilt(4.15, 0.50, 3.60, 5.28, 1.52),
        "ssbl": Rebuilt(3.35, 0.42, 2.63, 4.22, 1.22),
    },
    "svalse_fig5b": {
        "valse": Rebuilt(3.97, 1.20, 2.30, 5.64, 1.87),
        "svalse": Rebuilt(2.66, 0.69, 1.85, 3.82, 0.93),
        "sbl": Rebuilt(3.95, 1.21, 2.24, 5.64, 1.37),
        "ssbl": Rebuilt(2.95, 0.53, 2.07, 3.92, 0.98),
    },
    "svalse_fig6": {
        "valse": Rebuilt(4.56, 0.55, 3.49, 5.54, 2.14),
        "svalse": Rebuilt(2.47, 0.23, 1.95, 3.13, 0.99),
        "sbl": Rebuilt(4.62, 0.55, 3.88, 5.98, 1.64),
        "ssbl": Rebuilt(2.87, 0.34, 2.40, 3.63, 1.09),
    },
}
# GOSPA of the paper's single runs
PAPER: dict[str, dict[str, float]] = {
    "svalse_fig4": {"valse": 12.27, "svalse": 4.87},
    "svalse_fig5": {"valse": 4.62, "svalse": 2.69},
    "svalse_fig6": {"valse": 4.60, "svalse": 1.91},
}


class Activation(NamedTuple):
    """Fig. 7: rebuilt GOSPA (mean, std) and RMSE, and the paper's GOSPA and RMSE, degrees."""

    gospa: float
    std: float
    rmse: float
    paper: float
    paper_rmse: float


# Fig. 7 by (p_deactivate, p_activate); 6 runs, the fourth 3
ACTIVATION: dict[tuple[float, float], Activation] = {
    (0.0, 0.10): Activation(11.82, 0.83, 0.66, 10.74, 0.83),
    (1.0, 0.10): Activation(11.79, 0.15, 6.01, 11.32, 6.67),
    (0.25, 0.0): Activation(11.12, 2.95, 5.54, 8.06, 5.36),
    (0.25, 1.0): Activation(19.85, 0.77, 1.17, 25.79, 1.60),
    (0.25, 0.10): Activation(2.34, 0.22, 0.94, 1.91, float("nan")),
}

SWEPT = ("sbl", "ssbl", "valse", "svalse")
# Figs 8 to 10: (GOSPA, RMSE) of SWEPT by SNR, dB; means of 3 runs
SWEEP: dict[str, dict[float, tuple[tuple[float, float], ...]]] = {
    "svalse_scenario1": {
        0.0: ((39.5, 3.04), (39.2, 2.87), (12.1, 7.65), (7.6, 2.49)),
        5.0: ((31.5, 1.87), (30.8, 1.6), (7.1, 3.66), (4.0, 1.07)),
        10.0: ((20.7, 1.3), (19.2, 0.94), (3.8, 2.07), (2.0, 0.68)),
        15.0: ((7.8, 0.79), (5.9, 0.52), (2.2, 1.1), (1.5, 0.49)),
        20.0: ((2.1, 0.46), (1.2, 0.33), (1.5, 0.76), (0.7, 0.28)),
        25.0: ((0.6, 0.22), (0.4, 0.13), (1.4, 0.79), (0.4, 0.16)),
        30.0: ((0.3, 0.12), (0.1, 0.04), (1.4, 0.92), (0.3, 0.1)),
        35.0: ((0.2, 0.07), (0.1, 0.02), (1.4, 0.55), (0.2, 0.06)),
        40.0: ((0.1, 0.03), (0.0, 0.0), (2.1, 0.93), (0.1, 0.03)),
    },
    "svalse_scenario2": {
        0.0: ((45.0, 5.52), (44.3, 5.36), (28.3, 9.22), (21.5, 6.86)),
        5.0: ((38.1, 4.96), (36.7, 4.55), (23.6, 7.69), (15.0, 5.03)),
        10.0: ((29.8, 4.49), (25.0, 3.48), (18.3, 5.94), (10.5, 3.42)),
        15.0: ((19.6, 4.09), (12.6, 2.51), (16.2, 4.85), (7.5, 2.35)),
        20.0: ((15.1, 3.84), (7.1, 2.04), (14.7, 4.48), (6.2, 1.74)),
        25.0: ((13.6, 3.46), (3.8, 1.28), (13.6, 4.11), (4.4, 1.16)),
        30.0: ((13.1, 3.47), (3.4, 1.37), (13.6, 4.1), (3.6, 1.02)),
        35.0: ((13.4, 3.55), (2.3, 1.08), (13.4, 4.02), (3.0, 0.83)),
        40.0: ((11.5, 2.95), (1.6, 0.76), (12.7, 3.77), (2.3, 0.58)),
    },
}
