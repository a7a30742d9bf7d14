"""`arrivals locate`: positions from readings of signal strength, as a table and a map."""

from __future__ import annotations

import argparse
import sys
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from arrivals.cli.outputs import check_different
from arrivals.files import check_output
from arrivals.measurement_models import LogNormalRSS, db_to_neper
from arrivals.measurement_models.signal_strength.fill_values import warn_fill_values
from arrivals.motion_models import ConstantVelocity
from arrivals.recordings.networks import Network, read_network
from arrivals.trackers import RSSML, RSSVB, AmplitudePrior, PositionEstimate, find
from arrivals.trackers.run import Run, RunRecorder, header, text
from arrivals.validation import one_of

POWER_STD_DB = 10.0  # of a source of unknown power


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
        At the times of the network.

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
    recorder = RunRecorder(PositionEstimate)
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
    return recorder.run(dt=1.0, elapsed=np.nan).at(network.time)


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


def add_locate(commands: Any, bar: Callable[[bool], Callable[..., Any]]) -> None:
    """Add `arrivals locate` to the subparsers of the command line."""
    add = commands.add_parser(
        "locate",
        help="locate sources from readings of signal strength",
        description="Locate and track sources by readings of signal strength: a CSV file with "
        "time_s and a column for each sensor, or with time_s, sensor, rss_db; or an npz file.",
        allow_abbrev=False,
    )
    option = add.add_argument
    option("file", metavar="READINGS", help="file with levels in dB or dBm")
    option("--sensors", metavar="CSV", help="table of sensors: name, x_m, y_m")
    option("--sources", type=int, metavar="K", help="number of sources (estimated)")
    option("--missing", type=float, action="append", default=[], metavar="DB",
           help="level that stands for a missing reading, such as 100; repeatable")  # fmt: skip
    option("--tracker", default="rss_vb", choices=("rss_vb", "rss_ml"), help="(rss_vb)")
    option("--alpha", type=float, default=2.0, metavar="A", help="loss exponent (2)")
    option("--sigma", type=float, default=6.0, metavar="DB", help="shadowing (6)")
    option("--floor", type=float, metavar="DB", help="noise floor (none)")
    option("--power", type=float, metavar="DB", help="level of a source at 1 m (from readings)")
    option("--power-std", type=float, metavar="DB", help="its standard deviation (3, or 10)")
    option("--r-min", type=float, metavar="M", help="floor of the range")
    option(
        "--speed",
        type=float,
        default=1.5,
        metavar="M/S",
        help="standard deviation of the speed (1.5)",
    )
    option("--q", type=float, default=0.1, metavar="Q", help="acceleration noise, m²/s³ (0.1)")
    option("--tau", type=float, metavar="S", help="correlation time of the shadowing (none)")
    option("--out", metavar="CSV", help="positions file (standard output)")
    option("--plot", metavar="PNG", help="map with 95 %% error ellipses")
    option("--quiet", action="store_true", help="no progress bar")
    add.set_defaults(command=lambda arguments: locate(arguments, bar(arguments.quiet)))


def locate(arguments: argparse.Namespace, bar: Callable[..., Any]) -> None:
    """Locate sources by the readings of a file and write the results.

    Raises
    ------
    ValueError, TypeError, OSError
        If the arguments or the files are invalid; nothing has been written then.
    """
    _check_outputs(arguments)
    network = read_network(arguments.file, arguments.sensors, arguments.missing)
    if (np.diff(network.time) <= 0).any():
        raise ValueError(f"{arguments.file}: time must increase from row to row")
    path_loss = PathLossSettings(
        arguments.alpha, arguments.sigma, arguments.floor, arguments.r_min, arguments.tau
    )
    source = SourceSettings(arguments.power, arguments.power_std, arguments.speed, arguments.q)
    run = locate_sources(
        network,
        tracker=arguments.tracker,
        n_sources=arguments.sources,
        path_loss=path_loss,
        source=source,
        progress=bar,
    )
    if arguments.out:
        run.to_csv(arguments.out)
    else:
        sys.stdout.write(",".join(header(run.kind)) + "\n")
        sys.stdout.writelines(",".join(text(row)) + "\n" for row in run.rows())
    if arguments.plot:
        from arrivals.plots.bearing_time import save
        from arrivals.plots.maps import plot_map

        save(plot_map(run, sensors=network.sensors[-1], truth=network.truth), arguments.plot)


def _check_outputs(arguments: argparse.Namespace) -> None:
    """Raise an error before the computation if an output cannot be written."""
    from arrivals.plots.bearing_time import picture_format

    outputs = arguments.out, arguments.plot
    check_different("READINGS, --sensors, --out and --plot",
                    arguments.file, arguments.sensors, *outputs)  # fmt: skip
    for name in filter(None, outputs):
        check_output(name)
    if arguments.plot:
        picture_format(arguments.plot)
