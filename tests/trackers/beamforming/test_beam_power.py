"""Mean beam power of complete blocks against the definition, and against blocks with gaps."""

import numpy as np
import pytest

from arrivals.trackers.beamforming import mean_beam_power
from arrivals.typing import Complex


def random(*shape: int, seed: int) -> Complex:
    return np.asarray(np.random.default_rng(seed).standard_normal((*shape, 2)) @ [1, 1j])


@pytest.mark.parametrize("n_snapshots", [1, 4, 9])
@pytest.mark.parametrize("batch", [(), (2,)])
def test_mean_beam_power_of_complete_blocks_is_the_mean_over_snapshots(
    batch: tuple[int, ...], n_snapshots: int
) -> None:
    A = random(2, 3, 4, 7, seed=0)  # nuisance, bins, sensors, directions
    Y = random(*batch, 3, 4, n_snapshots, seed=1)
    beam = np.abs(np.einsum("afmd,...fmn->...afdn", A.conj(), Y)) ** 2
    norm = (np.abs(A) ** 2).sum(axis=2)[..., None]
    expected = (beam / norm).mean(axis=(-3, -1)).max(axis=-2)
    np.testing.assert_allclose(mean_beam_power(A, Y), expected, rtol=1e-12)


def test_snapshots_that_are_missing_do_not_change_the_mean() -> None:
    A, Y = random(1, 2, 4, 7, seed=0), random(2, 4, 9, seed=1)
    gaps = np.concatenate([Y, np.full((2, 4, 3), np.nan)], axis=2)
    np.testing.assert_allclose(mean_beam_power(A, gaps), mean_beam_power(A, Y), rtol=1e-12)
