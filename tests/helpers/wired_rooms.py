"""Talkers in a small room as a correctly wired array records them, and wiring faults."""

import numpy as np
from scipy.signal import oaconvolve

from arrivals.measurement_models import SensorArray
from arrivals.scenarios.room_acoustics import Shoebox, speech_like
from arrivals.typing import Float

RATE = 16000.0
CIRCLE = SensorArray.uca(6, radius=0.046, speed=343.0)
LINE = SensorArray.ula(7, spacing=0.04, speed=343.0)
SQUARE = SensorArray(0.03 * np.array([[1.0, 1.0], [-1, 1], [-1, -1], [1, -1]]), 343.0)


def talk_in_room(array: SensorArray, seed: int = 0, seconds: float = 2.0) -> Float:
    """Return samples (n_samples, n_sensors) of three talkers, one after the other, and noise."""
    rng, n = np.random.default_rng(seed), int(seconds * RATE)
    room, centre = Shoebox((6.0, 5.0, 2.8), rt60=0.25, order=4), np.array([2.9, 2.4, 1.2])
    sensors = np.zeros((array.n_sensors, 3))
    sensors[:, : array.dim] = array.positions
    y = np.zeros((n, array.n_sensors))
    for k, azimuth in enumerate(np.deg2rad(rng.uniform(20, 120, 3) + 120 * np.arange(3))):
        place = centre + np.array([1.4 * np.cos(azimuth), 1.4 * np.sin(azimuth), 0.2])
        speech = np.zeros(n)
        speech[k * n // 3 : (k + 1) * n // 3] = speech_like(
            (k + 1) * n // 3 - k * n // 3, rng, pitch=rng.uniform(90, 220)
        )
        response = room.response(place, centre + sensors, RATE)
        y += oaconvolve(speech[:, None], response, axes=0)[:n]
    y += 0.1 * np.sqrt(np.mean(y**2)) * rng.standard_normal(y.shape)
    return np.asarray(0.5 * y / np.abs(y).max())


def delayed(y: Float, channel: int, delay: int) -> Float:
    """Return samples with one channel late, or early, by a number of samples."""
    late = y.copy()
    late[:, channel] = np.roll(y[:, channel], delay)
    return late


def inverted(y: Float, channel: int) -> Float:
    """Return samples with one channel multiplied by -1."""
    signs = np.where(np.arange(y.shape[1]) == channel, -1.0, 1.0)
    return np.asarray(y * signs)


def swapped(y: Float, one: int, other: int) -> Float:
    """Return samples with two channels exchanged."""
    order = np.arange(y.shape[1])
    order[[one, other]] = order[[other, one]]
    return y[:, order]
