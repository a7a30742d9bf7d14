"""Methods of a study: trackers by name, with settings, and grids of settings."""

from __future__ import annotations

import inspect
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from arrivals.messages import nearest
from arrivals.parameters import to_plain
from arrivals.scenarios.base import Trial
from arrivals.trackers import Tracker, find


@dataclass(frozen=True)
class Method:
    """A tracker with settings and a label.

    Parameters
    ----------
    tracker : str
        Registered name.
    params : mapping of str to object
        Parameters of the tracker, by (nested) names; models that are not set come from the trial.
    label : str
        Name in tables; built from `tracker` and `params` if empty.

    Raises
    ------
    ValueError
        If the tracker is unknown, or does not have one of the parameters.

    Examples
    --------
    >>> Method("svalse", {"motion__p_activate": 0.2}).label
    'svalse(motion__p_activate=0.2)'
    """

    tracker: str
    params: Mapping[str, Any] = field(default_factory=dict)
    label: str = ""
    kind: type[Tracker] = field(init=False, repr=False)  # pickled for other processes

    def __post_init__(self) -> None:
        object.__setattr__(self, "kind", find(self.tracker))
        parameters = inspect.signature(self.kind).parameters
        for name in self.params:
            if name.partition("__")[0] not in parameters:
                raise ValueError(
                    f"the tracker {self.tracker!r} has no parameter {name!r}: "
                    f"{nearest(name, parameters)}"
                )
        settings = ", ".join(f"{name}={value}" for name, value in self.params.items())
        default = f"{self.tracker}({settings})" if settings else self.tracker
        object.__setattr__(self, "label", self.label or default)

    def make(self, trial: Trial, seed_sequence: np.random.SeedSequence) -> Tracker:
        """Make the tracker for a trial.

        Parameters
        ----------
        trial : Trial
            Provides the models that are not set.
        seed_sequence : numpy.random.SeedSequence
            Seeds the generator of a tracker that takes an `rng`.

        Returns
        -------
        Tracker
            A new tracker.
        """
        parameters = inspect.signature(self.kind).parameters
        settings = {name: value for name, value in self.params.items() if name in parameters}
        nested = {name: value for name, value in self.params.items() if name not in parameters}
        if "rng" in parameters and "rng" not in settings:
            own = np.random.SeedSequence(
                seed_sequence.entropy,
                spawn_key=(*seed_sequence.spawn_key, zlib.crc32(self.label.encode())),
            )
            settings["rng"] = np.random.default_rng(own)
        made = trial.tracker(self.kind, **settings)
        if not nested:
            return made
        return type(made)(**made.set_params(**nested).get_params(deep=False))

    def to_dict(self) -> dict[str, Any]:
        """Return the configuration for a results file.

        Returns
        -------
        dict
            Keys `tracker`, `params` and `label`.
        """
        params = {name: to_plain(value) for name, value in self.params.items()}
        return {"tracker": self.tracker, "params": params, "label": self.label}


def methods(trackers: Sequence[str | Method]) -> list[Method]:
    """Return methods with unique labels.

    Examples
    --------
    >>> [method.label for method in methods(["cbf", Method("cbf", {"threshold_db": 3.0})])]
    ['cbf', 'cbf(threshold_db=3.0)']
    >>> methods(["cbf", "cbf"])
    Traceback (most recent call last):
    ValueError: labels of methods must be unique; got 'cbf' twice
    """
    made = [Method(one) if isinstance(one, str) else one for one in trackers]
    labels = [method.label for method in made]
    twice = next((label for label in labels if labels.count(label) > 1), None)
    if twice is not None:
        raise ValueError(f"labels of methods must be unique; got {twice!r} twice")
    if not made:
        raise ValueError("trackers must have at least one entry; got none")
    return made


def grid(tracker: str, values: Mapping[str, Sequence[Any]]) -> list[Method]:
    """Return a method for every combination of values of (nested) parameters.

    Parameters
    ----------
    tracker : str
        Registered name.
    values : mapping of str to sequence, or a list of mappings
        Values by parameter, as for `sklearn.model_selection.ParameterGrid`.

    Returns
    -------
    list of Method
        One method a combination.

    Examples
    --------
    >>> [method.label for method in grid("svalse", {"motion__p_activate": [0.1, 0.2]})]
    ['svalse(motion__p_activate=0.1)', 'svalse(motion__p_activate=0.2)']
    """
    from sklearn.model_selection import ParameterGrid

    return [Method(tracker, params) for params in ParameterGrid(values)]


def tracker_name(method: str) -> str:
    """Return the tracker's name, the first word of a label.

    Examples
    --------
    >>> tracker_name("svalse as printed")
    'svalse'
    """
    return method.partition(" ")[0]
