"""Estimates of one step as frozen records, with their rows in a tracks file."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np

from arrivals.typing import Complex, Float, Int


@dataclass(frozen=True, eq=False)
class Estimate:
    """Base of the estimates of one step; the first axis of every array counts sources.

    A subclass is a frozen dataclass: `per_source` maps the name of each array field to the value
    that pads the rectangular arrays of a `Run`; all other fields are one number per step.
    `columns` names the entries of a row in a tracks file.

    Examples
    --------
    >>> DirectionEstimate.empty(noise=0.1).per_step()
    ('converged', 'iterations', 'noise')
    """

    per_source: ClassVar[dict[str, Any]] = {}
    columns: ClassVar[tuple[str, ...]] = ()

    @property
    def n_found(self) -> int:
        """Number of sources in this estimate."""
        return len(getattr(self, next(iter(self.per_source))))

    def rows(self) -> list[tuple[Any, ...]]:
        """Return one row per source.

        Returns
        -------
        list of tuple
            Cells in the order of `columns`.
        """
        raise NotImplementedError

    def per_step(self) -> tuple[str, ...]:
        """Return the names of the fields that are one number per step.

        Returns
        -------
        tuple of str
            Names.
        """
        return tuple(f.name for f in fields(self) if f.name not in self.per_source)


@dataclass(frozen=True, eq=False)
class DirectionEstimate(Estimate):
    """Directions of arrival of the sources detected in one step.

    Parameters
    ----------
    doa : ndarray, shape (n_sources,)
        Directions of arrival, rad.
    std : ndarray, shape (n_sources,)
        Standard deviations, rad; NaN if the method does not estimate them.
    existence : ndarray, shape (n_sources,)
        Probability of existence; NaN if the method does not estimate it.
    amplitude : ndarray, shape (n_sources,), or function without arguments
        Complex amplitude at the origin of the array's coordinates; NaN if not estimated. A
        function computes it when it is read first.
    label : ndarray of int, shape (n_sources,)
        Identity of a tracked source; -1 for methods that do not track.
    converged : bool
        False if an iterative method stopped before it met its tolerance.
    iterations : int
        Number of iterations of this step; 0 for methods without iteration.
    noise : float
        Estimated noise variance of one sensor; NaN if the method does not estimate it.

    Examples
    --------
    >>> one = np.ones(1)
    >>> DirectionEstimate(0.5 * one, 0.01 * one, one, one + 0j, np.array([7])).n_found
    1
    >>> DirectionEstimate(one, one, one, lambda: 3j * one, np.array([7])).amplitude
    array([0.+3.j])
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
    n_unknowns: ClassVar[int] = 1

    def __post_init__(self) -> None:
        if callable(self.amplitude):
            parts = vars(self)
            parts["_amplitude"] = parts.pop("amplitude")

    if not TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any:  # of an attribute that is not there
            parts = vars(self)
            compute = parts.get("_amplitude") if name == "amplitude" else None
            if compute is not None:
                parts["amplitude"] = compute()
                parts.pop("_amplitude", None)  # another thread may have read it, too
            elif name != "amplitude" or name not in parts:
                raise AttributeError(f"{type(self).__name__} has no attribute {name!r}")
            return parts[name]

    def __getstate__(self) -> dict[str, Any]:  # copies have numbers
        self.amplitude  # noqa: B018
        return dict(vars(self))

    @classmethod
    def empty(cls, **others: Any) -> Self:
        """Return the estimate of a step without a detected source.

        Parameters
        ----------
        **others : object
            Fields with one number per step.

        Returns
        -------
        DirectionEstimate
            Arrays of length zero.

        Examples
        --------
        >>> DirectionEstimate.empty().n_found
        0
        """
        none = np.zeros(0)
        return cls(none, none, none, none.astype(complex), none.astype(np.int64), **others)

    def rows(self) -> list[tuple[Any, ...]]:
        """Return label, direction and its standard deviation in degrees, existence, level in dB.

        Returns
        -------
        list of tuple
            One row per source.
        """
        with np.errstate(divide="ignore"):
            level_db = 20 * np.log10(np.abs(self.amplitude))
        degrees = np.rad2deg([self.doa, self.std])
        return list(zip(self.label, *degrees, self.existence, level_db, strict=True))

    def unknowns(self) -> tuple[Float, Float]:
        """Return the unknowns of each source, (n_sources, d), and covariances (n_sources, d, d).

        Examples
        --------
        >>> DirectionEstimate.empty().unknowns()[1].shape
        (0, 1, 1)
        """
        return self.doa[:, None], (self.std**2)[:, None, None]


@dataclass(frozen=True, eq=False)
class PositionEstimate(Estimate):
    """Positions of the sources detected in one step.

    Parameters
    ----------
    position : ndarray, shape (n_sources, 2)
        Positions, m.
    covariance : ndarray, shape (n_sources, 2, 2)
        Covariances, m².
    log_amplitude : ndarray, shape (n_sources,)
        Logarithm of the source's amplitude, neper.
    existence : ndarray, shape (n_sources,)
        Probability of existence; NaN if the method does not estimate it.
    label : ndarray of int, shape (n_sources,)
        Identity of a tracked source; -1 for methods that do not track.
    converged : bool
        False if an iterative method stopped before it met its tolerance.
    iterations : int
        Number of iterations of this step; 0 for methods without iteration.
    fit : float
        p-value: probability of a larger misfit than this step's, if the solution is right; NaN if
        the method does not compute it.
    poor_fit : bool
        True if the misfit is too large for the solution, or the model, to be right.
    diverged : bool
        True if the solution is invalid.

    Examples
    --------
    >>> one = np.ones(1)
    >>> P = np.diag([4.0, 9.0])[None]
    >>> PositionEstimate(np.array([[1.0, 2.0]]), P, 0 * one, one, np.array([7])).rows()[0][1:5]
    (np.float64(1.0), np.float64(2.0), np.float64(2.0), np.float64(3.0))
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
        """Return label, position, standard deviations and correlation, existence, level in dB.

        Returns
        -------
        list of tuple
            One row per source.
        """
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
    """Mean and covariance of a state; its entries take the place of sources.

    Parameters
    ----------
    x : ndarray, shape (n,)
        Mean.
    P : ndarray, shape (n, n)
        Covariance.

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
        """Return number, mean and standard deviation of each entry of the state.

        Returns
        -------
        list of tuple
            One row per entry.
        """
        std = np.sqrt(np.maximum(self.P.diagonal(), 0))
        return list(zip(range(len(self.x)), self.x.tolist(), std.tolist(), strict=True))
