"""Labels of axes, with units, from the names of metrics and parameters."""

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
