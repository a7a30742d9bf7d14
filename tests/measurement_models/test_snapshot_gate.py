"""What counts as missing in a complex snapshot."""

import copy
import pickle
import warnings

import numpy as np
import pytest

from arrivals.measurement_models import ArraySnapshot, SensorArray
from arrivals.measurements import is_complete

SINGLE = ArraySnapshot(SensorArray.ula(5, spacing=0.5), wavelength=1.0)
WIDE = ArraySnapshot(SensorArray.ula(3, spacing=0.5), wavelength=[1.0, 1.2], n_snapshots=2)
Z = np.arange(1, 6) * (1 + 0.5j)


@pytest.mark.parametrize(
    "given",
    [
        np.ma.masked_array(np.where(np.arange(5) == 2, 1e6, Z), mask=np.arange(5) == 2),
        [*Z[:2], None, *Z[3:]],
        np.where(np.arange(5) == 2, np.inf, Z),
        np.where(np.arange(5) == 2, -1e200j, Z),
    ],
    ids=["masked", "None", "inf", "huge"],
)
def test_missing_number_is_nan(given: object) -> None:
    expected = np.where(np.arange(5) == 2, complex(np.nan, np.nan), Z)
    np.testing.assert_array_equal(SINGLE.snapshot(given), expected)  # type: ignore[arg-type]
    observed = SINGLE.observe(given)  # type: ignore[arg-type]
    assert observed is not None
    np.testing.assert_array_equal(observed.sensors, np.arange(5) != 2)


@pytest.mark.parametrize("z", [None, np.nan, np.zeros(5), np.full(5, np.inf), [1e-200] * 5])
def test_missing_or_zero_step_is_all_nan_without_a_warning(z: object) -> None:
    assert np.isnan(SINGLE.snapshot(z)).all()  # type: ignore[arg-type]
    assert SINGLE.observe(z) is None  # type: ignore[arg-type]


def test_channel_of_zeros_is_missing_with_one_warning_a_channel() -> None:
    model = SINGLE.replace(noise=0.5)
    z = np.where(np.isin(np.arange(5), [1, 3]), 0, Z)
    with pytest.warns(UserWarning, match=r"channels 1, 3 have zeros alone in a step"):
        y = model.snapshot(z)
    np.testing.assert_array_equal(np.isnan(y), z == 0)
    model.snapshot(z)  # reported before
    with pytest.warns(UserWarning, match=r"channel 0 has zeros alone"):
        model.snapshot(np.where(np.arange(5) == 0, 0, z))
    assert model == SINGLE.replace(noise=0.5)
    assert copy.deepcopy(model) is model
    assert pickle.loads(pickle.dumps(model)) == model


def test_zeros_of_one_bin_or_snapshot_are_data_of_a_channel() -> None:
    z = np.ones((2, 2, 3), dtype=complex)
    z[0, :, 1], z[1, 0, 2] = 0, 0
    np.testing.assert_array_equal(WIDE.snapshot(z), z)
    z[1, 0, 1], z[1, 1, 1] = 0, np.nan
    with pytest.warns(UserWarning, match="channel 1 has"):
        y = WIDE.snapshot(z)
    np.testing.assert_array_equal(np.isnan(y).all(axis=(0, 1)), [False, True, False])


def test_channel_that_is_nan_gives_no_warning() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        SINGLE.snapshot(np.where(np.arange(5) == 2, np.nan, Z))


def test_likelihood_leaves_out_masked_numbers() -> None:
    masked = np.ma.masked_array(Z, mask=np.arange(5) == 4)
    nan = np.where(np.arange(5) == 4, np.nan, Z)
    doa = np.array([[0.1], [0.4]])
    expected = SINGLE.log_likelihood(nan, doa)
    np.testing.assert_array_equal(SINGLE.log_likelihood(masked, doa), expected)


@pytest.mark.parametrize("size", [1e-139, 1.0, 1e75, 9e139])
def test_valid_numbers_of_any_size_are_the_measurement(size: float) -> None:
    model = ArraySnapshot(SensorArray.ula(3, 0.5), 1.0, n_snapshots=2)
    z = size * np.exp(1j * np.arange(6.0)).reshape(2, 3)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        np.testing.assert_array_equal(model.snapshot(z), z)


def test_is_complete_finds_one_nan_in_arrays_of_any_layout() -> None:
    z = np.full((2, 3, 4), 1e200 + 1j)  # the sum of squares overflows
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for scale in (1.0, 1e-200):
            y = scale * z
            views = [y, y.swapaxes(1, 2), y[..., 1::2], y.imag]
            assert all(map(is_complete, views))
            y[1, 2, 3] = complex(1.0, np.nan)
            assert not any(map(is_complete, views))
