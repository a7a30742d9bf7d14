"""Options of `arrivals.track`, given and chosen."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from arrivals.measurement_models.manifolds.two_unknowns import Unknowns
from arrivals.recordings.step_snapshots import reduced_number
from arrivals.validation import count, items, positive

WIDEBAND, NARROWBAND = "wideband_mixture", "svalse"


@dataclass(frozen=True, eq=False)
class TrackOptions:
    """Arguments of `arrivals.track`; None for those to be chosen.

    Parameters
    ----------
    tracker : str, optional
        Registered name.
    frequencies : float or sequence of float, optional
        Frequencies, Hz.
    band : (float, float), optional
        Edges, Hz, in place of frequencies: all bins of the window between them.
    window, hop, snapshots : int, optional
        Samples of a window and between windows; windows in a step.
    settings : mapping of str to object
        Parameters of the tracker, as in `set_params`.
    reduce : bool
        True to replace the snapshots of a step by eight a channel, of the same covariance; only for
        complex samples.
    follow : float, optional
        Largest shift, Hz, of tones at the given frequencies: in each step they are where the power
        of all channels is largest.
    unknowns : {"azimuth", "sphere", "range"}
        Unknowns of a source, as in `ArraySnapshot`: a direction in the plane of the array; azimuth
        and elevation; direction and range.
    nearest : float, optional
        Distance of the nearest source, m, as in `ArraySnapshot`; only with ranges.

    Examples
    --------
    >>> TrackOptions(frequencies=440).frequencies
    (440.0,)
    """

    tracker: str | None = None
    frequencies: float | Sequence[float] | None = None
    band: Sequence[float] | None = None
    window: int | None = None
    hop: int | None = None
    snapshots: int | None = None
    settings: Mapping[str, Any] = field(default_factory=dict)
    reduce: bool = False
    follow: float | None = None
    unknowns: Unknowns = "azimuth"
    nearest: float | None = None

    def __post_init__(self) -> None:
        if self.frequencies is not None and self.band is not None:
            raise ValueError("pass only one of frequencies and band")
        if self.frequencies is not None:
            given: Any = self.frequencies
            several = items("frequencies", given) if isinstance(given, Iterable) else [given]
            bins = tuple(positive("frequency", each) for each in several)
            if not bins:
                raise ValueError("frequencies must have at least one; got none")
            object.__setattr__(self, "frequencies", bins)
        if self.band is not None and len(items("band", self.band)) != 2:
            raise ValueError(f"band must have two edges, Hz; got {len(self.band)} numbers")
        if self.follow is not None:
            object.__setattr__(self, "follow", positive("follow", self.follow))
            if self.frequencies is None:
                raise ValueError("follow requires frequencies, of tones that are shifted")
        for name, least in (("window", 2), ("hop", 1), ("snapshots", 1)):
            if getattr(self, name) is not None:
                count(name, getattr(self, name), least)

    @property
    def has_frequencies(self) -> bool:
        """True if frequencies or a band are given."""
        return self.frequencies is not None or self.band is not None


@dataclass(frozen=True)
class Choice:
    """Frequencies, windows and tracker of a recording.

    Parameters
    ----------
    reason : str
        Kind of recording; empty if nothing of weight was left to choose.
    tracker : str
        Registered name.
    frequencies : tuple of float
        Frequencies of the bins, Hz.
    band : (float, float), optional
        Edges, Hz, if the frequencies are all bins of the window between them.
    window, hop : int, optional
        As in `Recording.snapshots`.
    n_snapshots : int
        Windows in a step.
    settings : mapping of str to object
        Parameters of the tracker.
    reduce : bool
        True if the snapshots of a step are replaced by eight a channel.
    follow : float, optional
        Largest shift of the frequencies, Hz, as in `TrackOptions`.
    unknowns : {"azimuth", "sphere", "range"}
        Unknowns of a source, as in `TrackOptions`.
    nearest : float, optional
        Distance of the nearest source, m.

    Examples
    --------
    >>> choice = Choice("a tone", "svalse", (440.0,), window=1024, n_snapshots=4)
    >>> print(choice)
    a tone: --tracker svalse --frequencies 440 --window 1024 --snapshots 4
    """

    reason: str
    tracker: str
    frequencies: tuple[float, ...]
    band: tuple[float, float] | None = None
    window: int | None = None
    hop: int | None = None
    n_snapshots: int = 1
    settings: Mapping[str, Any] = field(default_factory=dict)
    reduce: bool = False
    follow: float | None = None
    unknowns: Unknowns = "azimuth"
    nearest: float | None = None

    def n_rows(self, n_sensors: int) -> int:
        """Return the number of snapshots that a tracker of an array gets in a step.

        Examples
        --------
        >>> Choice("IQ", "svalse", (433e6,), n_snapshots=4800, reduce=True).n_rows(5)
        40
        """
        return reduced_number(self.n_snapshots, n_sensors) if self.reduce else self.n_snapshots

    def __str__(self) -> str:
        words = [f"--tracker {self.tracker}"]
        if self.band is None:
            words.append(f"--frequencies {_numbers(self.frequencies)}")
        else:
            words.append(f"--band {_numbers(self.band)}")
        framing = {"window": self.window, "hop": self.hop, "snapshots": self.n_snapshots}
        words += [f"--{name} {value}" for name, value in framing.items() if value is not None]
        words += ["--reduce"] if self.reduce else []
        words += [f"--follow {self.follow:g}"] if self.follow is not None else []
        words += [f"--unknowns {self.unknowns}"] if self.unknowns != "azimuth" else []
        words += [f"--nearest {self.nearest:g}"] if self.nearest is not None else []
        words += [f"--set {name}={_text(value)}" for name, value in self.settings.items()]
        return f"{self.reason}: {' '.join(words)}"


def _text(value: Any) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)


def _numbers(values: Iterable[float]) -> str:
    return " ".join(f"{each:.9g}" for each in values)
