"""Products of the mean responses of an array to uncertain sources."""

from __future__ import annotations

from typing import Any, TypeVar

import numpy as np

from arrivals.measurement_models.manifolds.manifold import (
    Manifold,
    angle_manifold,
    is_point_manifold,
)
from arrivals.trackers.svalse.newton.charts.angle_chart import AngleChart
from arrivals.trackers.svalse.newton.charts.point_chart import PointChart
from arrivals.trackers.svalse.noise_initialization import NOISE_FLOOR
from arrivals.typing import Bool, Complex, Float

Array = TypeVar("Array", Float, Complex)
Chart = AngleChart | PointChart


def chart_of(manifold: Manifold) -> Chart:
    """Return the chart of a manifold: of its angle, or of its points."""
    if is_point_manifold(manifold):
        return PointChart(manifold)
    return AngleChart(angle_manifold("the Newton solver", manifold))


class ExpectedResponse:
    """Mean responses of an array, and the floors of the variances.

    Parameters
    ----------
    manifold : Manifold
        Without a second parameter.
    tempering : float
        Number of snapshots that count as one: divides the evidence of each.
    power_floor : float
        Smallest power of a source, in units of the noise of one snapshot after beamforming.
    noise_floor : float
        Smallest noise, as a share of the power.

    Attributes
    ----------
    chart : AngleChart or PointChart
        Mean responses, priors and candidates.
    n_unknowns : int
        Unknowns d of a component.
    extent : float
        Sensors of the filled line that resolves as well: 1/extent is the scale of its beam.
    norm2 : ndarray, shape (n_bins, 1)
        ‖a‖², the mean over all angles where it changes.

    Examples
    --------
    >>> from arrivals.measurement_models.manifolds.uniform_line import UniformLineManifold
    >>> response = ExpectedResponse(UniformLineManifold(np.arange(3), step=np.pi, origin=1.0))
    >>> round(float(response.extent), 6)
    3.0
    """

    def __init__(
        self,
        manifold: Manifold,
        tempering: float = 1.0,
        power_floor: float = 0.0,
        noise_floor: float = NOISE_FLOOR,
    ) -> None:
        self.manifold, self.tempering = manifold, tempering
        self.power_floor, self.noise_floor = power_floor, noise_floor
        self.n_sensors, self.n_bins = manifold.n_sensors, manifold.n_bins
        self.chart = chart_of(manifold)
        self.n_unknowns = self.chart.layout.n_unknowns
        self.extent, self.norm2 = self.chart.extent, self.chart.norm2
        self.diagonal = np.zeros((self.n_bins, 1 + self.n_unknowns * (self.n_unknowns + 3) // 2, 1))
        self.diagonal[:, 0] = self.norm2  # of X, where ‖a‖² is constant

    def products(
        self, Y: Complex, x: Float, s: Float, used: Bool | None
    ) -> tuple[Complex, Complex, Complex, Float]:
        """Return A, X, h and the loss of ‖a‖² of an `Evaluation`; `used` only if not all are.

        X holds âᴴâ, (∂ᵢâ)ᴴâ, (∂ᵢⱼâ)ᴴâ, and (∂ᵢâ)ᴴ∂ⱼâ where it is not -(∂ᵢⱼâ)ᴴâ.
        """
        stack = self.chart.responses(x, s)
        if used is not None:
            stack = stack * used[:, None, None, :, None]
        B, F, P, L, M = stack.shape
        A = stack[:, :, 0]
        conj = stack.reshape(B, F, P * L, M).conj()
        X = (conj @ A.swapaxes(2, 3)).reshape(B, F, P, L, L)
        h = (conj @ Y).reshape(B, F, P, L, Y.shape[3])
        if not self.chart.is_linear:
            d = self.n_unknowns
            T = stack[:, :, 1 : 1 + d].reshape(B, F, d * L, M)
            second = (T.conj() @ T.swapaxes(2, 3)).reshape(B, F, d, L, d, L)
            X = np.concatenate([X, second.swapaxes(3, 4).reshape(B, F, d * d, L, L)], axis=2)
        own = diagonals(X)
        size = own[:, :, 0].real.copy()
        norms = self.chart.norms(x, s)
        if norms is None:
            norms = self.diagonal
        own[:, :, :P] = norms if used is None else norms * used[:, None, None]
        own[:, :, P:] = 0
        return A, X, h, own[:, :, 0].real - size

    def total(self, x: Float) -> Float:
        """Return the sum over bins (B, F, ...) of their evidence, tempered."""
        x = x[:, 0] if x.shape[1] == 1 else x.sum(axis=1)
        return x if self.tempering == 1 else x / self.tempering


def diagonals(X: Array) -> Array:
    """Return the diagonals (..., L) of contiguous matrices (..., L, L), to be read and written."""
    L = X.shape[-1]
    return X.reshape(*X.shape[:-2], L * L)[..., :: L + 1]


def numbers(*arrays: Any) -> tuple[Any, ...]:
    """Return arrays (B, F) as they are, of one problem and bin as numbers: ten times as fast.

    Examples
    --------
    >>> numbers(np.ones((2, 1)))[0].shape, float(numbers(np.ones((1, 1)))[0])
    ((2, 1), 1.0)
    """
    return tuple([x[0, 0] for x in arrays]) if arrays[0].size == 1 else arrays


def over_snapshots(x: Array) -> Array:
    """Return the sum over the last axis, of snapshots.

    Examples
    --------
    >>> over_snapshots(np.ones((2, 3)))
    array([3., 3.])
    """
    return x[..., 0] if x.shape[-1] == 1 else x.sum(axis=-1)
