"""`arrivals locate`: readings of signal strength in, positions and a map out."""

from __future__ import annotations

import argparse
import sys
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from arrivals.measurement_models import LogNormalRSS, db_to_neper
from arrivals.motion_models import ConstantVelocity
from arrivals.recordings.networks import Network, read_network
from arrivals.trackers import RSSML, RSSVB, PositionEstimate, find
from arrivals.trackers.run import Run, RunRecorder, header, text
from arrivals.typing import Float
from arrivals.validation import one_of

POWER_STD_DB = 10.0  # of a source whose power nobody gave


def located(
    network: Network,
    *,
    tracker: str = "rss_vb",
    n_sources: int | None = None,
    alpha: float = 2.0,
    sigma_db: float = 6.0,
    floor_db: float | None = None,
    power_db: float | None = None,
    power_std_db: float | None = None,
    r_min: float | None = None,
    speed: float = 1.5,
    q: float = 0.1,
    correlation_time: float | None = None,
    bar: Callable[..., Any] = lambda steps, **_: steps,
) -> Run:
    """Locate sources in the readings of a network, and follow them.

    Parameters
    ----------
    network : Network
    tracker : {"rss_vb", "rss_ml"}
    n_sources : int, optional
        As many are found in the first readings and followed. If None they are counted: in a
        single step by the evidence, over time with births and deaths.
    alpha, sigma_db, floor_db
        Loss exponent; shadowing and noise floor, dB.
    power_db, power_std_db : float, optional
        Level of a source at 1 m, and how sure that is, dB; by the loudest readings if None.
    r_min : float, optional
        Floor of the range, m; a hundredth of the sensors' extent if None, 1 m at least.
    speed : float
        How fast sources may be, standard deviation, m/s.
    q : float
        Of `ConstantVelocity`, m²/s³.
    correlation_time : float, optional
        As in `RSSVB`, s.
    bar : callable
        Shows how far it is, as tqdm does.

    Returns
    -------
    Run
        At the network's times.

    Raises
    ------
    ValueError
        If a number is out of range or times do not grow.

    Examples
    --------
    >>> rng = np.random.default_rng(0)
    >>> places = rng.uniform(0, 100, (30, 2))
    >>> far = np.hypot(*(places - [40.0, 70.0]).T)
    >>> levels = -30 - 20 * np.log10(far) + 0.5 * rng.standard_normal((1, 30))
    >>> network = Network.fixed([str(k) for k in range(30)], places, levels)
    >>> found = located(network, sigma_db=0.5, floor_db=-97.0).position
    >>> found.shape, bool(np.abs(found - [40.0, 70.0]).max() < 2)
    ((1, 1, 2), True)
    """
    if (np.diff(network.time) <= 0).any():
        raise ValueError("times must grow from row to row")
    one_of("tracker", tracker, ("rss_vb", "rss_ml"))
    extent = float(np.nanmax(np.ptp(_known(network), axis=0)))
    r_min = max(1.0, extent / 100) if r_min is None else r_min
    model = LogNormalRSS(
        np.zeros((len(network.name), 2)),
        float(db_to_neper(sigma_db)),
        alpha=alpha,
        log_noise=None if floor_db is None else float(db_to_neper(floor_db)),
        r_min=r_min,
    )
    level = _loudest(network, alpha, extent) if power_db is None else float(db_to_neper(power_db))
    guess = POWER_STD_DB if power_db is None else 3.0
    std_db = guess if power_std_db is None else power_std_db
    made = _tracker(tracker, network.heard(0, model)[0], {
        "P0": np.diag([extent, speed] * 2) ** 2,
        "mu0": level,
        "v0": float(db_to_neper(std_db)) ** 2,
        "n_sources": n_sources,
        "births": n_sources is None and len(network) > 1,
        "correlation_time": correlation_time,
    }, q)  # fmt: skip
    return _followed(made, network, model, bar)


def _tracker(name: str, model: LogNormalRSS, params: dict[str, Any], q: float) -> RSSVB | RSSML:
    kind: Any = find(name)
    made: RSSVB | RSSML = kind(ConstantVelocity(q), model, **params)
    return made


