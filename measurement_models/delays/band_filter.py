"""Filter of real samples to a band, one sample of every channel after the other."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from arrivals.parameters import FrozenModel
from arrivals.typing import Float
from arrivals.validation import number

ORDER = 5  # of each edge: 85 dB at a fifth of the lower edge, 40 dB at half of it
N_RESPONSE = 1 << 14  # samples of the impulse response, for the share of the noise


@dataclass(frozen=True)
class BandFilter(FrozenModel):
    """A Butterworth filter whose state can be stored, equal for all channels.

    One step is [y; s'] = M [x; s], for the samples x of all channels, the filtered ones y, and the
    states s. Equal filters delay all channels equally, so that directions do not change.

    Parameters
    ----------
    low, high : float
        Edges of the band, cycles per sample: 0 <= low < high <= 0.5. An edge at 0 or 0.5 is none.

    Attributes
    ----------
    step : ndarray, shape (1 + n_states, 1 + n_states)
        M.
    rest : ndarray, shape (n_states,)
        State after a long input of 1.
    radius : float
        Largest magnitude of a pole: errors decay by it in every sample.
    noise_share : float
        Share of white noise that passes the filter.

    Raises
    ------
    ValueError
        If the edges are out of order, or leave nothing to filter.

    Examples
    --------
    >>> band = BandFilter(0.1, 0.2)
    >>> s, ys = band.rest, []
    >>> for x in np.ones(3):  # a constant is outside the band
    ...     y, *s = band.step @ [x, *s]
    ...     ys.append(y)
    >>> bool(np.allclose(ys, 0.0)), round(band.noise_share, 2)
    (True, 0.2)
    """

    low: float
    high: float
    step: Float = field(init=False, repr=False, compare=False)
    rest: Float = field(init=False, repr=False, compare=False)
    radius: float = field(init=False, repr=False, compare=False)
    noise_share: float = field(init=False, repr=False, compare=False)
    response: Float = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        low, high = number("low", self.low), number("high", self.high)
        if not 0 <= low < high <= 0.5 or (low == 0 and high == 0.5):
            raise ValueError(
                "low and high must satisfy 0 <= low < high <= 0.5 cycles per sample, one of them "
                f"inside; got {self.low} and {self.high}"
            )
        from scipy import signal  # slow to import

        edges = [edge for edge in (low, high) if 0 < edge < 0.5]
        kind = "bandpass" if len(edges) == 2 else "highpass" if high == 0.5 else "lowpass"
        sos = signal.butter(ORDER, np.squeeze(edges), kind, fs=1.0, output="sos")
        n = 2 * len(sos)
        # one step of every unit vector [x; s]
        unit = np.eye(1 + n)
        states = unit[1:].reshape(len(sos), 2, 1 + n).transpose(0, 2, 1)
        y, states = signal.sosfilt(sos, unit[0][:, None], axis=1, zi=states)
        step = np.concatenate([y.T, states.transpose(0, 2, 1).reshape(n, 1 + n)])
        response = signal.sosfilt(sos, np.eye(1, N_RESPONSE)[0])
        object.__setattr__(self, "step", step)
        object.__setattr__(self, "rest", signal.sosfilt_zi(sos).reshape(n))
        object.__setattr__(self, "radius", float(np.abs(np.linalg.eigvals(step[1:, 1:])).max()))
        object.__setattr__(self, "noise_share", float(response @ response))
        object.__setattr__(self, "response", response)
        for array in (step, self.rest, response):
            array.setflags(write=False)

    def autocorrelation(self, lags: ArrayLike) -> Float:
        """Return the correlation of filtered white noise of variance 1, at whole lags."""
        spectrum = np.abs(np.fft.rfft(self.response, 2 * N_RESPONSE)) ** 2
        return np.asarray(np.fft.irfft(spectrum)[np.abs(np.asarray(lags))])
