"""Base class of measurement models."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from arrivals.abstract_fields import property_or_field
from arrivals.entry_names import checked_names
from arrivals.parameters import FrozenModel
from arrivals.typing import Float
from arrivals.validation import instance, real, state


class MeasurementModel(FrozenModel, ABC):
    """Measurement of a state: z = h(x) + v, v ~ (0, R).

    A model is frozen. The members below are its Gaussian interface, in filterpy's calling
    convention; the bound methods go into filterpy's filters as they are.

    Notes
    -----
    Shapes: states (..., dim_x), measurements (..., dim_z), any leading axes. `dim_z`, `R` and
    `needs` may be properties, class attributes or dataclass fields.

    Examples
    --------
    The distance of a position from the origin:

    >>> @dataclass(frozen=True, eq=False)
    ... class Range(MeasurementModel):
    ...     R: np.ndarray
    ...     dim_z, needs = 1, ("x", "y")
    ...     def h(self, x):
    ...         return np.hypot(x[..., 0], x[..., 1])[..., None]
    ...     def H(self, x):
    ...         return np.array([x / np.hypot(*x)])
    >>> Range(np.eye(1)).for_state(("x", "vx", "y", "vy")).H(np.array([3.0, 0.0, 4.0, 0.0]))
    array([[0.6, 0. , 0.8, 0. ]])
    """

    @property_or_field
    @abstractmethod
    def dim_z(self) -> int:
        """Number of entries of one measurement."""

    @property_or_field
    @abstractmethod
    def R(self) -> Float:
        """Covariance of the measurement noise, (dim_z, dim_z)."""

    @property_or_field
    def needs(self) -> tuple[str, ...]:
        """Names of the entries of a state that `h` reads; () for any state of the right size."""
        return ()

    @property_or_field
    def is_linear(self) -> bool:
        """True if h(x) = H x, with the same H at every state."""
        return False

    def for_state(self, names: Sequence[str]) -> MeasurementModel:
        """Return this model for states whose entries have these names.

        Parameters
        ----------
        names : sequence of str
            `state_names` of a motion model; () where entries have no names.

        Returns
        -------
        MeasurementModel
            The model itself where `names` or `needs` are (), or no entry has to be moved.

        Raises
        ------
        TypeError
            If the state lacks an entry that the model reads.

        Examples
        --------
        >>> from arrivals.measurement_models import Bearing, Phasor
        >>> Bearing([[0.0, 0.0]], noise=0.01).for_state(("x", "vx", "y", "vy")).position
        (0, 2)
        >>> Phasor(3, 0.1, frequency=0.25).for_state(("x", "y"))
        Traceback (most recent call last):
        TypeError: measurement must read entries of the state: Phasor needs 'delay'; got 'x', 'y'
        """
        names = checked_names(names)
        if not names or not self.needs:
            return self
        entries, everything = locate(self, names), tuple(range(len(names)))
        return self if entries == everything else SelectedEntries(self, entries, tuple(names))

    def for_likelihood(self, names: Sequence[str]) -> MeasurementModel:
        """Return this model for filters that weight states by `log_likelihood`, if it has one.

        The same as `for_state`, except for models whose likelihood needs fewer entries than `h`.
        """
        return self.for_state(names)

    @abstractmethod
    def h(self, x: ArrayLike) -> Float:
        """Return the measurements expected of states: (..., dim_x) -> (..., dim_z)."""

    @abstractmethod
    def H(self, x: ArrayLike) -> Float:
        """Return the Jacobian of `h` at one state, (dim_z, dim_x)."""

    def h_and_H(self, x: ArrayLike) -> tuple[Float, Float]:
        """Return `h` and `H` of one state; models in which they share work do it once."""
        return self.h(x), self.H(x)

    def residual(self, z: ArrayLike, z_pred: ArrayLike) -> Float:
        """Return z - z_pred; models whose measurement is an angle wrap it."""
        z, z_pred = paired(z, z_pred)
        return z - z_pred

    def sample(self, x: ArrayLike, rng: np.random.Generator) -> Float:
        """Draw a measurement of each state: (..., dim_x) -> (..., dim_z)."""
        expected, rng = self.h(x), instance("rng", rng, np.random.Generator)
        noise = rng.multivariate_normal(np.zeros(self.dim_z), self.R, expected.shape[:-1])
        return np.asarray(expected + noise)


@dataclass(frozen=True)
class WrappedMeasurement(MeasurementModel):
    """Base of models that change one thing of another model and pass on the rest.

    Parameters
    ----------
    measurement : MeasurementModel
        The other model.

    Examples
    --------
    >>> from arrivals.measurement_models import LinearMeasurement
    >>> WrappedMeasurement(LinearMeasurement([[2.0]], [[1.0]])).h([3.0])
    array([6.])
    """

    measurement: MeasurementModel

    @property
    def dim_z(self) -> int:
        """That of the model."""
        return self.measurement.dim_z

    @property
    def R(self) -> Float:
        """That of the model."""
        return self.measurement.R

    @property
    def needs(self) -> tuple[str, ...]:
        """Those of the model."""
        return self.measurement.needs

    @property
    def is_linear(self) -> bool:
        """That of the model."""
        return self.measurement.is_linear

    def h(self, x: ArrayLike) -> Float:
        """Return the measurements expected of states: (..., dim_x) -> (..., dim_z)."""
        return self.measurement.h(x)

    def H(self, x: ArrayLike) -> Float:
        """Return the Jacobian of `h` at one state, (dim_z, dim_x)."""
        return self.measurement.H(x)

    def residual(self, z: ArrayLike, z_pred: ArrayLike) -> Float:
        """Return the residual of the model."""
        return self.measurement.residual(z, z_pred)


@dataclass(frozen=True)
class SelectedEntries(WrappedMeasurement):
    """A measurement model that reads some entries of a longer state.

    Parameters
    ----------
    measurement : MeasurementModel
        Model of states that hold these entries alone.
    entries : tuple of int
        Places of the entries in the state, in the order of the model.
    names : tuple of str
        Names of all entries of the state.

    Examples
    --------
    >>> from arrivals.measurement_models import Phasor
    >>> phasor = Phasor(3, 0.1, frequency=0.25)
    >>> names = ("x", "delay", "amplitude_re", "amplitude_im")
    >>> phasor.for_state(names).h([7.0, 0.5, 1.0, 0.0]).round(3)
    array([0.707, 1.   , 0.707])
    """

    entries: tuple[int, ...]
    names: tuple[str, ...]

    def for_state(self, names: Sequence[str]) -> MeasurementModel:
        """Return the model for states with these names."""
        return self if checked_names(names) == self.names else self.measurement.for_state(names)

    def h(self, x: ArrayLike) -> Float:
        """Return the measurements expected of states: (..., dim_x) -> (..., dim_z)."""
        return self.measurement.h(self.select(x))

    def H(self, x: ArrayLike) -> Float:
        """Return the Jacobian of `h` at one state, zero for the other entries."""
        H = np.zeros((self.dim_z, len(self.names)))
        H[:, self.entries] = self.measurement.H(self.select(x))
        return H

    def sample(self, x: ArrayLike, rng: np.random.Generator) -> Float:
        """Draw a measurement of each state: (..., dim_x) -> (..., dim_z)."""
        return self.measurement.sample(self.select(x), rng)

    def select(self, x: ArrayLike) -> Float:
        """Return the entries that the model reads of states (..., dim_x)."""
        return state(x, len(self.names))[..., self.entries]


def locate(measurement: MeasurementModel, names: Sequence[str]) -> tuple[int, ...]:
    """Return the places of the entries that a model needs in a state with these names.

    Raises
    ------
    TypeError
        If the state lacks one.

    Examples
    --------
    >>> from arrivals.measurement_models import Bearing
    >>> locate(Bearing([[0.0, 0.0]], noise=0.01), ["x", "vx", "y", "vy"])
    (0, 2)
    """
    missing = [name for name in measurement.needs if name not in names]
    if missing:
        raise TypeError(
            f"measurement must read entries of the state: {type(measurement).__name__} needs "
            f"{missing[0]!r}; got {', '.join(map(repr, names))}"
        )
    return tuple(names.index(name) for name in measurement.needs)


def paired(z: ArrayLike, z_pred: ArrayLike) -> tuple[Float, Float]:
    """Return two measurements, or stacks of them, whose shapes fit.

    Examples
    --------
    >>> paired([1.0, 2.0], [1.0, 2.0, 3.0])
    Traceback (most recent call last):
    ValueError: z and z_pred must have the same shape; got (2,) and (3,)
    """
    z, z_pred = real("z", z), real("z_pred", z_pred)
    if z.shape not in (z_pred.shape, z_pred.shape[-1:]):
        try:
            np.broadcast(z, z_pred)
        except (ValueError, RuntimeError):
            shapes = f"{z.shape} and {z_pred.shape}"
            raise ValueError(f"z and z_pred must have the same shape; got {shapes}") from None
    return z, z_pred


def default_position(n: int) -> tuple[int, int]:
    """Return the entries that are x and y of states of n entries without names.

    Examples
    --------
    >>> default_position(2), default_position(4)
    ((0, 1), (0, 2))
    """
    return (0, 1) if n < 4 else (0, 2)