def _followed(
    tracker: RSSVB | RSSML, network: Network, model: LogNormalRSS, bar: Callable[..., Any]
) -> Run:
    """Return the run of a tracker over the steps of a network, whose sensors may move."""
    recorder = RunRecorder(PositionEstimate)
    before = float(network.time[0])
    for step in bar(range(len(network)), desc="locate"):
        now = float(network.time[step])
        seen, z = network.heard(step, model)
        if step:
            tracker.predict(dt=now - before)
        before = now
        tracker.measurement = seen
        with warnings.catch_warnings():
            if step:
                warnings.simplefilter("ignore")  # once is enough
            tracker.update(z)
        recorder.add(tracker.estimate, tracker.x)
    return recorder.run(dt=1.0, elapsed=np.nan).at(network.time)


def _known(network: Network) -> Float:
    places = network.sensors.reshape(-1, 2)
    return np.asarray(places[np.isfinite(places).all(axis=1)])


def _loudest(network: Network, alpha: float, extent: float) -> float:
    """Return the level at 1 m of a source that the loudest sensor is as near to as sensors are."""
    near = extent / (2 * np.sqrt(len(network.name)))
    loud = float(np.nanmedian(np.nanmax(network.readings, axis=1)))
    return loud + 0.5 * alpha * float(np.log(max(near, 1.0)))


def add_locate(commands: Any, bar: Callable[[bool], Callable[..., Any]]) -> None:
    """Add `arrivals locate` to the subparsers of the command line."""
    add = commands.add_parser(
        "locate",
        help="locate sources from readings of signal strength",
        description="Locate sources, and follow them, from readings of signal strength: a CSV "
        "with time_s and a column for each sensor, or time_s, sensor, rss_db; or an npz.",
        allow_abbrev=False,
    )
    option = add.add_argument
    option("file", metavar="READINGS", help="levels in dB or dBm")
    option("--sensors", metavar="CSV", help="table of sensors: name, x_m, y_m")
    option("--sources", type=int, metavar="K", help="how many; counted if not given")
    option("--tracker", default="rss_vb", choices=("rss_vb", "rss_ml"), help="(rss_vb)")
    option("--alpha", type=float, default=2.0, metavar="A", help="loss exponent (2)")
    option("--sigma", type=float, default=6.0, metavar="DB", help="shadowing (6)")
    option("--floor", type=float, metavar="DB", help="noise floor (none)")
    option("--power", type=float, metavar="DB", help="level of a source at 1 m (by the loudest)")
    option("--power-std", type=float, metavar="DB", help="how sure that is (3, or 10)")
    option("--r-min", type=float, metavar="M", help="floor of the range")
    option("--speed", type=float, default=1.5, metavar="M/S", help="of sources, deviation (1.5)")
    option("--q", type=float, default=0.1, metavar="Q", help="of their acceleration, m²/s³ (0.1)")
    option("--tau", type=float, metavar="S", help="correlation time of the shadowing (none)")
    option("--out", metavar="CSV", help="positions file (standard output)")
    option("--plot", metavar="PNG", help="map with 95 %% error ellipses")
    option("--quiet", action="store_true", help="no progress bar")
    add.set_defaults(command=lambda arguments: locate(arguments, bar(arguments.quiet)))


def locate(arguments: argparse.Namespace, bar: Callable[..., Any]) -> None:
    """Locate sources in the readings that the arguments name.

    Raises
    ------
    ValueError, TypeError, OSError
        If something is wrong with the arguments or the files; nothing has been written then.
    """
    _check_outputs(arguments)
    network = read_network(arguments.file, arguments.sensors)
    run = located(
        network,
        tracker=arguments.tracker,
        n_sources=arguments.sources,
        alpha=arguments.alpha,
        sigma_db=arguments.sigma,
        floor_db=arguments.floor,
        power_db=arguments.power,
        power_std_db=arguments.power_std,
        r_min=arguments.r_min,
        speed=arguments.speed,
        q=arguments.q,
        correlation_time=arguments.tau,
        bar=bar,
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
    """Refuse, before the work begins, what could not be written at its end."""
    from arrivals.plots.bearing_time import picture_format

    files = [name for name in (arguments.file, arguments.sensors, arguments.out, arguments.plot)
             if name]  # fmt: skip
    if len({Path(name).resolve() for name in files}) < len(files):
        raise ValueError("READINGS, --sensors, --out and --plot must be different files")
    for name in filter(None, (arguments.out, arguments.plot)):
        if not Path(name).parent.is_dir():
            raise FileNotFoundError(2, "the folder does not exist", str(Path(name).parent))
    if arguments.plot:
        picture_format(arguments.plot)
