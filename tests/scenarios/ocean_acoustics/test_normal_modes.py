"""Normal modes: closed forms, image sources, orthonormality and reciprocity."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from arrivals.scenarios.ocean_acoustics.normal_modes import Modes, mode_field, modes
from arrivals.scenarios.ocean_acoustics.waveguide import BottomLayer, Waveguide
from arrivals.scenarios.simulations.swellex96 import environment
from arrivals.typing import Complex, Float


def water(depth: float = 100.0, *, rigid: bool = False) -> Waveguide:
    return Waveguide(np.array([0.0, depth]), np.array([1500.0, 1500.0]), rigid=rigid)


def overlap(result: Modes, guide: Waveguide) -> Float:
    """Return ∫ ψ_m ψ_n / ρ dz, summed over the layers."""
    total = np.zeros((len(result.wavenumber),) * 2)
    parts = [(0.0, guide.water_depth, 1.0)] + [(b.top, b.bottom, b.density) for b in guide.layers]
    for top, bottom, density in parts:
        inside = (result.depth >= top - 1e-9) & (result.depth <= bottom + 1e-9)
        psi = result.shape[:, inside]
        products = psi[:, None] * psi[None]
        total += np.trapezoid(products, result.depth[inside], axis=-1) / density
    return total


def test_modes_of_a_layered_floor_are_orthonormal() -> None:
    guide = environment()
    result = modes(guide, 60.0, step=0.5)
    assert len(result.wavenumber) > 8
    np.testing.assert_allclose(overlap(result, guide), np.eye(len(result.wavenumber)), atol=1e-9)


@settings(max_examples=20)
@given(st.floats(20, 300), st.floats(15, 120), st.booleans())
def test_modes_of_ideal_water_match_the_closed_form(
    depth: float, frequency: float, rigid: bool
) -> None:
    k = 2 * np.pi * frequency / 1500
    n = np.arange(1, 200)
    vertical = (n - 0.5 * rigid) * np.pi / depth
    expected = np.sqrt(k**2 - vertical[vertical < k] ** 2)
    assume(len(expected) > 0)
    assume(expected[-1] > 0.2 * k and np.abs(vertical - k).min() > 1e-3 * k)  # away from the edge
    result = modes(water(depth, rigid=rigid), frequency, step=1500 / frequency / 400)
    assert len(result.wavenumber) == len(expected)
    np.testing.assert_allclose(result.wavenumber.real, expected, rtol=2e-3)
    shape = np.sqrt(2 / depth) * np.sin(vertical[0] * result.depth)
    np.testing.assert_allclose(np.abs(result.shape[0]), np.abs(shape), atol=1e-3 / np.sqrt(depth))
    assert (result.wavenumber.imag == 0).all()


def test_modes_over_a_fast_fluid_solve_the_pekeris_equation() -> None:
    """tan(q D) = -ρ q/γ with jumps of speed and density; evanescent field in the floor."""
    depth, c, density, frequency = 100.0, 1800.0, 1.8, 60.0
    layer = BottomLayer(depth, 1500.0, c, c, density)
    result = modes(Waveguide(np.array([0.0, depth]), np.array([1500.0] * 2), [layer]), frequency)
    k = result.wavenumber.real
    q = np.sqrt((2 * np.pi * frequency / 1500) ** 2 - k**2)
    gamma = np.sqrt(k**2 - (2 * np.pi * frequency / c) ** 2)
    residual = gamma * np.sin(q * depth) + density * q * np.cos(q * depth)
    assert len(k) == 4
    np.testing.assert_allclose(residual / np.hypot(gamma, density * q), 0, atol=1e-3)


def test_wavenumber_error_is_quadratic_in_the_step() -> None:
    k = 2 * np.pi * 50 / 1500
    exact = np.sqrt(k**2 - (np.arange(1, 7) * np.pi / 100) ** 2)
    errors = [
        np.abs(modes(water(), 50.0, step=step).wavenumber.real[:6] - exact).max()
        for step in (1.0, 0.5, 0.25)
    ]
    np.testing.assert_allclose(np.array(errors[:-1]) / errors[1:], 4, rtol=0.05)


def test_modal_loss_is_proportional_to_the_power_in_the_floor() -> None:
    """Floor that differs from the water in loss alone: Im k in closed form."""
    layer = BottomLayer(50.0, 100.0, 1500.0, 1500.0, 1.0, 0.5)
    guide = Waveguide(np.array([0.0, 50.0]), np.array([1500.0] * 2), [layer])
    result = modes(guide, 40.0, steepest=1e9)
    k, n = 2 * np.pi * 40 / 1500, np.arange(1, len(result.wavenumber) + 1)
    alpha = 0.5 * 0.04 / (20 / np.log(10))
    share = 0.5  # of sin² over the lower half of the water
    expected = alpha * k * share / np.sqrt(k**2 - (n * np.pi / 100) ** 2)
    np.testing.assert_allclose(-result.wavenumber.imag, expected, rtol=2e-3)


@settings(max_examples=10)
@given(st.floats(1, 216), st.floats(1, 216), st.floats(300, 9000))
def test_mode_field_is_reciprocal(one: float, other: float, distance: float) -> None:
    result = modes(environment(), 60.0, step=0.5)
    there = mode_field(result, one, [other], [distance])
    back = mode_field(result, other, [one], [distance])
    np.testing.assert_allclose(there, back, rtol=1e-9)


def images(source: float, depths: Float, distance: float, k: float, n_images: int) -> Complex:
    """Sum the images of a source in 100 m of water over a rigid floor, tapered at the ends."""
    m = np.arange(-n_images, n_images + 1)
    taper = np.cos(np.pi / 2 * m / (n_images + 1)) ** 2
    total = np.zeros(len(depths), dtype=np.complex128)
    # surface -1, floor +1: images at 2 m D + z_s with (-1)^m, at 2 m D - z_s with -(-1)^m
    for sign in (1, -1):
        heights = 200.0 * m + sign * source
        r = np.hypot(distance, depths[:, None] - heights)
        total += (sign * (-1.0) ** m * taper * np.exp(-1j * k * r) / (4 * np.pi * r)).sum(axis=1)
    return total


def test_mode_field_matches_image_sources() -> None:
    depths, distance, frequency = np.linspace(5, 95, 19), 3000.0, 45.0
    result = modes(water(rigid=True), frequency, step=0.1)
    field = mode_field(result, 30.0, depths, [distance])[0]
    exact = images(30.0, depths, distance, 2 * np.pi * frequency / 1500, 20000)
    assert np.linalg.norm(field - exact) < 0.02 * np.linalg.norm(exact)


@pytest.mark.parametrize(
    ("depth", "step", "match"), [(-1.0, 0.5, "depth must lie"), (9.0, -0.5, "step must be")]
)
def test_modes_invalid_depth_or_step_is_rejected(depth: float, step: float, match: str) -> None:
    with pytest.raises(ValueError, match=match):
        mode_field(modes(water(), 30.0, step=step), depth, [50.0], [1000.0])


def test_modes_below_cutoff_and_zero_range_are_rejected() -> None:
    with pytest.raises(ValueError, match=r"no mode propagates at 5\.0 Hz"):
        modes(water(), 5.0)
    with pytest.raises(ValueError, match="ranges must be finite and positive"):
        mode_field(modes(water(), 30.0), 9.0, [50.0], [1000.0, 0.0])


@pytest.mark.parametrize(
    ("depths", "speeds", "layers", "match"),
    [
        ([0.0, 50.0, 50.0], [1500.0] * 3, (), "increasing from 0"),
        ([1.0, 50.0], [1500.0] * 2, (), "increasing from 0"),
        ([0.0, 50.0], [1500.0, np.nan], (), "2 positive numbers"),
        ([0.0, 50.0], [1500.0] * 3, (), "2 positive numbers"),
        (
            [0.0, 50.0],
            [1500.0] * 2,
            (BottomLayer(51.0, 60.0, 1600.0, 1600.0),),
            "top of a layer must be 50",
        ),
    ],
)
def test_waveguide_invalid_argument_is_rejected(
    depths: list[float], speeds: list[float], layers: tuple[BottomLayer, ...], match: str
) -> None:
    with pytest.raises(ValueError, match=match):
        Waveguide(np.array(depths), np.array(speeds), layers)


def test_invalid_layers_and_depths_are_rejected() -> None:
    with pytest.raises(ValueError, match="bottom must lie below top"):
        BottomLayer(60.0, 50.0, 1600.0, 1600.0)
    with pytest.raises(ValueError, match="attenuation must be"):
        BottomLayer(50.0, 60.0, 1600.0, 1600.0, attenuation=-1.0)
    with pytest.raises(ValueError, match=r"depth must lie in \[0, 100.0\]"):
        water().speed([101.0])
    with pytest.raises(TypeError, match="layers must be a BottomLayer"):
        Waveguide(np.array([0.0, 50.0]), np.array([1500.0] * 2), ["mud"])  # type: ignore[list-item]


def test_waveguide_configuration_makes_the_round_trip() -> None:
    guide = environment()
    back = Waveguide.from_dict(guide.to_dict())
    np.testing.assert_array_equal(back.speeds, guide.speeds)
    assert (back.layers, back.rigid, back.depth) == (guide.layers, False, 1040.0)
    with pytest.raises(ValueError, match="read-only"):
        guide.speeds[0] = 0.0
