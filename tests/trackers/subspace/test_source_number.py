"""Number of sources by information criteria."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from subspace_scenes import LINE, NAMES, incoherent

from arrivals.trackers import MUSIC, create
from arrivals.trackers.subspace import aic, mdl, number_of_sources

WAX_KAILATH = [21.2359, 2.1717, 1.4279, 1.0979, 1.0544, 0.9432, 0.7324]


def test_criteria_reproduce_the_example_of_wax_and_kailath() -> None:
    expected_aic = [1180.8, 100.5, 71.4, 75.5, 86.8, 93.2, 96.0]
    expected_mdl = [590.4, 67.2, 66.9, 80.7, 95.5, 105.2, 110.5]
    np.testing.assert_allclose(aic(WAX_KAILATH, 100), expected_aic, atol=0.1)
    np.testing.assert_allclose(mdl(WAX_KAILATH, 100), expected_mdl, atol=0.1)


@given(st.floats(1e-150, 1e150), st.permutations(WAX_KAILATH))
def test_mdl_does_not_depend_on_unit_or_order_of_eigenvalues(
    unit: float, values: list[float]
) -> None:
    scaled = unit * np.array(values)
    np.testing.assert_allclose(mdl(scaled, 100), mdl(WAX_KAILATH, 100), rtol=1e-9)


def test_number_of_sources_of_equal_eigenvalues_is_zero_and_batches_equal_single_cases() -> None:
    batch = np.array([[3.0, 3.0, 3.0], [9.0, 3.0, 3.0], [90.0, 40.0, 3.0]])
    for criterion in ("aic", "mdl"):
        estimate = number_of_sources(batch, 80, criterion)
        np.testing.assert_array_equal(estimate, [0, 1, 2])
        singles = [number_of_sources(values, 80, criterion) for values in batch]
        np.testing.assert_array_equal(estimate, singles)


def test_number_of_sources_is_below_number_of_snapshots() -> None:
    values = [5.0, 4.0, 0.0, 0.0, 0.0]
    assert np.isinf(mdl(values, 2)[2:]).all()
    assert number_of_sources(values, 1) == 0
    assert number_of_sources([1.0, 1.0, 1e-17, 1e-18], 100) == 2  # rounding is not a third


@pytest.mark.parametrize("values", [[], 3.0, [1.0, np.nan]])
def test_criteria_refuse_invalid_arguments(values: object) -> None:
    with pytest.raises(ValueError, match="eigenvalues must be finite"):
        mdl(values, 10)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="n_snapshots must be finite and positive"):
        aic([1.0], 0)
    with pytest.raises(ValueError, match="criterion must be one of 'aic', 'mdl'"):
        number_of_sources([1.0], 5, "bic")  # type: ignore[arg-type]


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("doa", [[], [0.3], [0.3, -0.5], [0.3, -0.5, 0.9]])
def test_mdl_estimates_the_number_of_active_sources(name: str, doa: list[float]) -> None:
    z, _ = incoherent(LINE.replace(noise=0.1), doa, n=120)
    run = create(name, measurement=LINE).run(z)
    assert (run.n_found[60:] == len(doa)).mean() > 0.95
    np.testing.assert_allclose(run.doa[-1, : len(doa)], sorted(doa), atol=0.05)


def test_number_of_sources_follows_sources_that_start_and_stop() -> None:
    doa = np.full((250, 2), [0.4, -0.3])
    doa[50:200, 1] = np.nan
    rng = np.random.default_rng(3)
    z = LINE.simulate(doa, np.exp(2j * np.pi * rng.random((250, 2))), rng)
    n_found = MUSIC(LINE, forgetting=0.9).run(z).n_found
    for steps, number in ((slice(30, 50), 2), (slice(150, 200), 1), (slice(210, 250), 2)):
        assert (n_found[steps] == number).mean() > 0.9
