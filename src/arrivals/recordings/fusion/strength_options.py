"""Settings of readings of signal strength in fused positions."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from arrivals.recordings.networks.tracking import PathLossSettings, SourceSettings
from arrivals.validation import number, positive, real


def _missing(name: str, value: Any) -> list[float]:
    return [float(level) for level in np.atleast_1d(real(name, value))]


STRENGTH: dict[str, Callable[[str, Any], Any]] = {
    "alpha": positive,
    "sigma": positive,
    "floor": number,
    "r_min": positive,
    "power": number,
    "power_std": positive,
    "missing": _missing,
}


def checked_strength(table: Mapping[str, Any]) -> dict[str, Any]:
    """Return the settings of signal strength among the keys of a table, checked.

    Parameters
    ----------
    table : mapping of str to object
        `alpha`, loss exponent; `sigma`, shadowing, dB; `floor`, noise floor, dB; `r_min`, floor of
        the range, m; `power` and `power_std`, level of a source at 1 m and its standard deviation,
        dB; `missing`, levels that stand for a missing reading. Others are left out.

    Returns
    -------
    dict of str to object

    Examples
    --------
    >>> checked_strength({"alpha": 3, "floor": None, "area": [0, 0, 1, 1]})
    {'alpha': 3.0}
    """
    return {
        name: check(name, table[name])
        for name, check in STRENGTH.items()
        if table.get(name) is not None
    }


def path_loss(options: Mapping[str, Any]) -> PathLossSettings:
    """Return the model of readings of signal strength; as in `arrivals.locate` if not given.

    Examples
    --------
    >>> path_loss({"sigma": 4.0}).sigma_db
    4.0
    """
    names = {"alpha": "alpha", "sigma": "sigma_db", "floor": "floor_db", "r_min": "r_min"}
    return PathLossSettings(**{to: options[name] for name, to in names.items() if name in options})


def source_power(options: Mapping[str, Any]) -> SourceSettings:
    """Return the prior of the power of a source; as in `arrivals.locate` if not given.

    Examples
    --------
    >>> source_power({"power": -20.0}).power_db
    -20.0
    """
    return SourceSettings(options.get("power"), options.get("power_std"))
