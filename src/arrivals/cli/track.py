"""`arrivals track`: track directions through a recording or a stream."""

from __future__ import annotations

import argparse

from arrivals.cli.outputs import Bar, check_outputs, refuse
from arrivals.cli.standard_input import stream_input
from arrivals.cli.track_band import track_band
from arrivals.cli.track_snapshots import track_snapshots
from arrivals.cli.track_sources import separates, track_sources
from arrivals.live.options import LiveOptions
from arrivals.live.views import LiveViews
from arrivals.measurement_models import SensorArray
from arrivals.recordings.choice.assembly import takes_samples

NO_BEAM = "requires a tracker of snapshots: the beam power of this one is not drawn"


def track(arguments: argparse.Namespace, bar: Bar) -> None:
    """Track directions through the recording, or the stream, of the arguments.

    Parameters
    ----------
    arguments : argparse.Namespace
        Arguments of `arrivals track`.
    bar : callable
        Wraps an iterable of steps with a progress bar, as tqdm does.

    Raises
    ------
    ValueError, TypeError, OSError
        If the arguments, the files or the stream are invalid. Output files are neither created nor
        changed then.
    """
    from threadpoolctl import threadpool_limits

    array = SensorArray.from_file(arguments.array)
    check_outputs(arguments)
    views = LiveViews(LiveOptions.of(arguments))
    one_thread = threadpool_limits(1, "blas")  # matrices are small: more threads only wait
    with one_thread, stream_input(arguments, array), views:
        if separates(arguments):
            reason = "requires a tracker of each step, not one of a whole recording"
            refuse(arguments, ("serve", "live", "jsonl"), reason)
            refuse(arguments, ("normalize",), NO_BEAM)
            track_sources(arguments, array, bar)
        elif arguments.band and takes_samples(arguments.tracker):
            refuse(arguments, ("normalize",), NO_BEAM)
            track_band(arguments, array, bar, views)
        else:
            if arguments.unknowns == "sphere":
                refuse(arguments, ("normalize",), "requires directions over time, not on the sky")
            track_snapshots(arguments, array, bar, views)
        views.close()
