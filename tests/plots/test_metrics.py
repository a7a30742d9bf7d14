"""Plots of metrics over steps and of calibration: means, bands, intervals, legends."""

from typing import Any

import numpy as np
import pytest
from scipy.stats import beta, norm

from arrivals.plots import plot_coverage, plot_metric, plot_reliability
from arrivals.plots.colours import METHOD_COLOURS
from arrivals.scenarios import create, monte_carlo, reliability


def beside(ax: Any) -> bool:
    """Return True if the legend is beside the axes, within the figure."""
    ax.figure.draw_without_rendering()
    legend = ax.get_legend().get_window_extent()
    return bool(legend.x0 >= ax.get_window_extent().x1 and legend.x1 <= ax.figure.bbox.x1)


def test_metric_over_steps_is_the_mean_of_the_runs_in_a_band_of_most() -> None:
    values = np.random.default_rng(0).gamma(2.0, 1.0, (40, 5))
    values[:, 3] = np.nan
    values[0, 1] = np.nan
    ax: Any = plot_metric({"svalse": values, "mine": values + 1}, "gospa")
    kept = [0, 1, 2, 4]
    for line, shift in zip(ax.lines, (0, 1), strict=True):
        np.testing.assert_array_equal(line.get_xdata(), kept)
        np.testing.assert_allclose(line.get_ydata(), np.nanmean(values[:, kept], axis=0) + shift)
    vertices = ax.collections[0].get_paths()[0].vertices
    at_2 = vertices[vertices[:, 0] == 2, 1]
    np.testing.assert_allclose([at_2.min(), at_2.max()], np.percentile(values[:, 2], [10, 90]))
    assert ax.lines[0].get_color() == METHOD_COLOURS["svalse"]
    assert ax.lines[1].get_color() not in METHOD_COLOURS.values()
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("step", "GOSPA")
    assert beside(ax)


def test_metric_of_a_study_has_its_legend_beside_the_axes() -> None:
    study = monte_carlo([create("svalse_fig6", n_steps=3)], ["cbf"], runs=2)
    assert beside(plot_metric(study, "gospa"))


def test_metric_over_steps_refuses_wrong_arguments() -> None:
    values = {"svalse": np.ones((2, 3))}
    with pytest.raises(ValueError, match=r"x must be None for metrics over steps; got 'snr_db'"):
        plot_metric(values, "gospa", x="snr_db")
    with pytest.raises(ValueError, match=r"svalse must have shape \(n_runs, n_steps\); got \(3,\)"):
        plot_metric({"svalse": [1.0, 2.0, 3.0]}, "gospa")
    for value in (np.nan, np.inf):
        with pytest.raises(ValueError, match="svalse must have finite values, or NaN in part; got"):
            plot_metric({"svalse": np.full((2, 3), value)}, "gospa")
    with pytest.raises(ValueError, match=r"methods must be in \['svalse'\]; got 'svals'"):
        plot_metric(values, "gospa", methods=["svals"])


def test_reliability_of_deviations_is_on_the_diagonal_if_they_are_true() -> None:
    rng = np.random.default_rng(0)
    std = rng.uniform(0.1, 5.0, 4000)
    ax = plot_reliability(std, std * rng.standard_normal(4000), label="true")
    plot_reliability(std, 2 * std * rng.standard_normal(4000), label="half", ax=ax)
    _, honest, sure = ax.lines[0], *[c.lines[0] for c in ax.containers]  # type: ignore[attr-defined]
    level = np.asarray(honest.get_xdata())
    np.testing.assert_allclose(honest.get_ydata(), level, atol=0.03)
    expected = 2 * norm.cdf(norm.ppf((1 + level) / 2) / 2) - 1
    np.testing.assert_allclose(sure.get_ydata(), expected, atol=0.03)
    assert beside(ax)


def test_reliability_intervals_hold_the_share_and_are_near_those_of_a_beta() -> None:
    table = reliability(np.repeat([0.25, 0.85], 40), np.arange(80) % 4 == 0).table
    ax = plot_reliability(table)
    bars = ax.containers[0].lines[2][0].get_segments()  # type: ignore[attr-defined]
    assert len(bars) == len(table.count)
    for bar, n, share in zip(bars, table.count, table.observed, strict=True):
        low, high = bar[:, 1]
        assert low < share < high
        exact = beta.ppf([0.025, 0.975], n * share + 0.5, n * (1 - share) + 0.5)  # Jeffreys
        np.testing.assert_allclose([low, high], exact, atol=0.03)


def test_reliability_refuses_wrong_arguments() -> None:
    with pytest.raises(TypeError, match="stated must be a table of reliability, or have errors"):
        plot_reliability([0.5, 0.6])
    with pytest.raises(ValueError, match=r"errors must have shape \(2,\); got \(3,\)"):
        plot_reliability([0.5, 0.6], [1.0, 2.0, 3.0])
    with pytest.raises(ValueError, match="stated must be positive deviations; got"):
        plot_reliability([0.5, 0.0], [1.0, 2.0])
    with pytest.raises(ValueError, match="stated must be positive deviations; got"):
        plot_reliability([np.nan], [1.0])


def test_coverage_has_its_legend_beside_the_axes() -> None:
    assert beside(plot_coverage({"walk": [0.67, 0.95]}, [0.68, 0.95]))
