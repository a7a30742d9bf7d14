"""Tables of readings of a walking device, by a simulation."""

import csv
import io
from collections.abc import Iterable, Sequence
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import numpy as np

from arrivals.typing import Float

START = datetime(2026, 5, 1, 12, tzinfo=UTC)
NAMES = tuple(f"AA:BB:CC:00:00:{k:02X}" for k in range(12))
PLACES: Float = np.array([[20.0 * (k // 3), 20.0 * (k % 3)] for k in range(12)])


def truth(time: Float) -> Float:
    """Return the positions (n, 2), m, of the device."""
    return np.stack([5 + 0.45 * time, 10 + 8 * np.sin(time / 15)], axis=-1)


def walk(n_steps: int = 40, seed: int = 0, alpha: float = 2.5) -> list[tuple[float, str, float]]:
    """Return readings (time, sensor, level), one a second of three sensors in four."""
    rng = np.random.default_rng(seed)
    rows = []
    for step, place in enumerate(truth(np.arange(float(n_steps)))):
        distance = np.maximum(np.linalg.norm(place - PLACES, axis=-1), 1.0)
        levels = np.round(-40 - 10 * alpha * np.log10(distance) + rng.normal(0, 3, 12))
        rows += [(float(step), name, float(level))
                 for name, level in zip(NAMES, levels, strict=True)
                 if rng.random() < 0.75]  # fmt: skip
    return rows


def text(header: Sequence[str], rows: Iterable[Sequence[Any]]) -> str:
    """Return a table as CSV."""
    file = io.StringIO()
    writer = csv.writer(file, lineterminator="\n")
    writer.writerow(header)
    writer.writerows(rows)
    return file.getvalue()


def iso(time: float) -> str:
    """Return a date of a time, to 1 ms."""
    return (START + timedelta(seconds=time)).isoformat(timespec="milliseconds")


def sensors(folder: Path) -> Path:
    """Write the table of sensors."""
    path = folder / "sensors.csv"
    rows = [(name, *place) for name, place in zip(NAMES, PLACES.tolist(), strict=True)]
    path.write_text(text(("name", "x_m", "y_m"), rows))
    return path


def wide(rows: Iterable[tuple[float, str, float]]) -> str:
    """Return readings as a table with a column for each sensor."""
    steps: dict[float, dict[str, float]] = {}
    for time, name, level in rows:
        steps.setdefault(time, {})[name] = level
    cells = [(time, *(step.get(name, "") for name in NAMES)) for time, step in steps.items()]
    return text(("time_s", *NAMES), cells)
