"""Two speakers and a symmetric line, one of them moving: Figs 8 and 9 of the report."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from pathlib import Path

import numpy as np

from arrivals.motion_models import AutoregressiveSources, yule_walker
from arrivals.scenarios.base import Trial
from arrivals.scenarios.registry import register
from arrivals.scenarios.simulations.autoregressive_sources import SourceField
from arrivals.typing import Float
from arrivals.validation import count

SHIPPED = ("synth_count_up_8k.wav", "synth_count_down_8k.wav")


@register("ar_fig8")
@dataclass(frozen=True)
class SpeechField(SourceField):
    """Speech from 40 to 0 degrees, and from -20, five sensors, 30 dB (and 10 and 5): Fig. 8.

    Two synthetic voices that count up and down are shipped; the report's recordings are not
    published.

    Parameters
    ----------
    doa_deg, distances : sequence of float
        As in `SourceField`.
    end_deg : sequence of float, optional
        As in `SourceField`.
    snr_db : float
        As in `SourceField`.
    centre : bool
        As in `SourceField`.
    order : int
        Order of the autoregressive model, fitted to the whole recordings; 2 in Fig. 9.
    recordings : sequence of path, optional
        Sound files with one channel, one a source, in place of the shipped ones. Truncated to the
        shortest, with zero mean and power 1.

    Notes
    -----
    The real source signals are multiplied by the complex response of the array at one frequency,
    as in narrow-band receivers, for any spectrum of the source. That is the report's model; the
    signals of a microphone array in a room have delays instead.

    References
    ----------
    Magakian, report of 25 April 2024 on Gu, Chan, Zhu and Swamy, IEEE TCAS-II 60(1), 2013, 4.3.

    Examples
    --------
    >>> trial = SpeechField().sample(np.random.default_rng(0))
    >>> trial.measurements.shape, trial.motion.orders, trial.motion.real_valued
    ((24271, 5), (1, 1), True)
    """

    doa_deg: Sequence[float] = (40.0, -20.0)
    end_deg: Sequence[float] | None = (0.0, -20.0)
    distances: Sequence[float] = (0.25, 0.5)
    order: int = 1
    recordings: Sequence[str | Path] | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        count("order", self.order)
        paths = SHIPPED if self.recordings is None else tuple(map(str, self.recordings))
        if len(paths) != self.n_sources:
            raise ValueError(
                f"recordings must be one for each of {self.n_sources} sources; got {len(paths)}"
            )
        if self.recordings is not None:
            object.__setattr__(self, "recordings", paths)

    @property
    def signals(self) -> Float:
        """Source signals, (n_steps, n_sources)."""
        signals: list[Float] = (
            [voice(name) for name in SHIPPED]
            if self.recordings is None
            else [read_normalised(path) for path in self.recordings]
        )
        shortest = min(map(len, signals))
        return np.stack([signal[:shortest] for signal in signals], axis=-1)

    @property
    def motion(self) -> AutoregressiveSources:
        """AR models of the signals by the Yule-Walker equations."""
        fits = [yule_walker(signal, self.order) for signal in self.signals.T]
        coefficients, noise = (np.array(each) for each in zip(*fits, strict=True))
        return AutoregressiveSources(coefficients, noise, real_valued=True)

    def sample(self, rng: np.random.Generator) -> Trial:
        """Draw the noise of one trial."""
        return self.make_trial(self.signals, self.motion, rng)


@register("ar_fig9")
@dataclass(frozen=True)
class SpeechOfOrderTwo(SpeechField):
    """The same speech with models of order 2, for which the report states that the method fails.

    References
    ----------
    As in `SpeechField`.

    Examples
    --------
    >>> SpeechOfOrderTwo().motion.orders
    (2, 2)
    """

    order: int = 2


@cache
def voice(name: str) -> Float:
    """Return a shipped recording, of mean 0 and power 1, (n_steps,)."""
    signal = read_normalised(Path(str(files("arrivals.scenarios") / "data" / name)))
    signal.setflags(write=False)
    return signal


def shipped_speech(name: str, n_samples: int, rng: np.random.Generator) -> Float:
    """Draw a part of a shipped recording, resampled from 8 to 16 kHz.

    Parameters
    ----------
    name : str
        File in `SHIPPED`.
    n_samples : int
        Number of samples, at 16 kHz; at most 3 s.
    rng : numpy.random.Generator
        Source of random numbers.

    Returns
    -------
    ndarray, shape (n_samples,)
        Signal of about power 1, without anything above 4 kHz.

    Examples
    --------
    >>> shipped_speech("synth_count_up_8k.wav", 32000, np.random.default_rng(0)).shape
    (32000,)
    """
    from scipy.signal import resample_poly

    whole, n = voice(name), count("n_samples", n_samples, maximum=48_000) // 2 + 1
    start = int(rng.integers(len(whole) - n))
    return np.asarray(resample_poly(whole[start : start + n], 2, 1)[:n_samples])


def read_normalised(path: str | Path) -> Float:
    """Read a sound file with one channel, of mean 0 and power 1, (n_steps,).

    Raises
    ------
    ValueError
        If it is not a sound file, has several channels, or zero power.
    """
    from arrivals.recordings.readers import read

    samples = np.asarray(read(path).samples, dtype=np.float64)
    if samples.ndim == 2 and samples.shape[1] == 1:
        samples = samples[:, 0]
    if samples.ndim != 1:
        raise ValueError(f"{path} must have one channel; got {samples.shape[1]}")
    signal = samples - samples.mean()
    power = float(np.mean(signal**2))
    if not power > 0:
        raise ValueError(f"{path} must have positive power; got {power:g}")
    return np.asarray(signal / np.sqrt(power))
