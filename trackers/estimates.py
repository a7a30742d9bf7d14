"""What a tracker believes after a step, as frozen records that know their rows in a tracks file."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from typing import Any, ClassVar, Self

import numpy as np

from arrivals.typing import Complex, Float, Int


@dataclass(frozen=True, eq=False)
class Estimate:
    """What was found in one step; the first axis of every array counts what was found.

    A kind of estimate is a frozen dataclass: `per_source` maps the name of each array field to
    what fills it up in the rectangular arrays of a `Run`; all other fields are one number a step.
    """

    per_source: ClassVar[dict[str, Any]] = {}
    columns: ClassVar[tuple[str, ...]] = ()

    @property
    def n_found(self) -> int:
        """Number of sources in this estimate."""
        return len(getattr(self, next(iter(self.per_source))))

    def rows(self) -> list[tuple[Any, ...]]:
        """Return one row for each source, in the order of `columns`."""
        raise NotImplementedError

    def per_step(self) -> tuple[str, ...]:
        """Return the names of the fields that are one number a step."""
        return tuple(f.name for f in fields(self) if f.name not in self.per_source)


@dataclass(frozen=True, eq=False)
class DirectionEstimate(Estimate):
    """Directions of arrival found in one step.

    Parameters
    ----------
    doa : ndarray, shape (n_found,)
        Directions of arrival, rad.
    std : ndarray, shape (n_found,)
        Their standard deviations, rad; NaN where the method gives none.
    existence : ndarray, shape (n_found,)
        Probability that the source is there; NaN where the method gives none.
    amplitude : ndarray, shape (n_found,)
        Complex amplitude at the origin of the array's coordinates; NaN where there is none.
    label : ndarray of int, shape (n_found,)
        Stays with a source while it is tracked; -1 from methods that do not track.
    converged : bool
        False if an iterative method stopped before it met its tolerance.
    iterations : int
        Iterations that this step took; 0 for a method without.
    noise : float
        Estimated variance of the noise at one sensor; NaN where the method gives none.
    """

    doa: Float
    std: Float
    existence: Float
    amplitude: Complex
    label: Int
    converged: bool = True
    iterations: int = 0
    noise: float = np.nan

    per_source: ClassVar[dict[str, Any]] = {
        "doa": np.nan,
        "std": np.nan,
        "existence": np.nan,
        "amplitude": complex(np.nan, np.nan),
        "label": -1,
    }
    columns: ClassVar[tuple[str, ...]] = ("label", "doa_deg", "std_deg", "existence", "level_db")

    @classmethod
    def empty(cls, **others: Any) -> Self:
        """Return the estimate of a step in which no source was detected.

        Examples
        --------
        >>> DirectionEstimate.empty().n_found
        0
        """
        none = np.zeros(0)
        return cls(none, none, none, none.astype(complex), none.astype(np.int64), **others)

    def rows(self) -> list[tuple[Any, ...]]:
        """Return label, direction and its standard deviation in degrees, existence, level in dB."""
        with np.errstate(divide="ignore"):
            level_db = 20 * np.log10(np.abs(self.amplitude))
        degrees = np.rad2deg([self.doa, self.std])
        return list(zip(self.label, *degrees, self.existence, level_db, strict=True))


@dataclass(frozen=True, eq=False)
class SourceEstimate(DirectionEstimate):
    """Directions of arrival and autoregressive models of the sources.

    Parameters
    ----------
    doa : ndarray, shape (n_found,)
        Directions of arrival, rad.
    std : ndarray, shape (n_found,)
        Their standard deviations, rad; NaN where the method gives none.
    existence : ndarray, shape (n_found,)
        Probability that the source is active; NaN where the method gives none.
    amplitude : ndarray, shape (n_found,)
        Latest complex sample of each source.
    label : ndarray of int, shape (n_found,)
        Index of the source in the motion model.
    converged : bool
        False if an iterative method stopped before it met its tolerance.
    iterations : int
        Iterations of this step; 0 for a method without.
    noise : float
        Estimated variance of the noise at one sensor; NaN where the method gives none.
    coefficients : ndarray, shape (n_found, largest order)
        AR coefficients, zero beyond the order of a source.
    innovation_variance : ndarray, shape (n_found,)
        Variance of the innovations of each source.

    Examples
    --------
    >>> SourceEstimate.empty(coefficients=np.zeros((0, 2))).n_found
    0
    """

    coefficients: Float = field(default_factory=lambda: np.zeros((0, 0)))
    innovation_variance: Float = field(default_factory=lambda: np.zeros(0))

    per_source: ClassVar[dict[str, Any]] = DirectionEstimate.per_source | {
        "coefficients": np.nan,
        "innovation_variance": np.nan,
    }


@dataclass(frozen=True, eq=False)
class PositionEstimate(Estimate):
    """Positions found in one step.

    Parameters
    ----------
    position : ndarray, shape (n_found, 2)
        Positions, m.
    covariance : ndarray, shape (n_found, 2, 2)
        Their covariances, m².
    log_amplitude : ndarray, shape (n_found,)
        Logarithm of the source's amplitude, neper.
    existence : ndarray, shape (n_found,)
        Probability that the source is there; NaN where the method gives none.
    label : ndarray of int, shape (n_found,)
        Stays with a source while it is tracked; -1 from methods that do not track.
    converged : bool
        False if an iterative method stopped before it met its tolerance.
    iterations : int
        Iterations that this step took; 0 for a method without.
    fit : float
        Probability of a larger misfit than this step's, if the solution is right; NaN where the
        method gives none.
    poor_fit : bool
        The misfit is too large for the solution, or the model, to be right.
    diverged : bool
        The solution is not to be believed at all.
    """

    position: Float
    covariance: Float
    log_amplitude: Float
    existence: Float
    label: Int
    converged: bool = True
    iterations: int = 0
    fit: float = np.nan
    poor_fit: bool = False
    diverged: bool = False

    per_source: ClassVar[dict[str, Any]] = {
        "position": np.nan,
        "covariance": np.nan,
        "log_amplitude": np.nan,
        "existence": np.nan,
        "label": -1,
    }
    columns: ClassVar[tuple[str, ...]] = (
        "label", "x_m", "y_m", "std_x_m", "std_y_m", "corr", "existence", "level_db",
    )  # fmt: skip

    def rows(self) -> list[tuple[Any, ...]]:
        """Return label, position, standard deviations and correlation, existence, level in dB."""
        x, y = self.position.T
        variance = np.diagonal(self.covariance, axis1=-2, axis2=-1)
        std_x, std_y = np.sqrt(variance).T
        with np.errstate(invalid="ignore", divide="ignore"):
            corr = self.covariance[:, 0, 1] / (std_x * std_y)
        level_db = 20 / np.log(10) * self.log_amplitude
        return list(
            zip(self.label, x, y, std_x, std_y, corr, self.existence, level_db, strict=True)
        )


@dataclass(frozen=True, eq=False)
class StateEstimate(Estimate):
    """Mean and covariance of a state; "what was found" are its entries.

    Parameters
    ----------
    x : ndarray, shape (n,)
    P : ndarray, shape (n, n)

    Examples
    --------
    >>> StateEstimate(np.array([3.0]), np.array([[4.0]])).rows()
    [(0, 3.0, 2.0)]
    """

    x: Float
    P: Float

    per_source: ClassVar[dict[str, Any]] = {"x": np.nan, "P": np.nan}
    columns: ClassVar[tuple[str, ...]] = ("entry", "x", "std")

    def rows(self) -> list[tuple[Any, ...]]:
        """Return number, mean and standard deviation of each entry of the state."""
        std = np.sqrt(np.maximum(self.P.diagonal(), 0))
        return list(zip(range(len(self.x)), self.x.tolist(), std.tolist(), strict=True))
