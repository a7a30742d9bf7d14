"""Conventional beamformer in noise that is coherent between sensors."""

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from arrivals.measurement_models import ArraySnapshot, ElementResponse, SensorArray
from arrivals.trackers import CBF, create
from arrivals.typing import Complex

CIRCLE = SensorArray.uca(6, 0.3)
SPACE = SensorArray(np.random.default_rng(2).normal(size=(6, 3)) / 3)
CARDIOIDS = ElementResponse.first_order(np.linspace(0, 5, 6))
SEVERAL: dict[str, Any] = {"wavelength": [1.0, 1.4, 3.0], "n_snapshots": 3}
MODELS = {
    "single": ArraySnapshot(CIRCLE, 1.0, noise_coherence="diffuse"),
    "line": ArraySnapshot(SensorArray.ula(6, 0.4), 1.0, noise_coherence="diffuse"),
    "response": ArraySnapshot(CIRCLE, 1.0, response=CARDIOIDS, noise_coherence="diffuse"),
    "several": ArraySnapshot(CIRCLE, **SEVERAL, noise_coherence="diffuse"),
    "elevation": ArraySnapshot(SPACE, **SEVERAL, elevation=[0, 0.7], noise_coherence="diffuse"),
}
every_model = pytest.mark.parametrize("model", MODELS.values(), ids=MODELS)


def with_gaps(model: ArraySnapshot, z: Complex, kind: str) -> Complex:
    z = np.broadcast_to(z, model.shape).copy()
    if kind != "none":
        z[..., 2] = np.nan  # a sensor
    if kind == "unequal" and z.ndim == 3:
        z[1, 0, 4], z[2, 2, :3], z[0] = np.nan, np.nan, np.nan
    return z


@every_model
@pytest.mark.parametrize("gaps", ["none", "sensor", "unequal"])
def test_wave_without_noise_has_its_direction_and_amplitude(
    model: ArraySnapshot, gaps: str
) -> None:
    w = 1.2 - 0.5j
    tracker = CBF(model, max_sources=1, n_directions=1441)
    tracker.update(with_gaps(model, model.wave([0.6], w), gaps))
    assert_allclose(tracker.estimate.doa, [0.6], atol=2e-3)
    assert_allclose(np.abs(tracker.estimate.amplitude), abs(w), rtol=1e-3)
    if model.is_single:
        assert_allclose(tracker.estimate.amplitude, w, rtol=2e-2)


@every_model
def test_spectrum_of_the_noise_is_flat_and_its_variance(model: ArraySnapshot) -> None:
    model = model.replace(noise=0.3)
    rng, tracker = np.random.default_rng(0), CBF(model.replace(elevation=None), n_directions=37)
    z = model.simulate(np.full((600, 1), np.nan), 0.0, rng)
    power = np.empty((len(z), len(tracker.doa_grid)))
    for step in range(len(z)):
        tracker.update(with_gaps(model, z[step], "sensor"))
        power[step] = tracker.power
    # the mean of 600 exponential variables is known to 0.3 / sqrt(600) = 0.012
    assert_allclose(power.mean(axis=0), 0.3, atol=0.05)


def test_spectrum_of_a_missing_sensor_is_that_of_the_array_without_it() -> None:
    model = MODELS["several"]
    z = model.simulate([0.6], 1.0, np.random.default_rng(0))
    whole, part = CBF(model), CBF(model.replace(array=CIRCLE.without([2])))
    whole.update(with_gaps(model, z, "sensor"))
    part.update(np.delete(z, 2, axis=-1))
    assert_allclose(whole.power, part.power, rtol=1e-10)


def test_snapshots_of_unequal_gaps_are_whitened_each() -> None:
    model = MODELS["several"]
    z = with_gaps(model, model.simulate([0.6], 1.0, np.random.default_rng(0)), "unequal")
    tracker = CBF(model, n_directions=37)
    tracker.update(z)
    A = model.waves.steering(tracker.doa_grid)[0]
    powers = []
    for f, n in np.ndindex(3, 3):
        valid = ~np.isnan(z[f, n])
        if valid.any():
            L = model.whitening(valid)[f]
            a, y = L @ A[f, valid], L @ z[f, n, valid]
            powers.append(np.abs(a.conj().T @ y) ** 2 / (np.abs(a) ** 2).sum(axis=0))
    assert_allclose(tracker.power, np.mean(powers, axis=0), rtol=1e-10)


def test_diffuse_noise_of_white_share_one_has_the_spectrum_of_white_noise() -> None:
    white = ArraySnapshot(CIRCLE, 1.0)
    z = white.simulate([0.6], 1.0, np.random.default_rng(0))
    one, other = CBF(white), CBF(white.replace(noise_coherence="diffuse", white=1.0))
    one.update(z)
    other.update(z)
    assert_allclose(one.power, other.power, rtol=1e-12)
    assert_allclose(one.estimate.amplitude, other.estimate.amplitude, rtol=1e-12)


def test_methods_of_white_noise_refuse_coherent_noise_in_one_line() -> None:
    line = ArraySnapshot(SensorArray.symmetric([0.25, 0.5]), 1.0, noise_coherence="diffuse")
    with pytest.raises(ValueError, match=r"requires noise_coherence='white'; got coherent noise$"):
        create("ar_kalman_qrd_rls", measurement=line)
