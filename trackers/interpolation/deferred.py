"""Quantities of an update that are computed when they are read."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from arrivals.trackers.gaussian.equations import GaussianUpdate, update_gaussian
from arrivals.trackers.gaussian.linalg import Inverse
from arrivals.trackers.interpolation.sample_buffer import SampleBuffer
from arrivals.trackers.interpolation.updates import DelayObservation
from arrivals.typing import Float, Int

if TYPE_CHECKING:
    from arrivals.trackers.gaussian.base import GaussianFilter as Base
    from arrivals.trackers.interpolation.assembly import FilterAssembly
else:
    Base = object

NOTHING, NO_EVIDENCE = np.zeros(0), np.zeros(())
NAMES = ("y", "K", "S", "SI", "log_likelihood", "mahalanobis")


@dataclass(frozen=True, eq=False)
class SnapshotObservation:
    """A belief and the newest snapshots, that residuals are linearized at.

    Parameters
    ----------
    assembly : FilterAssembly
    grid_index : ndarray of int, shape (n_sensors,)
    x, P : ndarray, shapes (dim_x,), (dim_x, dim_x)
    samples : ndarray, shape (span, n_grid_points)
        Snapshots, scaled to a source of power 1.
    buffer : SampleBuffer
        Of the same snapshots.
    """

    assembly: FilterAssembly
    grid_index: Int
    x: Float
    P: Float
    samples: Float
    buffer: SampleBuffer

    def linearized(self) -> DelayObservation:
        """Return the residuals of the latest snapshot, in the order of sensors."""
        n, rows = max(self.buffer.n_snapshots, 1), self.grid_index
        y, H, R = self.assembly.linearize(self.x, self.P, self.samples, n, self.buffer.misfit)
        return DelayObservation(y[rows], H[rows], R[rows])

    def update(self, inv: Inverse, noise: Float | None = None) -> GaussianUpdate:
        """Return the update by one vector of residuals, with their own or another noise."""
        # y = y_j - c'X (11), H = m c''X, R, one residual a sensor
        y, H, variance = self.linearized()
        R = np.diag(variance) if noise is None else noise
        # K = P H' (H P H' + R)^-1, x = x + K y, P = P - K H P   (20)-(23)
        return update_gaussian(self.x, self.P, y, H, R, np.asarray(~H.any(axis=-1)), inv)


@dataclass(frozen=True, eq=False)
class DeferredUpdate:
    """What the quantities of an update follow from.

    Parameters
    ----------
    observation : SnapshotObservation
    inv : callable
        Inverts S.
    column : bool
        Whether the mean is a column, and so the residual.
    """

    observation: SnapshotObservation
    inv: Inverse
    column: bool

    def values(self) -> dict[str, Any]:
        """Return the quantities by name."""
        update = self.observation.update(self.inv)
        return {
            "y": update.y[:, None] if self.column else update.y,
            "K": update.K,
            "S": update.S,
            "SI": update.SI,
            "log_likelihood": float(update.log_likelihood),
            "mahalanobis": max(float(update.square), 0.0) ** 0.5,
        }


def _deferred(name: str, doc: str) -> Any:
    def read(self: Deferring) -> Any:
        return self.computed()[name]

    def assign(self: Deferring, value: Any) -> None:
        vars(self).update(recorded=self.computed() | {name: value}, deferred=None)

    return property(read, assign, doc=doc)


class Deferring(Base):
    """Base of a filter whose quantities of the last update are computed when they are read.

    Attributes
    ----------
    recorded : dict of str to object
        Those that are known, by name.
    deferred : DeferredUpdate or None
        What they follow from, if they are not known.
    """

    recorded: dict[str, Any]
    deferred: DeferredUpdate | None

    y = _deferred("y", "Residual of the last measurement, 0 where none was used.")
    K = _deferred("K", "Gain of the last measurement.")
    S = _deferred("S", "Covariance of the residual.")
    SI = _deferred("SI", "Inverse of `S`.")
    log_likelihood = _deferred("log_likelihood", "Log likelihood of the last measurement.")
    mahalanobis = _deferred("mahalanobis", "Mahalanobis distance of the last measurement.")

    def computed(self) -> dict[str, Any]:
        """Return the quantities of the last update, computed at the first call."""
        own = vars(self)
        if own.get("deferred") is not None:
            own.update(recorded=own["deferred"].values(), deferred=None)
        recorded: dict[str, Any] = own.get("recorded", {})
        return recorded

    def record_update(self, z: Float, update: GaussianUpdate) -> None:
        """Set the belief and the attributes of the last measurement."""
        super().record_update(z, update)
        own = vars(self)
        own.update(recorded={name: own.pop(name) for name in NAMES}, deferred=None)

    def record_deferred(
        self, z: Float, x: Float, P: Float, observation: SnapshotObservation
    ) -> None:
        """Set the belief, and what the other attributes follow from."""
        self.record_update(z, GaussianUpdate(x, P, *(NOTHING,) * 4, NO_EVIDENCE, NO_EVIDENCE, 0))
        vars(self)["deferred"] = DeferredUpdate(observation, self.inv, np.ndim(self.x) > 1)
