"""Image sources: reciprocity, a brute-force list of paths, array waves and decay."""

from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import butter, sosfilt

from arrivals.measurement_models import SensorArray
from arrivals.scenarios.room_acoustics import Shoebox, convolve_moving, delay_and_add, image_sources
from arrivals.typing import Float

RATE, SIZE = 16000.0, (6.0, 5.0, 2.8)
COORDINATE = st.floats(0.1, 2.7)
POINT = st.tuples(COORDINATE, COORDINATE, COORDINATE)


def mirrored(source: Float, order: int) -> dict[tuple[float, ...], int]:
    """Return images and their fewest reflections, by mirroring at one wall after the other."""
    images = {tuple(np.round(source, 9)): 0}
    last = list(images)
    for n in range(1, order + 1):
        new = []
        for image, axis, wall in product(last, range(3), (0, 1)):
            p = list(image)
            p[axis] = round(2 * wall * SIZE[axis] - p[axis], 9)
            if tuple(p) not in images:
                images[tuple(p)] = n
                new.append(tuple(p))
        last = new
    return images


@pytest.mark.parametrize("order", [0, 1, 2, 5])
def test_images_match_mirroring_at_the_walls(order: int) -> None:
    source = np.array([1.1, 2.3, 0.7])
    positions, reflections = Shoebox(SIZE, rt60=0.3, order=order).images(source)
    expected = mirrored(source, order)
    rows = [tuple(p) for p in np.round(positions, 9)]
    assert dict(zip(rows, reflections.tolist(), strict=True)) == expected
    # integer points of an octahedron
    assert len(rows) == len(expected) == (2 * order + 1) * (2 * order**2 + 2 * order + 3) // 3


@settings(max_examples=20, deadline=None)
@given(POINT, POINT, st.integers(0, 4))
def test_response_exchanging_source_and_sensor_is_the_same(
    a: tuple[float, float, float], b: tuple[float, float, float], order: int
) -> None:
    room = Shoebox(SIZE, rt60=0.4, order=order)
    there, back = room.response(a, [b], RATE), room.response(b, [a], RATE)
    np.testing.assert_allclose(there, back, atol=1e-9 * np.abs(there).max())


def test_response_spectrum_is_the_sum_of_spherical_waves() -> None:
    room, source = Shoebox(SIZE, rt60=0.3, order=2), np.array([1.0, 2.0, 1.5])
    sensors = np.array([[3.0, 2.5, 1.2], [3.05, 2.5, 1.2]])
    h = room.response(source, sensors, RATE)
    expected = np.zeros((len(f := np.linspace(300, 6500, 30)), 2), dtype=complex)
    for image, n in mirrored(source, 2).items():
        d = np.linalg.norm(np.array(image) - sensors, axis=1)
        expected += room.reflection**n / d * np.exp(-2j * np.pi * f[:, None] * d / room.speed)
    spectrum = np.exp(-2j * np.pi * f[:, None] / RATE * np.arange(len(h))) @ h
    np.testing.assert_allclose(spectrum, expected, atol=2e-3)


@pytest.mark.parametrize("azimuth", [-130.0, 20.0, 90.0])
def test_response_of_a_distant_source_is_the_steering_vector(azimuth: float) -> None:
    array, room = SensorArray.uca(6, 0.046, speed=343.0), Shoebox((1000.0, 1000.0, 10.0))
    centre, phi = np.array([500.0, 500.0, 5.0]), np.deg2rad(azimuth)
    sensors = centre + np.pad(array.positions, ((0, 0), (0, 1)))
    source = centre + 400 * np.array([np.cos(phi), np.sin(phi), 0.0])
    h = room.response(source, sensors, RATE)
    for f in (500.0, 3000.0):
        wave = np.exp(-2j * np.pi * f / RATE * np.arange(len(h))) @ h
        a = array.steering_vector(phi, array.wavelength(f))
        np.testing.assert_allclose(wave / wave[0], a / a[0], atol=2e-3)


@pytest.mark.parametrize("size", [SIZE, (5.0, 5.0, 5.0)])
@pytest.mark.parametrize("rt60", [0.15, 0.3])
def test_response_decay_matches_reverberation_time(
    rt60: float, size: tuple[float, float, float]
) -> None:
    """Schroeder's integral above 500 Hz: near 0 Hz the images of one sign add up."""
    h = Shoebox(size, rt60, order=40).response([1.7, 3.1, 1.4], [[4.2, 1.9, 1.1]], RATE)
    h = sosfilt(butter(4, 500.0, "high", fs=RATE, output="sos"), h[:, 0])
    decay = 10 * np.log10(np.cumsum(h[::-1] ** 2)[::-1] / np.sum(h**2))
    start, end = (int(np.argmax(decay < level)) for level in (-5.0, -25.0))
    assert 3 * (end - start) / RATE == pytest.approx(rt60, rel=0.12)


@given(st.floats(0.0, 60.0), st.floats(0.02, 0.42))
def test_delay_and_add_delays_a_tone(delay: float, frequency: float) -> None:
    """Frequency in cycles a sample; pulses cut off at time 0 excluded."""
    h = delay_and_add([[delay + 25.0]], [[2.0]])[:, 0]
    tone = np.exp(-2j * np.pi * frequency * np.arange(len(h))) @ h
    assert abs(tone - 2 * np.exp(-2j * np.pi * frequency * (delay + 25.0))) < 4e-3


def test_moving_source_along_equal_responses_is_static() -> None:
    rng = np.random.default_rng(0)
    x, h = rng.standard_normal(500), rng.standard_normal((40, 3))
    expected = np.stack([np.convolve(x, h[:, m])[:500] for m in range(3)], axis=1)
    np.testing.assert_allclose(convolve_moving(x, [h]), expected, atol=1e-9)
    np.testing.assert_allclose(convolve_moving(x, [h] * 7), expected, atol=1e-9)


def test_shoebox_invalid_arguments_are_refused() -> None:
    with pytest.raises(ValueError, match="size must"):
        Shoebox((6.0, -1.0, 2.0))
    with pytest.raises(ValueError, match="rt60 must"):
        Shoebox(SIZE, rt60=-0.1)
    with pytest.raises(ValueError, match="order must"):
        Shoebox(SIZE, order=-1)
    with pytest.raises(ValueError, match=r"source must lie in the room of 6 x 5 x 2\.8 m"):
        Shoebox(SIZE).response([7.0, 1.0, 1.0], [[1.0, 1.0, 1.0]], RATE)
    with pytest.raises(ValueError, match="sensors must lie in the room"):
        Shoebox(SIZE).response([1.0, 1.0, 1.0], [[1.0, 1.0]], RATE)


def test_pulses_may_be_added_in_blocks(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(0)
    delay, gain = rng.uniform(0, 300, (500, 3)), rng.normal(size=(500, 3))
    whole = delay_and_add(delay, gain)
    monkeypatch.setattr(image_sources, "MAX_BLOCK", 5000)
    np.testing.assert_allclose(delay_and_add(delay, gain), whole, atol=1e-12)
