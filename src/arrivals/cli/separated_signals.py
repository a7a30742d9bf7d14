"""Separated sources of recordings: analytic signals, initial models, signal files."""

from __future__ import annotations

import inspect
import os
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from arrivals.files import atomic_write
from arrivals.measurement_models import ArraySnapshot
from arrivals.motion_models import AutoregressiveSources, yule_walker
from arrivals.trackers import ARKalmanQRDRLS, Run
from arrivals.trackers.autoregressive import NoiseSettings, RegressionSettings
from arrivals.typing import Complex
from arrivals.validation import count, positive

# Specification, sections 5 and 7: settings for speech with pauses
FOR_SPEECH: dict[str, Any] = {
    "gate": 0.3,
    "regression": RegressionSettings(ar_forgetting=0.99, ridge=5.0),
    "noise": NoiseSettings(adapt_process_noise=False),
}
INITIAL_ORDER = 2  # of the AR models
INITIAL_NOISE = 0.01  # noise variance, relative to the power of the recording


def analytic(samples: ArrayLike, rate: float, band: Sequence[float] | None = None) -> Complex:
    """Return the analytic signals of real samples: one snapshot per sample.

    Parameters
    ----------
    samples : array_like, shape (n_samples, n_sensors)
        Real samples; NaN where missing.
    rate : float
        Samples per second, Hz.
    band : (float, float), optional
        Edges of the pass band, Hz; all frequencies if None.

    Returns
    -------
    ndarray, shape (n_samples, n_sensors)
        The real parts are the samples within the band.

    Raises
    ------
    ValueError
        If the band does not lie between 0 and half the rate.

    Examples
    --------
    >>> t = np.arange(8) / 8
    >>> np.abs(analytic(np.cos(2 * np.pi * t)[:, None], rate=8.0)[:3, 0]).round(3)
    array([1., 1., 1.])
    """
    x = np.asarray(samples, dtype=np.float64)
    low, high = (0.0, rate / 2) if band is None else (float(edge) for edge in band)
    if not 0 <= low < high <= positive("rate", rate) / 2:
        raise ValueError(
            f"band must lie between 0 and half the rate, {rate / 2:g} Hz; got {low:g} and {high:g}"
        )
    valid = np.isfinite(x)
    n = len(x)
    frequency = np.fft.fftfreq(n, 1 / rate)
    weight = np.where((frequency > 0) & (frequency >= low) & (frequency <= high), 2.0, 0.0)
    for edge in {0, n // 2} if n % 2 == 0 else {0}:
        weight[edge] = float(low <= abs(frequency[edge]) <= high)
    z = np.fft.ifft(weight[:, None] * np.fft.fft(np.where(valid, x, 0.0), axis=0), axis=0)
    return np.where(valid, z, complex(np.nan, np.nan))


def for_recording(
    params: Mapping[str, Any], z: Complex, measurement: ArraySnapshot, real_valued: bool
) -> tuple[ArraySnapshot, AutoregressiveSources]:
    """Return initial models for snapshots of unknown power.

    The noise variance is a hundredth of the recording's power; the sources have equal shares of
    that power and its spectrum, by the Yule-Walker equations of order 2 on one sensor. Values in
    `params`, by nested names or as `motion`, take precedence.

    Parameters
    ----------
    params : mapping
        Parameters of the tracker.
    z : ndarray, shape (n_steps, n_sensors)
        Snapshots.
    measurement : ArraySnapshot
        Measurement model.
    real_valued : bool
        True if the sources are real-valued.

    Returns
    -------
    measurement : ArraySnapshot
        With the initial noise variance.
    motion : AutoregressiveSources
        Initial source models.

    Examples
    --------
    >>> from arrivals.measurement_models import SensorArray
    >>> model = ArraySnapshot(SensorArray.symmetric([0.5]), wavelength=1.0)
    >>> z = np.random.default_rng(0).standard_normal((100, 3)) + 0j
    >>> noise, motion = for_recording({}, z, model, real_valued=True)
    >>> motion.n_sources, round(float(motion.power.sum() / np.mean(z.real**2)), 6)
    (2, 1.0)
    """
    own = {key.partition("__")[2]: value for key, value in params.items()
           if key.startswith("motion__")}  # fmt: skip
    whole = z[np.isfinite(z).all(axis=1)]
    if not np.any(whole):
        raise ValueError(
            "the recording is zero, or no sample is valid at all sensors: list faulty sensors, and "
            "their partners, under `missing` in the array file"
        )
    total = float(np.mean(whole.real**2 if real_valued else np.abs(whole) ** 2))
    noisy = measurement.replace(noise=INITIAL_NOISE * total * (2 if real_valued else 1))
    if "motion" in params:
        return noisy, params["motion"]
    middle = whole[:, whole.shape[1] // 2]
    a, _ = yule_walker(middle.real if real_valued else middle, min(INITIAL_ORDER, len(middle) - 1))
    coefficients = own.get("coefficients", [a.tolist()] * 2)
    own = {"real_valued": real_valued} | own
    motion = AutoregressiveSources(**{"coefficients": coefficients} | own)
    if "noise" not in own:
        motion = motion.scaled(total / motion.n_sources)
    return noisy, motion


def separator(
    params: Mapping[str, Any], z: Complex, measurement: ArraySnapshot, real_samples: bool
) -> ARKalmanQRDRLS:
    """Return the tracker for a recording, with settings for speech if its samples are real."""
    names = inspect.signature(ARKalmanQRDRLS).parameters
    for name in params:
        if name.partition("__")[0] == "measurement":
            raise ValueError(f"--set {name}: the measurement comes from --array and --frequency")
    noisy, motion = for_recording(params, z, measurement, real_samples)
    plain = {name: value for name, value in params.items() if name in names and name != "motion"}
    tracker = ARKalmanQRDRLS(noisy, motion, **(FOR_SPEECH if real_samples else {}) | plain)
    tracker.set_params(**{name: params[name] for name in params if name not in names})
    tracker.restart()
    return tracker


def decimate(run: Run, every: int) -> Run:
    """Return every n-th step of a run, beginning with the n-th; `extras` do not change.

    Parameters
    ----------
    run : Run
        The run.
    every : int
        n.

    Returns
    -------
    Run
        The selected steps.
    """
    last = slice(count("every", every) - 1, None, every)
    fields = {name: values[last] for name, values in run.fields.items()}
    return replace(run, fields=fields, x=run.x[last], n_found=run.n_found[last],
                   time=run.time[last])  # fmt: skip


def check_suffix(path: str) -> None:
    """Raise a ValueError unless the suffix is that of a signal file.

    Examples
    --------
    >>> check_suffix("out.mp3")
    Traceback (most recent call last):
    ValueError: out.mp3: signal files must end in .wav or .npy
    """
    if Path(path).suffix.lower() not in (".wav", ".npy"):
        raise ValueError(f"{path}: signal files must end in .wav or .npy")


def check_writable(path: str, real_valued: bool, rate: float | None) -> None:
    """Raise a ValueError if the file format cannot store the signals.

    Examples
    --------
    >>> check_writable("out.wav", False, 8000.0)
    Traceback (most recent call last):
    ValueError: out.wav: a WAV file cannot store complex signals: use .npy
    """
    check_suffix(path)
    if Path(path).suffix.lower() == ".npy":
        return
    if not real_valued:
        raise ValueError(f"{path}: a WAV file cannot store complex signals: use .npy")
    if rate is None:
        raise ValueError(f"{path}: a WAV file requires the samples per second: pass --rate")


def write_signals(
    path: str | os.PathLike[str], signals: ArrayLike, rate: float | None = None
) -> None:
    """Write signals, one channel per source; the file has its name only when complete.

    Parameters
    ----------
    path : str or path
        ``.wav``: 32 bit floats, 0 where a signal is NaN; ``.npy``: unchanged numbers.
    signals : array_like, shape (n_steps, n_sources)
        Real, or complex for ``.npy``.
    rate : float, optional
        Samples per second, Hz, for ``.wav``.

    Raises
    ------
    ValueError
        If the format is WAV and the signals are complex or the rate is missing.
    """
    from scipy.io import wavfile

    values = np.asarray(signals)
    check_writable(os.fspath(path), values.dtype.kind != "c", rate)
    with atomic_write(path, binary=True) as file:
        if Path(path).suffix.lower() == ".npy" or rate is None:
            np.save(file, values)
        else:
            wavfile.write(file, round(rate), np.nan_to_num(values).astype(np.float32))
