"""Laws of densities on a grid of directions, and of the levels of bins."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from arrivals.trackers.wideband.bin_selection import BinLevels
from arrivals.trackers.wideband.direction_grid import DirectionGrid
from arrivals.trackers.wideband.settings import MixtureSettings

GRIDS = [DirectionGrid(False, np.deg2rad(3.0)), DirectionGrid(True, np.deg2rad(3.0))]
SETTINGS = MixtureSettings()


@pytest.mark.parametrize("grid", GRIDS, ids=["circle", "line"])
@given(one=st.floats(0, 0.5), other=st.floats(0, 0.5))
@settings(max_examples=20, deadline=None)
def test_walks_in_a_row_are_one_walk_of_the_sum(
    grid: DirectionGrid, one: float, other: float
) -> None:
    both = grid.walk(one) @ grid.walk(other)
    np.testing.assert_allclose(both, grid.walk(one + other), atol=1e-9)
    np.testing.assert_allclose(both.sum(axis=1), 1)
    assert both.min() >= 0


@pytest.mark.parametrize("grid", GRIDS, ids=["circle", "line"])
def test_walk_has_the_variance_of_the_motion_however_short(grid: DirectionGrid) -> None:
    middle = len(grid.doa) // 2
    for degrees in (0.1, 1.0, 8.0):
        variance = np.deg2rad(degrees) ** 2
        density = grid.walk(variance)[middle]
        assert density @ grid.offset[middle] ** 2 == pytest.approx(variance, rel=1e-6)


def test_very_long_walk_is_uniform() -> None:
    for grid in GRIDS:
        np.testing.assert_allclose(grid.walk(1e300), 1 / len(grid.doa), atol=1e-6)


@pytest.mark.parametrize("grid", GRIDS, ids=["circle", "line"])
@given(doa=st.floats(-1.2, 1.2), std=st.floats(0.01, 0.09))
@settings(max_examples=30, deadline=None)
def test_moments_are_those_of_a_sampled_density(
    grid: DirectionGrid, doa: float, std: float
) -> None:
    density = np.exp(-0.5 * (grid.difference(grid.doa, np.array(doa)) / std) ** 2)
    mean, variance = grid.moments(density[None] / density.sum(), SETTINGS.peak_half_width)
    assert abs(mean[0] - doa) < 0.02 * std + 1e-3
    assert np.sqrt(variance[0]) == pytest.approx(std, rel=0.1)


def test_mean_of_a_circle_does_not_depend_on_its_seam() -> None:
    grid = GRIDS[0]
    density = np.exp(40 * np.cos(grid.doa - np.pi + 0.01))[None]
    mean, _ = grid.moments(density / density.sum(), SETTINGS.peak_half_width)
    assert abs(np.angle(np.exp(1j * (mean[0] - np.pi + 0.01)))) < 3e-3


@given(seed=st.integers(0, 1000), seconds=st.floats(0.01, 0.5))
@settings(max_examples=30, deadline=None)
def test_onsets_of_a_step_are_those_of_its_snapshots_one_by_one(seed: int, seconds: float) -> None:
    energy = np.random.default_rng(seed).exponential(size=(3, 6)) ** 3
    levels, _, onset = BinLevels.empty(3).after(energy, seconds, SETTINGS)
    one_by_one, onsets = BinLevels.empty(3), []
    for snapshot in energy.T:
        one_by_one, _, each = one_by_one.after(snapshot[:, None], seconds / 6, SETTINGS)
        onsets.append(each[:, 0])
    np.testing.assert_array_equal(onset, np.transpose(onsets))
    np.testing.assert_allclose(levels.peak, one_by_one.peak)


def test_echo_is_no_onset_until_the_peak_has_fallen() -> None:
    """Sound, its echo 6 dB below 32 ms later, and a new sound after 300 ms."""
    energy = np.full((1, 24), 1e-6)
    energy[0, [2, 4, 20]] = 1.0, 0.25, 0.5
    _, loud, onset = BinLevels.empty(1).after(energy, 24 * 0.016, SETTINGS)
    assert loud[0, [2, 4, 20]].all()
    assert onset[0, [2, 4, 20]].tolist() == [True, False, True]


def test_floor_follows_the_noise_and_rises_slowly() -> None:
    rng = np.random.default_rng(0)
    levels = BinLevels.empty(50)
    for _ in range(40):
        levels, loud, _ = levels.after(rng.gamma(6, size=(50, 8)), 0.128, SETTINGS)
    assert 10 * np.log10(6) - 3 < levels.floor.mean() < 10 * np.log10(6) + 3
    assert loud.mean() < 0.03
    later = levels.later(2.0, SETTINGS)
    np.testing.assert_allclose(later.floor - levels.floor, 2.0 * SETTINGS.floor_rise)


def test_bins_without_data_or_power_keep_their_levels_and_do_not_count() -> None:
    first, _, _ = BinLevels.empty(2).after(np.ones((2, 4)), 0.1, SETTINGS)
    energy = np.array([[np.nan] * 4, [0.0] * 4])
    levels, loud, onset = first.after(energy, 0.1, SETTINGS)
    expected = first.later(0.1, SETTINGS)
    np.testing.assert_allclose(levels.floor, expected.floor)
    np.testing.assert_allclose(levels.peak, expected.peak)
    assert not (loud | onset).any()


@pytest.mark.parametrize("onset_db", [-1.0, 0.0, 1.0])
def test_bins_near_the_highest_before_count_if_onset_db_is_negative(onset_db: float) -> None:
    level = np.array([[0.0, -0.5, 0.7, 2.0]])  # dB
    steady = MixtureSettings(onset_db=onset_db, decay=0.0)
    _, _, onset = BinLevels.empty(1).after(10 ** (level / 10), 0.1, steady)
    assert onset[0].tolist() == [True, onset_db < -0.5, onset_db < 0.7, True]


def test_zeros_in_part_of_a_step_are_no_noise_floor() -> None:
    """After a drop-out of one snapshot, noise would be louder than its floor for hours."""
    energy = np.random.default_rng(1).gamma(6, size=(5, 8))
    dropped = energy.copy()
    dropped[:, 2] = 0.0
    levels, loud, onset = BinLevels.empty(5).after(dropped, 0.128, SETTINGS)
    others = np.delete(energy, 2, axis=1)
    np.testing.assert_allclose(levels.floor, 10 * np.log10(2 * others.min(axis=1)))
    assert not (loud | onset)[:, 2].any()


@pytest.mark.parametrize(
    ("name", "value"),
    [("tempering", 0.0), ("iterations", 0), ("background", 1.5), ("memory", -1.0),
     ("diffuse", "yes"), ("max_sources", 1.5), ("floor_db", np.nan), ("onset_db", np.nan),
     ("onset_db", -1e4)],
)  # fmt: skip
def test_setting_out_of_range_is_refused_by_name(name: str, value: object) -> None:
    with pytest.raises((ValueError, TypeError), match=f"^{name} must"):
        MixtureSettings(**{name: value})  # type: ignore[arg-type]
