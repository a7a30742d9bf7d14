"""Labels of axes with units, titles with the settings of a run, and legends beside the axes."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from arrivals.measurement_models import neper_to_db
from arrivals.trackers.run import Run

if TYPE_CHECKING:
    from matplotlib.axes import Axes

METRIC_LABELS = {  # {} is the unit of errors
    "gospa": "GOSPA, {}",
    "distance": "localisation error of GOSPA, {}",
    "missed": "missed sources a step",
    "false": "false sources a step",
    "rmse": "RMSE, {}",
    "ospa": "OSPA, {}",
    "cardinality": "error of the number of sources",
    "nees": "NEES a degree of freedom",
    "coverage50": "share of errors within the 50 % interval",
    "coverage68": "share of errors within the 68 % interval",
    "coverage90": "share of errors within the 90 % interval",
    "coverage95": "share of errors within the 95 % interval",
    "ece": "expected calibration error of existence",
    "brier": "Brier score of existence",
    "log_score": "log score of existence",
    "label_switches": "label switches",
    "track_length": "length of tracks, steps",
    "converged": "share of converged steps",
    "range_error": "median relative error in range",
    "range_found": "share of sources with a range",
    "range_nees": "NEES of direction and 1/range a degree of freedom",
    "cpu_ms": "processor time of a step, ms",
}
UNITS = {
    "_db": "dB",
    "_dbm": "dBm",
    "_hz": "Hz",
    "_deg": "degrees",
    "_ms": "ms",
    "_s": "s",
    "_m": "m",
}
PARAMETER_LABELS = {
    "alpha": "path-loss exponent",
    "duration": "duration, s",
    "frequency": "frequency, Hz",
    "radius": "radius, m",
    "rt60": "reverberation time, s",
    "snr_db": "SNR, dB",
    "source_depth": "depth of the source, m",
}


def metric_label(metric: str, unit: str = "") -> str:
    """Return the label of an axis of a metric.

    Parameters
    ----------
    metric : str
        Name in a study.
    unit : str
        Unit of errors: degrees or m; empty if it is not known.

    Returns
    -------
    str

    Examples
    --------
    >>> metric_label("gospa", "degrees"), metric_label("rmse"), metric_label("own_metric")
    ('GOSPA, degrees', 'RMSE', 'own metric')
    """
    label = METRIC_LABELS.get(metric)
    return parameter_label(metric) if label is None else label.format(unit).removesuffix(", ")


def parameter_label(parameter: str) -> str:
    """Return the label of an axis of a scenario's parameter: its name, and the unit of its suffix.

    Parameters
    ----------
    parameter : str
        Name of the parameter.

    Returns
    -------
    str

    Examples
    --------
    >>> parameter_label("snr_db"), parameter_label("noise_db"), parameter_label("n_sensors")
    ('SNR, dB', 'noise, dB', 'number of sensors')
    """
    if parameter in PARAMETER_LABELS:
        return PARAMETER_LABELS[parameter]
    suffix = next((each for each in UNITS if parameter.endswith(each)), "")
    name = parameter.removesuffix(suffix).replace("_", " ")
    name = f"number of {name[2:]}" if name.startswith("n ") else name
    return f"{name}, {UNITS[suffix]}" if suffix else name


PLACES = {1: "on a line", 2: "in a plane", 3: "in space"}
UNIT_STEPS = ((1e9, "GHz"), (1e6, "MHz"), (1e3, "kHz"), (1.0, "Hz"))
TITLE_SIZE, LEGEND_SIZE = 10, 8  # points
BELOW = 34.0  # points, from the axes to a legend below their label
CHARACTERS = 15.0  # of a title, an inch


def settings_text(run: Run, measurement: Any = None) -> str:
    """Return tracker, array, frequency and noise of a run in a line, as far as they are known.

    Parameters
    ----------
    run : Run
        Run of any tracker.
    measurement : MeasurementModel, optional
        Measurement model; that of the run if None.

    Returns
    -------
    str
        Empty if nothing is known.

    Examples
    --------
    >>> from arrivals.measurement_models import ArraySnapshot, SensorArray
    >>> from arrivals.trackers import CBF
    >>> array = SensorArray.ula(8, spacing=0.04, speed=343.0)
    >>> model = ArraySnapshot(array, wavelength=array.wavelength(2000.0), noise=0.01)
    >>> settings_text(CBF(model).run([model.steering_vector(0.5)]))
    'CBF, 8 sensors on a line, 2 kHz, noise −20 dB'
    """
    model = run.measurement if measurement is None else measurement
    return ", ".join(filter(None, [run.tracker, *_model_texts(model)]))


def _model_texts(model: Any) -> list[str]:
    array, stations = getattr(model, "array", None), getattr(model, "stations", None)
    texts = []
    if array is not None and hasattr(array, "n_sensors"):
        texts.append(f"{array.n_sensors} sensors {PLACES[array.dim]}")
    elif np.ndim(getattr(model, "sensors", 0)) == 2:
        texts.append(f"{len(model.sensors)} sensors")
    elif stations is not None:
        texts.append(f"{len(stations)} stations")
    if hasattr(model, "wavelengths"):
        texts.append(_band_text(model.wavelengths, getattr(array, "speed", None)))
    if getattr(model, "n_snapshots", 1) > 1:
        texts.append(f"{model.n_snapshots} snapshots a step")
    if getattr(model, "coherence", None) is not None:
        texts.append("noise not white")
    elif isinstance(getattr(model, "noise", None), float) and model.noise != 1.0:
        level = f"{10 * np.log10(model.noise):.3g}".replace("-", "−")
        texts.append(f"noise {level} dB")
    if isinstance(getattr(model, "sigma", None), float):
        texts.append(f"σ = {neper_to_db(model.sigma):.3g} dB")
    return texts


def _band_text(wavelengths: Sequence[float], speed: float | None) -> str:
    """Return the frequency or the band, or the wavelengths where the speed is not known."""
    lengths = np.asarray(wavelengths, dtype=np.float64)
    if speed is None:
        span, unit = np.sort(lengths), "m"
    else:
        span = np.sort(speed / lengths)
        scale, unit = next(
            each for each in UNIT_STEPS if span[-1] > 0.9999 * each[0] or each[0] == 1.0
        )
        span = span / scale
    ends = " to ".join(f"{end:.4g}" for end in dict.fromkeys((span[0], span[-1])))
    bins = f" ({len(span)} bins)" if len(span) > 1 else ""
    return f"{'wavelength ' if speed is None else ''}{ends} {unit}{bins}"


def set_title(ax: Axes, *parts: str) -> None:
    """Set the title of axes that have none, in lines that are as wide as the axes.

    Parameters
    ----------
    ax : matplotlib Axes
        Axes of a plot.
    *parts : str
        Parts of the title; empty ones are left out.

    Examples
    --------
    >>> from matplotlib.figure import Figure
    >>> ax = Figure().subplots()
    >>> set_title(ax, "SVALSE", "", "12 sensors")
    >>> ax.get_title()
    'SVALSE, 12 sensors'
    """
    text = ", ".join(filter(None, parts))
    if text and not ax.get_title() and not ax.get_title("left"):
        width = ax.get_position().width * ax.figure.bbox.width / ax.figure.dpi
        ax.set_title(textwrap.fill(text, max(24, int(CHARACTERS * width))), fontsize=TITLE_SIZE)


def legend_beside(ax: Axes, **more: Any) -> None:
    """Add a legend to the right of the axes, where it covers no curve; none without entries.

    Parameters
    ----------
    ax : matplotlib Axes
        Axes whose artists have labels.
    **more : object
        Further arguments of `Axes.legend`.
    """
    if ax.get_legend_handles_labels()[0]:
        place: dict[str, Any] = {"loc": "upper left", "bbox_to_anchor": (1.01, 1.0)}
        ax.legend(**{"fontsize": LEGEND_SIZE, "frameon": False, **place, **more})


def legend_above(ax: Axes, n_columns: int, **more: Any) -> None:
    """Add a legend in columns between the axes and their title, which leaves space for it.

    Parameters
    ----------
    ax : matplotlib Axes
        Axes whose artists have labels.
    n_columns : int
        Number of columns.
    **more : object
        Further arguments of `Axes.legend`.
    """
    legend_beside(ax, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=n_columns, **more)


def legend_below(ax: Axes, n_columns: int, **more: Any) -> None:
    """Add a legend in columns below the label of the horizontal axis.

    Parameters
    ----------
    ax : matplotlib Axes
        Axes whose artists have labels.
    n_columns : int
        Number of columns.
    **more : object
        Further arguments of `Axes.legend`.
    """
    from matplotlib.transforms import ScaledTranslation

    down = ScaledTranslation(0, -BELOW / 72, ax.figure.dpi_scale_trans)
    place = {"bbox_to_anchor": (0.5, 0.0), "bbox_transform": ax.transAxes + down}
    legend_beside(ax, loc="upper center", ncols=n_columns, **place, **more)
