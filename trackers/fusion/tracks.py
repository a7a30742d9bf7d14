"""Tracks of a hypothesis as arrays, and hypotheses stacked along a batch axis."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple, Self

import numpy as np

from arrivals.typing import Float, Int


class Tracks(NamedTuple):
    """Gaussian states of sources that exist with a probability; leading axes are batch axes.

    Parameters
    ----------
    x : ndarray, shape (..., n_tracks, n)
        Means.
    P : ndarray, shape (..., n_tracks, n, n)
        Covariances.
    existence : ndarray, shape (..., n_tracks)
        Probabilities; 0 in places without a track.
    label : ndarray of int, shape (..., n_tracks)
        Identities; -1 in places without a track.
    age : ndarray of int, shape (..., n_tracks)
        Numbers of steps since the birth.
    received : ndarray, shape (..., n_tracks, n_stations)
        Weights of the bearings of each station in the last update.

    Examples
    --------
    >>> Tracks.empty(n=4, n_stations=2).joined(Tracks.empty(4, 2)).x.shape
    (0, 4)
    """

    x: Float
    P: Float
    existence: Float
    label: Int
    age: Int
    received: Float

    @classmethod
    def empty(cls, n: int, n_stations: int, *shape: int) -> Tracks:
        """Return places without tracks, (*shape, n); none without a shape."""
        shape = shape or (0,)
        no_label = np.full(shape, -1)
        return cls(
            np.zeros((*shape, n)), np.zeros((*shape, n, n)), np.zeros(shape), no_label,
            np.zeros(shape, dtype=np.int64), np.zeros((*shape, n_stations)),
        )  # fmt: skip

    @property
    def n_tracks(self) -> int:
        """Number of places."""
        return int(self.existence.shape[-1])

    def select(self, rows: Any) -> Tracks:
        """Return the tracks at some rows of the first axis."""
        parts: list[Any] = [part[rows] for part in self]
        return Tracks(*parts)

    def joined(self, others: Tracks) -> Tracks:
        """Return these and other tracks along the first axis."""
        parts: list[Any] = [np.concatenate(pair) for pair in zip(self, others, strict=True)]
        return Tracks(*parts)

    def relabelled(self, label: Int) -> Self:
        """Return the tracks with other labels."""
        return self._replace(label=label)


def stacked(hypotheses: Sequence[Tracks]) -> Tracks:
    """Return hypotheses along a first axis, padded to the largest number of tracks.

    Examples
    --------
    >>> one, none = Tracks.empty(4, 2, 1), Tracks.empty(4, 2)
    >>> stacked([one, none]).P.shape
    (2, 1, 4, 4)
    """
    if len(hypotheses) == 1:
        return hypotheses[0].select(None)
    most = max(tracks.n_tracks for tracks in hypotheses)
    n, n_stations = hypotheses[0].x.shape[-1], hypotheses[0].received.shape[-1]
    batch = Tracks.empty(n, n_stations, len(hypotheses), most)
    for row, tracks in enumerate(hypotheses):
        for whole, part in zip(batch, tracks, strict=True):
            whole[row, : len(part)] = part
    return batch


def unstacked(batch: Tracks, sizes: Sequence[int]) -> list[Tracks]:
    """Return the hypotheses of a batch, each with its own number of tracks."""
    return [batch.select((row, slice(n))) for row, n in enumerate(sizes)]


def squared_distances(d: Float, P: Float) -> Float:
    """Return d' P⁻¹ d of vectors (..., n) and covariances (..., n, n); inf where P is singular.

    Examples
    --------
    >>> squared_distances(np.array([2.0, 1.0]), np.diag([4.0, 1.0]))
    array(2.)
    """
    if d.shape[-1] == 2:
        a, b, c = P[..., 0, 0], P[..., 0, 1], P[..., 1, 1]
        determinant = a * c - b * b
        square = c * d[..., 0] ** 2 - 2 * b * d[..., 0] * d[..., 1] + a * d[..., 1] ** 2
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.where(determinant > 0, square / determinant, np.inf)
    try:
        return np.asarray((d * np.linalg.solve(P, d[..., None])[..., 0]).sum(axis=-1))
    except np.linalg.LinAlgError:
        return np.full(d.shape[:-1], np.inf)
