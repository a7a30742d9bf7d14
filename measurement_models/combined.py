"""Several measurements of one state, stacked."""

from __future__ import annotations

import inspect
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.base import MeasurementModel, paired
from arrivals.measurements import numbers, real_numbers
from arrivals.typing import Float
from arrivals.validation import instance, real, shaped, state


@dataclass(frozen=True, init=False)
class CombinedMeasurement(MeasurementModel):
    """Measurements [z₁, z₂, ...] of one state whose noises are independent.

    Parameters
    ----------
    first : MeasurementModel
        Model of the first part.
    second : MeasurementModel
        Model of the second part. More parts may follow: `second` is then a `CombinedMeasurement`
        of all but the first.

    Raises
    ------
    TypeError
        If a part is not a measurement model.

    Notes
    -----
    Shapes: states (..., n), measurements (..., first.dim_z + second.dim_z). `stack` makes one
    measurement of those of the parts. Missing entries are NaN: a part that is missing leaves the
    others in use.

    Examples
    --------
    Bearings from two stations, and the distance from the first:

    >>> from arrivals.measurement_models import Bearing, FunctionMeasurement
    >>> bearings = Bearing([[0.0, 0.0], [10.0, 0.0]], noise=1e-4)
    >>> distance = FunctionMeasurement(lambda x: np.hypot(x[0], x[1]), R=0.04, needs=["x", "y"])
    >>> both = CombinedMeasurement(bearings, distance)
    >>> both.for_state(["x", "vx", "y", "vy"]).h([3.0, 0.0, 4.0, 0.0]).round(2)
    array([0.93, 2.62, 5.  ])
    >>> both.stack(None, 5.1)
    array([nan, nan, 5.1])
    """

    first: MeasurementModel
    second: MeasurementModel

    def __init__(
        self, first: MeasurementModel, second: MeasurementModel, *more: MeasurementModel
    ) -> None:
        if more:
            second = CombinedMeasurement(second, *more)
        instance("first", first, MeasurementModel)  # type: ignore[type-abstract]  # any
        instance("second", second, MeasurementModel)  # type: ignore[type-abstract]  # any
        object.__setattr__(self, "first", first)
        object.__setattr__(self, "second", second)

    # `more` is not a parameter of its own: what it holds is in `second`.
    __signature__ = inspect.Signature(list(inspect.signature(__init__).parameters.values())[1:3])

    @property
    def parts(self) -> tuple[MeasurementModel, ...]:
        """All parts, those of `second` one by one."""
        second = self.second
        rest = second.parts if isinstance(second, CombinedMeasurement) else (second,)
        return self.first, *rest

    @property
    def dim_z(self) -> int:
        """Entries of all parts."""
        return self.first.dim_z + self.second.dim_z

    @property
    def R(self) -> Float:
        """Covariance of the noise: those of the parts on the diagonal."""
        n, R = self.first.dim_z, np.zeros((self.dim_z, self.dim_z))
        R[:n, :n], R[n:, n:] = self.first.R, self.second.R
        return R

    @property
    def needs(self) -> tuple[str, ...]:
        """Names that any part reads."""
        return tuple(dict.fromkeys((*self.first.needs, *self.second.needs)))

    @property
    def is_linear(self) -> bool:
        """True if all parts are linear."""
        return self.first.is_linear and self.second.is_linear

    def for_state(self, names: Sequence[str]) -> MeasurementModel:
        """Return the parts for states with these names, combined."""
        return self._of(self.first.for_state(names), self.second.for_state(names))

    def for_likelihood(self, names: Sequence[str]) -> MeasurementModel:
        """Return the parts for `log_likelihood` at states with these names, combined."""
        return self._of(self.first.for_likelihood(names), self.second.for_likelihood(names))

    def h(self, x: ArrayLike) -> Float:
        """Return the measurements expected of states: (..., n) -> (..., dim_z)."""
        return np.concatenate([self.first.h(x), self.second.h(x)], axis=-1)

    def H(self, x: ArrayLike) -> Float:
        """Return the Jacobian of `h` at one state, (dim_z, n)."""
        return np.concatenate([self.first.H(x), self.second.H(x)])

    def residual(self, z: ArrayLike, z_pred: ArrayLike) -> Float:
        """Return the residuals of the parts."""
        z, z_pred = paired(z, z_pred)
        z, z_pred = state(z, self.dim_z), state(z_pred, self.dim_z)
        (z1, z2), (pred1, pred2) = self._split(z), self._split(z_pred)
        parts = [self.first.residual(z1, pred1), self.second.residual(z2, pred2)]
        return np.concatenate(parts, axis=-1)

    def sample(self, x: ArrayLike, rng: np.random.Generator) -> Float:
        """Draw a measurement of each state, each part by its own `sample`."""
        self.h(x)  # refuses a state before anything is drawn
        return np.concatenate([self.first.sample(x, rng), self.second.sample(x, rng)], axis=-1)

    def log_likelihood(self, z: ArrayLike, x: ArrayLike) -> Float:
        """Return ln p(z | x) of one measurement (dim_z,) at states (..., n).

        The sum over the parts that are not missing: by the part's own `log_likelihood` where it
        has one, else that of Gaussian noise.
        """
        z, x = shaped("z", real_numbers("z", z), self.dim_z), real("x", x)
        total = np.zeros(())
        for part, own in zip((self.first, self.second), self._split(z), strict=True):
            if not np.isnan(own).all():
                exact = getattr(part, "log_likelihood", None)
                total = total + (_gaussian(part, own, x) if exact is None else exact(own, x))
        return np.asarray(total + np.zeros(np.shape(x)[:-1]))

    def stack(self, *measurements: ArrayLike | None) -> Float:
        """Return the measurements of all `parts` as one, (dim_z,); None is a missing one.

        Parameters
        ----------
        *measurements : array_like or None
            One of each part; complex snapshots become `composite`.

        Returns
        -------
        ndarray, shape (dim_z,)

        Raises
        ------
        ValueError
            If their number, or the size of one, is wrong.
        """
        parts = self.parts
        if len(measurements) != len(parts):
            raise ValueError(
                f"stack must get {len(parts)} measurements, one of each part; "
                f"got {len(measurements)}"
            )
        return np.concatenate([_row(part, z) for part, z in zip(parts, measurements, strict=True)])

    def _of(self, first: MeasurementModel, second: MeasurementModel) -> MeasurementModel:
        same = first is self.first and second is self.second
        return self if same else CombinedMeasurement(first, second)

    def _split(self, z: Float) -> tuple[Float, Float]:
        n = self.first.dim_z
        return z[..., :n], z[..., n:]


def _row(part: MeasurementModel, z: ArrayLike | None) -> Float:
    n = part.dim_z
    if z is None:
        return np.full(n, np.nan)
    row = np.ravel(numbers("z", z))
    if row.dtype.kind == "c":
        row = np.concatenate([row.real, row.imag])
    if len(row) != n:
        raise ValueError(f"a measurement of {type(part).__name__} must have {n} entries; "
                         f"got {len(row)}")  # fmt: skip
    return row


def _gaussian(part: MeasurementModel, z: Float, x: ArrayLike) -> Float:
    """Return ln N(z; h(x), R) over the entries that are not NaN."""
    there = ~np.isnan(z)
    y = part.residual(z, part.h(x))[..., there]
    try:
        L = np.linalg.cholesky(part.R[np.ix_(there, there)])
    except np.linalg.LinAlgError:
        raise ValueError(f"R of {type(part).__name__} must be positive; got no factor") from None
    white = np.linalg.solve(L, y[..., None])[..., 0]
    log_det = np.log(2 * np.pi) * len(L) / 2 + np.log(L.diagonal()).sum()
    return np.asarray(-0.5 * (white * white).sum(axis=-1) - log_det)
