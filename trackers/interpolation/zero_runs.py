"""Channels that give nothing: runs of exact zeros that are too long to be samples."""

from __future__ import annotations

import warnings
from dataclasses import dataclass

import numpy as np

from arrivals.typing import Bool, Float

PROBABILITY = 1e-6  # of a run of zeros that counts as missing, if its zeros are samples


@dataclass(frozen=True, eq=False)
class ZeroRuns:
    """Runs of exact zeros in each channel, and how often one zero follows another.

    Quantized samples of a weak signal are zero now and then. A zero follows a zero with a
    probability q, learned from the runs of all channels that have ended; a run longer than q
    allows is missing.

    Parameters
    ----------
    length : ndarray, shape (..., n_channels)
        Zeros up to the newest sample; 0 where that is not zero.
    missing : ndarray of bool, shape (..., n_channels)
        Channels whose run is missing; all of them before their first sample that is not zero.
    zeros, repeated : ndarray, shape (...)
        Zeros in runs that ended and were samples, and those of them that follow a zero.
    active : bool
        True if a run goes on, or a channel has had no sample.
    reported : bool
        True once the warning was given.

    Examples
    --------
    >>> runs = ZeroRuns.start(2)
    >>> for k in range(12):
    ...     runs, z = runs.without_zeros(np.array([0.0, 0.0]))
    >>> z, runs.length
    (array([nan, nan]), array([12., 12.]))
    """

    length: Float
    missing: Bool
    zeros: Float
    repeated: Float
    active: bool = True
    reported: bool = False

    @classmethod
    def start(cls, n_channels: int) -> ZeroRuns:
        """Return the state before the first sample."""
        nothing = np.zeros(n_channels)
        return cls(nothing, nothing == 0, np.zeros(()), np.zeros(()))

    def broadcast(self, shape: tuple[int, ...]) -> ZeroRuns:
        """Return the same state for recordings of leading axes `shape`."""
        length = np.broadcast_to(self.length, shape + self.length.shape)
        missing = np.broadcast_to(self.missing, length.shape)
        zeros, repeated = (np.broadcast_to(a, shape) for a in (self.zeros, self.repeated))
        return ZeroRuns(length, missing, zeros, repeated, self.active, self.reported)

    def without_zeros(self, z: Float) -> tuple[ZeroRuns, Float]:
        """Return the state after samples, (..., n_channels), and the samples, NaN if missing.

        Warns
        -----
        UserWarning
            Once, if a channel is missing while another one is not.
        """
        zero = z == 0
        if not zero.any() and not self.active:
            return self, z  # the usual case
        length = np.where(zero, self.length + 1, 0.0)
        ended = np.where((length == 0) & ~self.missing, self.length, 0.0)
        zeros = self.zeros + ended.sum(axis=-1)
        repeated = self.repeated + np.maximum(ended - 1, 0.0).sum(axis=-1)
        # P(n or more zeros follow a zero) = qⁿ
        q = (repeated + 2) / (zeros + 8)
        longest = 1 + np.log(PROBABILITY) / np.log(q)
        long = length > longest[..., None]
        missing = (self.missing | long) & (zero | np.isnan(z))
        state = ZeroRuns(
            length, missing, zeros, repeated, bool(zero.any() | missing.any()),
            self.reported or _report(long, z),
        )  # fmt: skip
        return state, np.where(missing, np.nan, z)


def _report(long: Bool, z: Float) -> bool:
    """Warn of channels with long runs while another one has data; return True if there are any."""
    others = (np.nan_to_num(z) != 0).any(axis=-1, keepdims=True)
    channels = np.unique(np.nonzero(long & others)[-1])
    if not len(channels):
        return False
    warnings.warn(
        f"only zeros in channel(s) {', '.join(map(str, channels))}, counted from 0: such stretches "
        "are missing data from now on",
        stacklevel=5,
    )
    return True
