"""Signals of talkers, diffuse noise and layouts: coherence, bandwidth, pauses and geometry."""

import numpy as np
import pytest

from arrivals.scenarios.room_acoustics import activity, diffuse_noise, speech_like, utterances
from arrivals.scenarios.room_acoustics.diffuse_noise import sphere
from arrivals.scenarios.room_acoustics.layouts import SIZE, draw_azimuths, draw_layout
from arrivals.typing import Complex, Float

RATE = 16000.0
WINDOW = 512


def cross_spectra(x: Float) -> Complex:
    """Return mean cross spectra over Hann windows, (n_frequencies, n_sensors, n_sensors)."""
    n = len(x) // WINDOW
    y = np.fft.rfft(x[: n * WINDOW].reshape(n, WINDOW, -1) * np.hanning(WINDOW)[:, None], axis=1)
    return np.asarray(np.einsum("nfi,nfj->fij", y, y.conj()) / n)


def test_diffuse_noise_coherence_matches_a_diffuse_field() -> None:
    sensors = np.array([[0.0, 0, 0], [0.05, 0, 0], [0, 0.1, 0.02]])
    x = diffuse_noise(128_000, sensors, RATE, np.random.default_rng(1), n_waves=100)
    S = cross_spectra(x)
    f = np.arange(len(S)) * RATE / WINDOW
    for i, j in ((0, 1), (0, 2), (1, 2)):
        coherence = S[:, i, j] / np.sqrt(S[:, i, i] * S[:, j, j]).real
        d = np.linalg.norm(sensors[i] - sensors[j])
        error = np.abs(coherence - np.sinc(2 * f * d / 343.0))[8:-8]  # 250 Hz to 7.75 kHz
        assert error.mean() < 0.08  # 250 windows: 1 / sqrt(250) = 0.063 where it is small


def test_diffuse_noise_is_pink_with_power_1() -> None:
    x = diffuse_noise(64_000, np.zeros((1, 3)), RATE, np.random.default_rng(0))
    S = cross_spectra(x)[:, 0, 0].real
    octaves = [S[k : 2 * k].sum() for k in (8, 16, 32, 64)]  # equal powers
    assert np.mean(x**2) == pytest.approx(1.0)
    np.testing.assert_allclose(octaves, np.mean(octaves), rtol=0.15)


def test_sphere_second_moments_are_isotropic() -> None:
    u = sphere(60)
    np.testing.assert_allclose(np.linalg.norm(u, axis=1), 1.0)
    np.testing.assert_allclose(u.T @ u / 60, np.eye(3) / 3, atol=0.01)


def test_diffuse_noise_of_one_wave_delays_by_geometry() -> None:
    """A sensor farther towards the wave's direction is earlier."""
    sensors = 4 * 343 / RATE * np.stack([np.zeros(3), sphere(1)[0]])
    x = diffuse_noise(4000, sensors, RATE, np.random.default_rng(0), n_waves=1)
    np.testing.assert_allclose(x[:-4, 1], x[4:, 0], atol=1e-6)


def test_speech_like_has_power_in_all_bands_up_to_7_khz() -> None:
    x = speech_like(48_000, np.random.default_rng(0))
    S = np.abs(np.fft.rfft(x)) ** 2
    f = np.fft.rfftfreq(len(x), 1 / RATE)
    share = [S[(f >= low) & (f < low + 1000)].sum() / S.sum() for low in range(0, 7000, 1000)]
    assert share[0] > 0.2
    assert min(share) > 1e-5


@pytest.mark.parametrize("seed", range(5))
def test_utterances_and_their_activity_have_pauses(seed: int) -> None:
    x = utterances(128_000, 0.3, speech_like, np.random.default_rng(seed))
    on = activity(x)
    assert not on[:4000].any()
    assert 0.4 < on.mean() < 0.9
    edges = np.flatnonzero(np.diff(on.astype(int)))
    assert (np.diff(edges)[1::2] > 0.65 * RATE).any()  # pauses


def test_activity_of_silence_is_empty() -> None:
    assert not activity(np.zeros(1000)).any()


@pytest.mark.parametrize("line", [False, True])
@pytest.mark.parametrize("seed", range(5))
def test_layout_directions_match_positions(line: bool, seed: int) -> None:
    rng = np.random.default_rng(seed)
    positions = np.linspace(-1, 1, 3)[:, None] if line else np.eye(2)
    azimuths = draw_azimuths(2, 1, rng, line=line)
    layout = draw_layout(positions, azimuths, rng)
    x = layout.sensors[2] - layout.sensors[1] if line else None
    for places, doa in zip(layout.places, layout.doa, strict=True):
        assert ((places > 0) & (places < np.array(SIZE))).all()
        if x is not None:
            d = places - layout.sensors.mean(axis=0)
            np.testing.assert_allclose(np.sin(doa), d @ x / np.linalg.norm(d, axis=1), atol=1e-9)
    if not line:  # the two sensors are at 1 m on both axes of the array about the same centre
        one, other = layout.sensors
        half = (one + other) / 2
        turn = np.arctan2(*(one - other)[1::-1]) + np.pi / 4
        centre = half - np.array([np.cos(turn + np.pi / 4), np.sin(turn + np.pi / 4), 0]) / np.sqrt(
            2
        )
        for places, doa in zip(layout.places, layout.doa, strict=True):
            d = places - centre
            azimuth = np.arctan2(d[:, 1], d[:, 0]) - turn
            np.testing.assert_allclose(np.cos(azimuth - doa), 1.0, atol=1e-9)


@pytest.mark.parametrize("line", [False, True])
def test_azimuths_stay_apart_and_in_front_of_a_line(line: bool) -> None:
    for seed in range(20):
        moving, static = map(
            np.rad2deg, draw_azimuths(2, 1, np.random.default_rng(seed), line=line)
        )
        assert np.abs((moving - static + 180) % 360 - 180).min() >= 20
        assert abs(moving[-1] - moving[0]) == pytest.approx(60)
        if line:
            assert min(moving.min(), static.min()) >= 25
            assert max(moving.max(), static.max()) <= 155
