"""Amplitudes of sources at unequal, unknown elevations."""

import numpy as np
import pytest

from arrivals.measurement_models import ArraySnapshot, SensorArray
from arrivals.trackers import MVDR


@pytest.mark.parametrize("noise_coherence", ["white", "diffuse"])
def test_each_amplitude_of_mvdr_is_that_at_the_elevation_of_its_spectrum(
    noise_coherence: str,
) -> None:
    """By beam power the weaker source has the elevation of the stronger one."""
    array = SensorArray(0.4 * np.random.default_rng(0).normal(size=(8, 3)))
    model = ArraySnapshot(
        array,
        list(np.linspace(1.0, 2.0, 6)),
        noise=0.01,
        n_snapshots=4,
        elevation=[0.0, 0.4],
        noise_coherence=noise_coherence,
    )
    rng = np.random.default_rng(0)
    shape = (20, 6, 4, 2)
    w = (rng.normal(size=shape) + 1j * rng.normal(size=shape)) / np.sqrt(2)
    run = MVDR(model, max_sources=2).run(model.simulate(np.full((20, 2), [-0.4, 0.5]), w, rng))
    order = np.argsort(run.doa[-1])
    np.testing.assert_allclose(run.doa[-1, order], [-0.4, 0.5], atol=0.02)
    expected = np.sqrt((np.abs(w[-1]) ** 2).mean(axis=(0, 1)))
    np.testing.assert_allclose(np.abs(run.amplitude[-1, order]), expected, rtol=0.05)
