"""Construction by dimensions: unit matrices to start from, which scripts then assign."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np

from arrivals.measurement_models.linear import LinearMeasurement
from arrivals.motion_models.linear import LinearMotion
from arrivals.validation import count

if TYPE_CHECKING:
    from arrivals.trackers.gaussian.base import GaussianFilter as Base
else:
    Base = object


class ConstructedByDimensions(Base):
    """Base of filters that are constructed as in filterpy; their parameters are those of `plain`.

    Attributes
    ----------
    plain : type
        Class of the same filter that is constructed with models. Configurations name it.
    unused_controls : int
        Number of control inputs while `B` is not assigned.

    Examples
    --------
    >>> from arrivals.trackers.filterpy import KalmanFilter
    >>> KalmanFilter(dim_x=1, dim_z=1).to_dict()["type"]
    'kalman'
    """

    plain: ClassVar[Any]
    unused_controls = 0

    @classmethod
    def param_names(cls) -> list[str]:
        """Return the names of the parameters of `plain`."""
        names: list[str] = cls.plain.param_names()
        return names

    @classmethod
    def type_name(cls) -> str:
        """Return the name of `plain` in configurations."""
        name: str = cls.plain.type_name()
        return name

    def set_params(self, **params: Any) -> Self:
        """Change parameters by name and keep the belief."""
        changed = self.changed_params(params)
        checked = self.plain(**changed)
        for name in changed:
            setattr(self, name, getattr(checked, name))
        return self

    def __sklearn_clone__(self) -> Any:
        return self.plain(**self.get_params(deep=False))

    @property
    def dim_u(self) -> int:
        """Number of control inputs."""
        return super().dim_u or self.unused_controls


class LinearByDimensions(ConstructedByDimensions):
    """Base of those whose models are linear until others are assigned, as in `KalmanFilter`."""

    def __init__(self, dim_x: int, dim_z: int, dim_u: int = 0) -> None:
        motion, measurement = unit_models(dim_x, dim_z)
        super().__init__(motion, measurement, np.zeros((dim_x, 1)), np.eye(dim_x))
        self.unused_controls = count("dim_u", dim_u, minimum=0)


def unit_models(dim_x: int, dim_z: int) -> tuple[LinearMotion, LinearMeasurement]:
    """Return filterpy's initial models: F, Q and R are unit matrices, H is zero.

    Examples
    --------
    >>> unit_models(2, 1)[1].matrix
    array([[0., 0.]])
    """
    n, m = count("dim_x", dim_x), count("dim_z", dim_z)
    return LinearMotion(np.eye(n), np.eye(n)), LinearMeasurement(np.zeros((m, n)), np.eye(m))
