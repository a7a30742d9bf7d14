"""Location and tracking of sources by the readings of a network."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from arrivals.measurement_models import LogNormalRSS, db_to_neper
from arrivals.measurement_models.signal_strength.fill_values import warn_fill_values
from arrivals.motion_models import ConstantVelocity
from arrivals.recordings.networks.network import Network
from arrivals.trackers import RSSML, RSSVB, AmplitudePrior, PositionEstimate, find
from arrivals.trackers.run import Run, RunRecorder
from arrivals.validation import one_of

POWER_STD_DB = 10.0  # of a source of unknown power
EXPONENTS = (1.5, 2.0, 2.5, 3.0, 3.5, 4.0)  # that an unknown exponent is chosen from
EXPONENT_MEAN, EXPONENT_STD = 2.5, 0.75
MAX_NETWORKS, MAX_STEPS = 4, 200  # for the choice


@dataclass(frozen=True)
class PathLossSettings:
    """Model of the readings.

    Parameters
    ----------
    alpha : float
        Loss exponent.
    sigma_db : float
        Standard deviation of the shadowing, dB.
    floor_db : float, optional
        Noise floor, dB; no noise if None.
    r_min : float, optional
        Floor of the range, m; a hundredth of the extent of the sensors if None.
    correlation_time : float, optional
        As in `RSSVB`, s.
    """

    alpha: float = 2.0
    sigma_db: float = 6.0
    floor_db: float | None = None
    r_min: float | None = None
    correlation_time: float | None = None

    def model(self, network: Network) -> LogNormalRSS:
        """Return the model of the readings of a network."""
        r_min = network.extent / 100 if self.r_min is None else self.r_min
        return LogNormalRSS(
            np.zeros((len(network.name), 2)),
            float(db_to_neper(self.sigma_db)),
            alpha=self.alpha,
            log_noise=None if self.floor_db is None else float(db_to_neper(self.floor_db)),
            r_min=r_min,
        )


@dataclass(frozen=True)
class SourceSettings:
    """Prior and motion of a source.

    Parameters
    ----------
    power_db, power_std_db : float, optional
        Level of a source at 1 m and its standard deviation, dB; estimated from the largest
        readings if None, with 10 dB, else 3 dB.
    speed : float
        Standard deviation of the speed, m/s.
    q : float
        Acceleration noise of `ConstantVelocity`, m²/s³.
    """

    power_db: float | None = None
    power_std_db: float | None = None
    speed: float = 1.5
    q: float = 0.1

    def amplitude(self, network: Network, alpha: float) -> AmplitudePrior:
        """Return the prior of the log amplitudes."""
        if self.power_db is None:
            level, std_db = _source_level(network, alpha), POWER_STD_DB
        else:
            level, std_db = float(db_to_neper(self.power_db)), 3.0
        std_db = std_db if self.power_std_db is None else self.power_std_db
        return AmplitudePrior(mean=level, variance=float(db_to_neper(std_db)) ** 2)


def locate_sources(
    network: Network,
    *,
    tracker: str = "rss_vb",
    n_sources: int | None = None,
    path_loss: PathLossSettings = PathLossSettings(),
    source: SourceSettings = SourceSettings(),
    progress: Callable[..., Any] = lambda steps, **_: steps,
) -> Run:
    """Locate and track sources by the readings of a network.

    Parameters
    ----------
    network : Network
    tracker : {"rss_vb", "rss_ml"}
    n_sources : int, optional
        Number of sources to detect in the first readings and to track. If None it is estimated:
        in a single step by the evidence, over time with births and deaths.
    path_loss : PathLossSettings
    source : SourceSettings
    progress : callable
        Wraps the steps in a progress bar, as tqdm does.

    Returns
    -------
    Run
        At the times of the network. `run.log_likelihood` (n_steps,) has the log evidence of the
        readings of each step, given those before.

    Raises
    ------
    ValueError
        If a number is out of range or times do not increase.

    Examples
    --------
    >>> rng = np.random.default_rng(0)
    >>> sensors = rng.uniform(0, 100, (30, 2))
    >>> distance = np.hypot(*(sensors - [40.0, 70.0]).T)
    >>> levels = -30 - 20 * np.log10(distance) + 0.5 * rng.standard_normal((1, 30))
    >>> network = Network.fixed([str(k) for k in range(30)], sensors, levels)
    >>> path_loss = PathLossSettings(sigma_db=0.5, floor_db=-97.0)
    >>> position = locate_sources(network, path_loss=path_loss).position
    >>> position.shape, bool(np.abs(position - [40.0, 70.0]).max() < 2)
    ((1, 1, 2), True)
    """
    if (np.diff(network.time) <= 0).any():
        raise ValueError("time must increase from row to row")
    kind: Any = find(one_of("tracker", tracker, ("rss_vb", "rss_ml")))
    n_valid = int(np.isfinite(network.rss_db).any(axis=0).sum())
    if n_sources is not None and n_sources > n_valid:
        raise ValueError(
            f"n_sources must be at most {n_valid}, the number of sensors with readings; "
            f"got {n_sources}"
        )
    warn_fill_values(network.rss_db)
    between = float(np.median(np.diff(network.time))) if len(network) > 1 else 0.0
    if between * source.speed > network.extent:
        warnings.warn(
            f"in the {between:g} s between steps, a source of --speed {source.speed:g} m/s leaves "
            f"the network of {network.extent:g} m: check the unit of time (time_ms) and --speed",
            stacklevel=2,
        )
    model = path_loss.model(network)
    run = _track(
        kind(
            ConstantVelocity(source.q),
            network.readings_at(0, model)[0],
            P0=np.diag([network.extent, source.speed] * 2) ** 2,
            n_sources=n_sources,
            amplitude=source.amplitude(network, path_loss.alpha),
            births=n_sources is None and len(network) > 1,
            correlation_time=path_loss.correlation_time,
        ),
        network,
        model,
        progress,
    )
    if not (run.label >= 0).any():
        warnings.warn(
            "no source was found: the readings are noise, too few at a time, or of sources "
            "unlike --floor, --power and --sigma", stacklevel=2
        )  # fmt: skip
    return run


def _track(
    tracker: RSSVB | RSSML, network: Network, model: LogNormalRSS, progress: Callable[..., Any]
) -> Run:
    """Return the run of a tracker over the steps of a network, whose sensors may move."""
    recorder, evidence = RunRecorder(PositionEstimate), []
    before = float(network.time[0])
    for step in progress(range(len(network)), desc="locate"):
        now = float(network.time[step])
        model_now, z = network.readings_at(step, model)
        if step:
            tracker.predict(dt=now - before)
        before = now
        tracker.measurement = model_now
        tracker.update(z)
        recorder.add(tracker.estimate, tracker.x)
        evidence.append(tracker.log_likelihood)
    run = recorder.run(dt=1.0, elapsed=np.nan).at(network.time).made_by(tracker)
    return replace(run, extras={"log_likelihood": np.array(evidence)})


def loss_exponent(networks: Sequence[Network], path_loss: PathLossSettings, **more: Any) -> float:
    """Return the loss exponent with the largest evidence of the readings, from 1.5 to 4.

    Its prior has the mean 2.5 and the standard deviation 0.75. Only the networks with most readings
    and their first steps are used.

    Parameters
    ----------
    networks : sequence of Network
        With one exponent.
    path_loss : PathLossSettings
        Its exponent is not used.
    **more : object
        Further arguments of `locate_sources`, `n_sources` among them.

    Returns
    -------
    float

    Examples
    --------
    >>> rng = np.random.default_rng(0)
    >>> sensors = rng.uniform(0, 100, (12, 2))
    >>> distance = np.hypot(*(sensors - [40.0, 70.0]).T)
    >>> levels = -30 - 30 * np.log10(distance) + 3.0 * rng.standard_normal((20, 12))
    >>> network = Network.fixed([str(k) for k in range(12)], sensors, levels)
    >>> loss_exponent([network], PathLossSettings(sigma_db=3.0), n_sources=1)
    3.0
    """
    first = slice(MAX_STEPS)
    used = [one.select(first) for one in networks if np.isfinite(one.rss_db[first]).any()]
    used = sorted(used, key=lambda one: -np.isfinite(one.rss_db).sum())[:MAX_NETWORKS]

    def log_posterior(alpha: float) -> float:
        settings = replace(path_loss, alpha=alpha)
        runs = [locate_sources(one, path_loss=settings, **more) for one in used]
        evidence = sum(float(run.log_likelihood.sum()) for run in runs)
        return evidence - 0.5 * ((alpha - EXPONENT_MEAN) / EXPONENT_STD) ** 2

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return max(EXPONENTS, key=log_posterior)


def _source_level(network: Network, alpha: float) -> float:
    """Return the level at 1 m of a source at half the mean sensor spacing from the nearest one."""
    n = len(network.name)
    distance = network.extent / (2 * np.sqrt(n))
    valid = np.isfinite(network.rss_db)
    filled = np.where(valid, network.readings, -np.inf).max(axis=1)
    rows = np.flatnonzero(valid.any(axis=1))
    # the largest reading of as many rows as hold one reading a sensor
    block = (np.cumsum(valid.sum(axis=1))[rows] - 1) // n
    first = np.flatnonzero(np.diff(block, prepend=-1))
    largest = float(np.median(np.maximum.reduceat(filled[rows], first)))
    return largest + 0.5 * alpha * float(np.log(distance))
