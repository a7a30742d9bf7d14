"""Bounds of two unknowns against numeric Fisher matrices and published figures."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from arrivals.measurement_models import ArraySnapshot, SensorArray
from arrivals.scenarios.bounds import range_bound, snapshot_bound, sphere_bound
from arrivals.scenarios.simulations import NearField
from arrivals.typing import Complex, Float

SPACE = SensorArray(np.random.default_rng(1).normal(size=(6, 3)))
LINE = SensorArray(np.array([0.0, 0.4, 1.1, 2.0, 2.3, 3.1]) + 5.0)
FIRST = np.array([0.4, -1.1])


def numeric_bound(
    wave: Callable[[Float, Complex], Complex], p: Float, w: Complex, noise: float
) -> Float:
    """Return the inverse of the Fisher matrix of all unknowns, amplitudes too: those of p.

    Entries 2i and 2i + 1 of p are the unknowns of source i.
    """
    h, columns = 1e-6, []
    for i in range(len(p)):
        step = h * (np.arange(len(p)) == i)
        columns.append((wave(p + step, w) - wave(p - step, w)).ravel() / (2 * h))
    for i in range(w.size):
        unit = (np.arange(w.size) == i).reshape(w.shape)
        columns += [wave(p, w + unit).ravel() - wave(p, w).ravel()]
        columns += [1j * columns[-1]]
    D = np.stack(columns, axis=1)
    # J = 2/σ² Re DᴴD
    C = np.linalg.inv(2 / noise * (D.conj().T @ D).real)
    return np.stack([C[2 * i : 2 * i + 2, 2 * i : 2 * i + 2] for i in range(len(p) // 2)])


def amplitudes(model: ArraySnapshot) -> Complex:
    rng = np.random.default_rng(0)
    shape = (*model.shape[:-1], 2)
    return np.asarray(rng.normal(size=shape) + 1j * rng.normal(size=shape))


@pytest.mark.parametrize("array", [SPACE, SensorArray.uca(7, 0.7)])
@pytest.mark.parametrize("bins", [1.0, [1.0, 1.3]])
@pytest.mark.parametrize("n_snapshots", [1, 3])
def test_sphere_bound_is_the_inverse_of_the_whole_fisher_matrix(
    array: SensorArray, bins: Any, n_snapshots: int
) -> None:
    model = ArraySnapshot(array, bins, n_snapshots=n_snapshots, unknowns="sphere")
    w, elevation = amplitudes(model), np.array([0.3, 0.9])

    def wave(p: Float, w: Complex) -> Complex:  # elevation, azimuth times cos(elevation)
        return model.wave(p[1::2] / np.cos(elevation), w, p[::2])

    p = np.stack([elevation, FIRST * np.cos(elevation)], axis=1).ravel()
    C = sphere_bound(model, FIRST, elevation, w, noise=0.1)
    np.testing.assert_allclose(C, numeric_bound(wave, p, w, 0.1), rtol=1e-5, atol=1e-12)


@pytest.mark.parametrize("bins", [1.0, [1.0, 1.3]])
@pytest.mark.parametrize("n_snapshots", [1, 3])
def test_range_bound_is_the_inverse_of_the_whole_fisher_matrix(bins: Any, n_snapshots: int) -> None:
    model = ArraySnapshot(LINE, bins, n_snapshots=n_snapshots, unknowns="range")
    w, R = amplitudes(model), np.array([4.0, 7.0])

    def wave(p: Float, w: Complex) -> Complex:  # direction, 1/R
        return model.wave(p[::2], w, distance=1 / p[1::2])

    p = np.stack([FIRST, 1 / R], axis=1).ravel()
    C = range_bound(model, FIRST, R, w, noise=0.1)
    np.testing.assert_allclose(C, numeric_bound(wave, p, w, 0.1), rtol=1e-5, atol=1e-12)


def test_known_range_leaves_the_bound_of_plane_waves() -> None:
    """Schur complement: without the rows of 1/R, at infinite ranges, it is that of directions."""
    model = ArraySnapshot(LINE, 1.0, unknowns="range")
    w = amplitudes(model)
    plain = snapshot_bound(ArraySnapshot(LINE, 1.0), FIRST, w, 0.1)
    C = range_bound(model, FIRST, np.full(2, np.inf), w, 0.1)
    assert (np.sqrt(C[:, 0, 0]) > plain).all()
    one = range_bound(model, FIRST[:1], [np.inf], w[:1], 0.1)[0]
    conditional = one[0, 0] - one[0, 1] ** 2 / one[1, 1]
    assert conditional == pytest.approx(
        snapshot_bound(model.replace(unknowns="azimuth"), FIRST[:1], w[:1], 0.1)[0] ** 2
    )


@pytest.mark.parametrize(
    ("doa", "ranges", "n_snapshots", "direction_deg", "inverse_range"),
    [
        ([20], [0.3], 1, [0.210], [0.0286]),
        ([20], [0.5], 1, [0.150], [0.0160]),
        ([20], [1.0], 1, [0.107], [0.0107]),
        ([20], [2.0], 1, [0.088], [0.0094]),
        ([20], [5.0], 1, [0.081], [0.0091]),
        ([-10, 25], [0.3, 3.0], 1, [0.188, 0.095], [0.0314, 0.0103]),
        ([10, 10], [0.5, 2.0], 10, [0.040, 0.026], [0.0056, 0.0030]),
        ([10, 10], [0.3, 3.0], 10, [0.056, 0.025], [0.0099, 0.0028]),
    ],
)
def test_bound_of_the_near_field_is_that_of_the_specification(
    doa: list[float],
    ranges: list[float],
    n_snapshots: int,
    direction_deg: list[float],
    inverse_range: list[float],
) -> None:
    """Section 7: roots of mean variances over phases of the sources."""
    scene = NearField(doa, ranges, n_snapshots=n_snapshots)
    rng, model = np.random.default_rng(0), scene.measurement
    draws = [
        range_bound(
            model,
            np.deg2rad(doa),
            ranges,
            scene.amplitudes() * np.exp(2j * np.pi * rng.random((*model.shape[:-1], len(doa)))),
            0.01,
        )
        for _ in range(100)
    ]
    std = np.sqrt(np.diagonal(np.mean(draws, axis=0), axis1=1, axis2=2))
    np.testing.assert_allclose(np.rad2deg(std[:, 0]), direction_deg, rtol=0.02)
    np.testing.assert_allclose(std[:, 1], inverse_range, rtol=0.02)


def test_source_in_the_plane_of_the_sensors_has_no_bound_on_its_elevation() -> None:
    model = ArraySnapshot(SensorArray.uca(7, 0.7), 1.0, unknowns="sphere")
    C = sphere_bound(model, FIRST, [0.0, 0.5], [1.0, 1.0], 0.1)
    assert np.isinf(C[0, 0, 0])
    assert C[0, 0, 1] == 0
    assert C[0, 1, 1] > 0
    assert np.isfinite(C[1]).all()


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda m: sphere_bound(m, [0.1], [0.2], [1.0, 2.0], 0.1), "amplitude must have shape"),
        (lambda m: sphere_bound(m, [0.1], [0.2], [1.0], 0.0), "noise must be"),
        (lambda m: sphere_bound(m, 0.1, 0.2, 1.0, 0.1), "doa must have shape"),
        (lambda m: sphere_bound(m, [np.nan], [0.2], [1.0], 0.1), "doa must be finite"),
        (lambda m: sphere_bound(m, [0.1], [np.inf], [1.0], 0.1), "elevation must be finite"),
        (lambda m: sphere_bound(m, [0.1], [0.2], [np.inf], 0.1), "amplitude must be finite"),
        (lambda m: range_bound(m, [0.1], [2.0], [1.0], 0.1), "array must be a line"),
        (
            lambda m: sphere_bound(
                ArraySnapshot(m.array, 1.0, noise_coherence="diffuse"), [0.1], [0.2], [1.0], 0.1
            ),
            "white noise",
        ),
    ],
)
def test_arguments_that_do_not_fit_are_refused(call: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        call(ArraySnapshot(SPACE, 1.0, unknowns="sphere"))
