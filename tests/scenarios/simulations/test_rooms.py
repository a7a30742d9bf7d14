"""Talkers in rooms: seeds, truth, pauses, noise, windows and methods."""

import time
from typing import Literal

import numpy as np
import pytest

from arrivals.scenarios import create, monte_carlo
from arrivals.scenarios.simulations.rooms import ARRAYS, HOP, WINDOW, WINDOWS, TalkersInRoom

ArrayName = Literal["circle", "line", "square"]


def test_room_same_seed_same_trial() -> None:
    scene = TalkersInRoom(n_talkers=2, n_moving=1, duration=2.0, order=2, diffuse_snr_db=20.0)
    one, same, other = (scene.sample(np.random.default_rng(seed)) for seed in (3, 3, 4))
    np.testing.assert_array_equal(one.measurements, same.measurements)
    np.testing.assert_array_equal(one.truth, same.truth)
    assert not np.allclose(one.measurements, other.measurements)


@pytest.mark.parametrize("array", ["circle", "line", "square"])
def test_room_without_echoes_peaks_at_the_truth(array: ArrayName) -> None:
    scene = TalkersInRoom(array, rt60=0.0, snr_db=30.0, n_moving=1, duration=4.0)
    trial = scene.sample(np.random.default_rng(0))
    grid = np.deg2rad(np.arange(-90, 91) if array == "line" else np.arange(-180, 180))
    A = scene.measurement.steering_vector(grid)  # (n_grid, n_bins, n_sensors)
    power = (np.abs(np.einsum("gfm,tfnm->tgfn", A.conj(), trial.measurements)) ** 2).sum((2, 3))
    error = np.rad2deg(grid[power.argmax(axis=1)]) - np.rad2deg(trial.truth[:, 0])
    error = (error + 180) % 360 - 180
    assert np.nanmax(np.abs(error)) < 5
    assert 5 < np.isfinite(error).sum() < len(error)


def test_room_truth_is_missing_in_pauses() -> None:
    """Where no direction is given, the received power is low but for echoes and short sounds."""
    scene = TalkersInRoom(rt60=0.0, snr_db=60.0, n_bins=8)
    trial = scene.sample(np.random.default_rng(1))
    power = (np.abs(trial.measurements) ** 2).mean(axis=(1, 2, 3))
    silent = np.isnan(trial.truth[:, 0])
    assert 0.1 < silent.mean() < 0.6
    assert np.median(power[silent]) < 1e-3 * np.median(power[~silent])


@pytest.mark.parametrize("snr_db", [0.0, 20.0])
def test_room_noise_has_the_stated_power(snr_db: float) -> None:
    """Over that of the active talker; the same draws with and without noise."""
    loud, clean = (
        TalkersInRoom(snr_db=level, order=1, duration=3.0).record(np.random.default_rng(2))
        for level in (snr_db, 200.0)
    )
    on = clean.active[:, 0]
    ratio = np.mean(clean.samples[on] ** 2) / np.mean((loud.samples - clean.samples) ** 2)
    assert 10 * np.log10(ratio) == pytest.approx(snr_db, abs=0.1)
    diffuse = TalkersInRoom(snr_db=200.0, diffuse_snr_db=snr_db, order=1, duration=3.0)
    noisy = diffuse.record(np.random.default_rng(2)).samples
    ratio = np.mean(clean.samples[on] ** 2) / np.mean((noisy - clean.samples) ** 2)
    assert 10 * np.log10(ratio) == pytest.approx(snr_db, abs=0.1)


def test_room_measurements_are_the_frames_of_the_recording() -> None:
    scene = TalkersInRoom("square", n_bins=5, duration=2.0, order=1)
    samples = scene.record(np.random.default_rng(0)).samples
    trial = scene.sample(np.random.default_rng(0))
    z = trial.measurements
    assert z.shape == (len(trial.truth), *scene.measurement.shape)
    step, window, hann = 3, 5, np.hanning(WINDOW + 1)[:-1, None]
    start = HOP * (WINDOWS * step + window)
    f = np.array(scene.frequencies)[:, None]
    tones = np.exp(-2j * np.pi * f * (start + np.arange(WINDOW)) / 16000.0)
    expected = 2 / hann.sum() * tones @ (hann * samples[start : start + WINDOW])
    np.testing.assert_allclose(z[step, :, window], expected, atol=1e-12 * np.abs(z).max())


@pytest.mark.parametrize(("array", "n"), [("circle", 169), ("line", 196), ("square", 234)])
def test_room_bins_end_at_1_5_alias_limits(array: ArrayName, n: int) -> None:
    p = ARRAYS[array].positions
    nearest = min(float(np.linalg.norm(a - b)) for i, a in enumerate(p) for b in p[:i])
    f = TalkersInRoom(array).frequencies
    assert len(f) == n
    assert 300 <= f[0] < 332
    top = min(1.5 * 343.0 / (2 * nearest), 7600)
    assert top - 31.25 < f[-1] <= top
    some = TalkersInRoom(array, n_bins=6).frequencies
    assert len(some) == 6
    assert set(some) <= set(f)


def test_room_reverberation_lasts_longer_with_more_reflections() -> None:
    tail = []
    for order in (0, 4, 12):
        scene = TalkersInRoom(rt60=0.5, order=order, snr_db=100.0)
        layout = scene.layout(np.random.default_rng(0))
        (h,) = scene.responses(layout, 0)
        tail.append((h[800:] ** 2).sum() / (h**2).sum())  # after 50 ms
    assert tail[0] == 0 < tail[1] < tail[2]


def test_room_methods_are_scored_by_monte_carlo() -> None:
    scene = TalkersInRoom(n_bins=12, order=3, duration=2.5, voices="shipped", n_talkers=2)
    study = monte_carlo(scene, ["cbf", "svalse"], runs=2, metrics=["gospa", "false", "missed"])
    assert study.methods == ["cbf", "svalse"]
    for method in study.methods:
        assert 0 < study.mean("gospa", method) < 100


def test_room_trial_of_8_s_takes_below_2_s() -> None:
    TalkersInRoom(duration=1.0).sample(np.random.default_rng(0))  # imports
    started = time.process_time()
    TalkersInRoom(n_talkers=2, n_moving=2, order=4).sample(np.random.default_rng(0))
    assert time.process_time() - started < 2


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"array": "cube"}, "array must be"),
        ({"n_talkers": 4}, "n_talkers must be"),
        ({"n_moving": 2}, "n_moving must be"),
        ({"rt60": -1.0}, "rt60 must be"),
        ({"order": 1000}, "order must be"),
        ({"duration": 0.5}, "duration must be at least 1 s; got 0.5"),
        ({"n_bins": 500}, "n_bins must be"),
        ({"voices": "mine"}, "voices must be"),
    ],
)
def test_room_invalid_settings_are_refused(settings: dict[str, object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        create("room", **settings)
