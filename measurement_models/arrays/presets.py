"""Arrays of known hardware by name: array files that ship with the package."""

from functools import cache
from importlib.resources import files

FOLDER = files("arrivals.measurement_models.arrays") / "presets"


@cache
def preset_names() -> tuple[str, ...]:
    """Return the names of the presets, sorted.

    Examples
    --------
    >>> "respeaker-4mic" in preset_names()
    True
    """
    names = (file.name for file in FOLDER.iterdir())
    return tuple(sorted(name[:-5] for name in names if name.endswith(".toml")))


def preset_text(name: str) -> str:
    """Return the array file of a preset.

    Examples
    --------
    >>> print(preset_text("kraken-5"))  # doctest: +ELLIPSIS
    # KrakenSDR, 5 antennas on a circle of a radius of your choice ...
    """
    return (FOLDER / f"{name}.toml").read_text(encoding="utf-8")


def preset_summary(name: str) -> str:
    """Return the first line of a preset's array file, which names the hardware.

    Examples
    --------
    >>> preset_summary("respeaker-4mic")
    'ReSpeaker 4-Mic Array for Raspberry Pi'
    """
    return preset_text(name).partition("\n")[0].lstrip("# ")
