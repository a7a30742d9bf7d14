"""Rays: image sources, circular arcs, the eikonal equation and the field of the modes."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from arrivals.scenarios.ocean_acoustics.eigenrays import eigenrays, path_names
from arrivals.scenarios.ocean_acoustics.rays import floor_reflection, ray_line, trace_rays
from arrivals.scenarios.ocean_acoustics.waveguide import BottomLayer, Waveguide
from arrivals.scenarios.reproduce.swellex96.field import beam
from arrivals.scenarios.simulations.swellex96 import TowPastLine, environment
from arrivals.typing import Float

FLAT = Waveguide(np.array([0.0, 100.0]), np.array([1500.0] * 2), rigid=True)


def image_depth(path: str, source: float, depth: float) -> float:
    """Return the height of the image source above the sensor, by unfolding the path."""
    z, up = source, path.startswith("S")
    travelled = 0.0
    for bounce in path.replace("D", ""):
        travelled += z if bounce == "S" else 100.0 - z
        z, up = (0.0, False) if bounce == "S" else (100.0, True)
    travelled += abs(z - depth)
    from_above = not up if path != "D" else depth > source
    return travelled if from_above else -travelled


@settings(max_examples=20)
@given(st.floats(5, 95), st.floats(5, 95), st.floats(200, 600))
def test_rays_at_constant_speed_match_image_sources(
    source: float, depth: float, distance: float
) -> None:
    assume(abs(source - depth) > 10)  # the fan excludes the horizontal
    steep = np.deg2rad(75)
    result = eigenrays(FLAT, 100.0, source, [depth], [distance], n_bottom=1, steepest=steep)
    assert sorted(result.path) == sorted(path_names(1))
    for path, doa, time, p in zip(
        result.path, result.doa, result.time, result.pressure, strict=True
    ):
        height = image_depth(path, source, depth)
        r = np.hypot(distance, height)
        assert doa == pytest.approx(np.arctan2(height, distance), abs=1e-5)
        assert time == pytest.approx(r / 1500, rel=1e-6)
        sign = (-1.0) ** path.count("S")
        expected = sign * np.exp(-2j * np.pi * 100 * r / 1500) / (4 * np.pi * r)
        assert abs(p - expected) < 1e-2 * abs(expected)


@pytest.mark.parametrize("slope", [0.05, -0.05])
@pytest.mark.parametrize(
    ("source", "depth", "distance"),
    [(50.0, 120.0, 400.0), (120.0, 50.0, 400.0), (100.0, 100.0, 3000.0), (90.0, 110.0, 3500.0)],
)
def test_rays_in_linear_profile_are_circles(
    source: float, depth: float, distance: float, slope: float
) -> None:
    """cosh(g t) = 1 + g² R²/(2 c₁ c₂); distant rays have a turning point and no caustic."""
    guide = Waveguide(np.array([0.0, 200.0]), 1500 + slope * np.array([0.0, 200.0]), rigid=True)
    c1, c2 = 1500 + slope * source, 1500 + slope * depth
    straight = np.hypot(distance, source - depth)
    time = np.arccosh(1 + (slope * straight) ** 2 / (2 * c1 * c2)) / abs(slope)
    result = eigenrays(guide, 100.0, source, [depth], [distance], n_bottom=1)
    first = np.argmin(result.time)
    assert result.path[first] == ("D" if distance == 400 else "B" if slope > 0 else "S")
    assert result.time[first] == pytest.approx(time, rel=1e-7)
    p = result.pressure[first] * np.exp(2j * np.pi * 100 * time)
    assert np.angle(p) == pytest.approx(0, abs=0.01)
    assert abs(p) == pytest.approx(1 / (4 * np.pi * straight), rel=0.03)


def test_travel_times_satisfy_the_eikonal_equation() -> None:
    """∂t/∂r = cos β/c and ∂t/∂z = sin β/c at the sensor: Snell's and Fermat's laws at once."""
    guide, z, r = environment(), np.array([149.9, 150.0, 150.1]), np.array([2999.0, 3000.0, 3001.0])
    result = eigenrays(guide, 198.0, 9.0, z, r, n_bottom=4)
    c = float(guide.speed(150.0))
    times: dict[str, Float] = {}
    for path in np.unique(result.path):
        mine = result.path == path
        if (
            np.bincount(result.step[mine] * 3 + result.sensor[mine], minlength=9).tolist()
            == [1] * 9
        ):
            times[path] = np.zeros((3, 3))
            times[path][result.step[mine], result.sensor[mine]] = result.time[mine]
    assert len(times) >= 8
    for path, t in times.items():
        doa = float(
            result.doa[(result.path == path) & (result.step == 1) & (result.sensor == 1)][0]
        )
        assert (t[2, 1] - t[0, 1]) / 2 == pytest.approx(np.cos(doa) / c, rel=1e-4)
        assert (t[1, 2] - t[1, 0]) / 0.2 == pytest.approx(np.sin(doa) / c, rel=3e-2)


def test_traced_rays_stay_between_their_turning_points() -> None:
    guide = environment()
    fan = trace_rays(guide, np.deg2rad([1.0, 2.0, 10.0]), 9.0, [150.0])
    speed = np.interp(fan.depth, guide.depths, guide.speeds)
    reached = ~np.isnan(fan.range)
    assert (speed[:, None] * fan.slowness < 1)[reached].all()
    np.testing.assert_array_equal(fan.turns_above, [True, True, False])
    assert not fan.turns_below.any()
    assert (np.diff(fan.range[-300:], axis=0) > 0).all()


def test_ray_line_connects_source_and_sensor() -> None:
    guide = environment()
    result = eigenrays(guide, 198.0, 9.0, [153.0], [2540.0])
    for path, doa, p in zip(result.path, result.doa, result.pressure, strict=True):
        if abs(p) < 1e-3 * np.abs(result.pressure).max():
            continue
        x, z = ray_line(guide, 9.0, 153.0, path, doa)
        assert (x[0], z[0], z[-1]) == (0.0, 9.0, 153.0)
        assert x[-1] == pytest.approx(2540.0, rel=0.02)
        assert (np.diff(x) >= 0).all()


def test_floor_reflection_matches_closed_forms() -> None:
    a = np.linspace(1e-4, 1 / 1500 - 1e-9, 50)
    depths, speeds = np.array([0.0, 100.0]), np.array([1500.0] * 2)
    hard, soft = Waveguide(depths, speeds, rigid=True), Waveguide(depths, speeds)
    assert (floor_reflection(hard, 100.0, a) == 1).all()
    assert (floor_reflection(soft, 100.0, a) == -1).all()
    half = Waveguide(depths, speeds, [BottomLayer(100.0, 200.0, 1700.0, 1700.0, 1.5)])
    R = floor_reflection(half, 100.0, a)
    total = a > 1 / 1700
    np.testing.assert_allclose(np.abs(R[total]), 1)
    sine, under = np.sqrt(1 - (1500 * a) ** 2), np.sqrt(1 - (1700 * a[~total]) ** 2)
    Z0, Z1 = 1500 / sine[~total], 1.5 * 1700 / under
    np.testing.assert_allclose(R[~total], (Z1 - Z0) / (Z1 + Z0))
    # total reflection with sign change at grazing incidence; loss reduces it
    assert R[-1] == pytest.approx(-1, abs=0.02)
    lossy = Waveguide(depths, speeds, [BottomLayer(100.0, 200.0, 1700.0, 1700.0, 1.5, 0.5)])
    assert (np.abs(floor_reflection(lossy, 100.0, a)) < 1).all()


def test_floor_reflection_is_invariant_to_splitting_a_layer() -> None:
    a = np.linspace(1e-4, 1 / 1501, 40)
    rest = BottomLayer(140.0, 900.0, 1900.0, 1900.0, 2.0, 0.1)
    one = [BottomLayer(100.0, 140.0, 1600.0, 1600.0, 1.6, 0.3), rest]
    two = [
        BottomLayer(100.0, 115.0, 1600.0, 1600.0, 1.6, 0.3),
        BottomLayer(115.0, 140.0, 1600.0, 1600.0, 1.6, 0.3),
        rest,
    ]
    R1, R2 = (
        floor_reflection(Waveguide(FLAT.depths, FLAT.speeds, layers), 120.0, a)
        for layers in (one, two)
    )
    np.testing.assert_allclose(R1, R2, atol=1e-12)


def test_beam_powers_of_rays_and_modes_correlate() -> None:
    """The beam powers of two independent models; the specification's rays reach 0.90."""
    ranges = tuple(np.linspace(950, 7700, 40))
    modal, ray_based = (TowPastLine(ranges=ranges, model=m) for m in ("modes", "rays"))
    powers = [beam(modal, s.field())[1] for s in (modal, ray_based)]
    correlation = [np.corrcoef(a, b)[0, 1] for a, b in zip(*powers, strict=True)]
    assert np.median(correlation) > 0.88
    levels = [10 * np.log10((np.abs(s.field()) ** 2).mean(axis=1)) for s in (modal, ray_based)]
    assert abs(np.median(levels[1] - levels[0])) < 1.5


@pytest.mark.parametrize(
    ("change", "match"),
    [
        ({"source_depth": 101.0}, "source_depth must lie in the water"),
        ({"depths": [-1.0]}, "depths must lie in the water"),
        ({"ranges": [0.0]}, "ranges must be finite and positive"),
        ({"steepest": 2.0}, "steepest must lie in"),
        ({"n_rays": 1}, "n_rays must be at least 2"),
        ({"n_bottom": -1}, "n_bottom must be at least 0"),
        ({"frequency": -5.0}, "frequency must be finite and positive"),
    ],
)
def test_eigenrays_invalid_argument_is_rejected(change: dict[str, object], match: str) -> None:
    arguments = {"frequency": 100.0, "source_depth": 20.0, "depths": [50.0], "ranges": [500.0]}
    with pytest.raises(ValueError, match=match):
        eigenrays(FLAT, **arguments | change)  # type: ignore[arg-type]
