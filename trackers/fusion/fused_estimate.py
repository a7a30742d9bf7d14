"""Positions from several stations, as a frozen record with rows of a tracks file."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, ClassVar, Self

import numpy as np

from arrivals.trackers.estimates import PositionEstimate
from arrivals.trackers.fusion.fusion_step import FusionModel
from arrivals.trackers.fusion.hypotheses import LIKELY, Bank
from arrivals.trackers.fusion.tracks import Tracks
from arrivals.typing import Float

MIN_RECEIVED = 0.5  # weight of a station's bearings in a track, to be named in its row

MAX_STD = 0.05  # of a reported position, over the size of the area
SAME_PLACE = 0.03  # over the size: tracks of two hypotheses nearer than this are one source


@dataclass(frozen=True, eq=False)
class FusedEstimate(PositionEstimate):
    """Positions and velocities of the sources detected in one step, by several stations.

    Parameters
    ----------
    position, covariance, log_amplitude, existence, label, converged, iterations, fit, poor_fit, \
diverged : object
        As in `PositionEstimate`; `log_amplitude` is NaN without signal strength.
    velocity : ndarray, shape (n_sources, 2)
        Velocities, m/s; NaN where the motion has none.
    received : ndarray, shape (n_sources, n_stations)
        Weight with which the bearings of each station updated the source in this step, 0 to 1.
    n_hypotheses : int
        Number of global hypotheses.
    takeovers : int
        Number of times that hypotheses started anew have replaced the former ones.

    Examples
    --------
    >>> FusedEstimate.empty(n_stations=3).received.shape
    (0, 3)
    """

    velocity: Float = field(default_factory=lambda: np.zeros((0, 2)))
    received: Float = field(default_factory=lambda: np.zeros((0, 0)))
    n_hypotheses: int = 1
    takeovers: int = 0

    per_source: ClassVar[dict[str, Any]] = {
        **PositionEstimate.per_source,
        "velocity": np.nan,
        "received": 0.0,
    }
    columns: ClassVar[tuple[str, ...]] = (
        "label", "x_m", "y_m", "std_x_m", "std_y_m", "corr", "vx_mps", "vy_mps", "existence",
        "level_db", "heard",
    )  # fmt: skip

    @classmethod
    def empty(cls, n_stations: int, **others: Any) -> Self:
        """Return the estimate of a step without a detected source.

        Parameters
        ----------
        n_stations : int
            Number of stations.
        **others : object
            Fields with one number per step.

        Returns
        -------
        FusedEstimate
        """
        none = np.zeros(0)
        return cls(
            np.zeros((0, 2)), np.zeros((0, 2, 2)), none, none, none.astype(np.int64),
            velocity=np.zeros((0, 2)), received=np.zeros((0, n_stations)), **others,
        )  # fmt: skip

    def rows(self) -> list[tuple[Any, ...]]:
        """Return label, position, deviations, velocity, existence, level, numbers of stations.

        Returns
        -------
        list of tuple
            One row per source; the stations are numbered from 1 and joined by "+".
        """
        cells = []
        for row, velocity, received in zip(
            super().rows(), self.velocity, self.received, strict=True
        ):
            stations = "+".join(str(s + 1) for s in np.flatnonzero(received > MIN_RECEIVED))
            cells.append((*row[:6], *velocity, *row[6:], stations))
        return cells


def report(bank: Bank, model: FusionModel) -> tuple[Tracks, FusedEstimate]:
    """Return the likely tracks of the best hypothesis, by label, and the estimate of them.

    Parameters
    ----------
    bank : Bank
    model : FusionModel

    Returns
    -------
    tracks : Tracks
    estimate : FusedEstimate
        Its existence is that of all hypotheses together.
    """
    layout, tracks = model.layout, bank.hypotheses[0].tracks
    i, j = layout.position
    spread = tracks.P[:, i, i] + tracks.P[:, j, j]
    shown = (tracks.existence >= LIKELY) & (spread < (MAX_STD * model.area.size) ** 2)
    tracks = tracks.select(np.flatnonzero(shown))
    tracks = tracks.select(np.argsort(tracks.label, kind="stable"))
    position = tracks.x[:, layout.position]
    velocity, level = np.full_like(position, np.nan), np.full(tracks.n_tracks, np.nan)
    if layout.velocity is not None:
        velocity = tracks.x[:, layout.velocity]
    if layout.amplitude is not None:
        level = tracks.x[:, layout.amplitude]
    place = list(layout.position)
    return tracks, FusedEstimate(
        position, tracks.P[:, place, :][:, :, place], level,
        shared_existence(tracks.existence, position, bank, model), tracks.label,
        velocity=velocity, received=tracks.received,
        n_hypotheses=len(bank.hypotheses), takeovers=bank.takeovers,
    )  # fmt: skip


def shared_existence(r: Float, position: Float, bank: Bank, model: FusionModel) -> Float:
    """Return Σ_h w_h r_h of the sources at positions (n, 2), (n,).

    Parameters
    ----------
    r : ndarray, shape (n,)
        Existence in the best hypothesis.
    position : ndarray, shape (n, 2)
        m.
    bank : Bank
    model : FusionModel
    """
    if len(bank.hypotheses) == 1 or not len(r):
        return r
    weight = np.exp([h.log_weight for h in bank.hypotheses])
    weight /= weight.sum()
    total = r * weight[0]
    for w, hypothesis in zip(weight[1:], bank.hypotheses[1:], strict=True):
        tracks = hypothesis.tracks
        d = tracks.x[:, model.layout.position] - position[:, None]
        near = (d * d).sum(axis=-1) < (SAME_PLACE * model.area.size) ** 2
        total = total + w * np.where(near, tracks.existence, 0.0).max(axis=1, initial=0.0)
    return np.asarray(np.minimum(total, 1.0))
