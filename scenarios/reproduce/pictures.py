"""Pictures of the studies: small files with their origin in the lower corner."""

from __future__ import annotations

from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING

from arrivals.files import atomic_write

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MAX_BYTES = 150_000
COLOURS = 255  # of a palette, where the full colours take too much


def save_picture(figure: Figure, path: Path, origin: str) -> None:
    """Write a figure as PNG of at most `MAX_BYTES`, by fewer colours and then fewer pixels.

    Parameters
    ----------
    figure : Figure
    path : Path
    origin : str
        Line in the lower right corner: title, study, seed, runs, version.

    Examples
    --------
    >>> from matplotlib.figure import Figure
    >>> save_picture(Figure(), Path("/absent/a.png"), "nothing")
    Traceback (most recent call last):
    FileNotFoundError: [Errno 2] the folder does not exist: '/absent'
    """
    figure.supxlabel(origin, x=0.995, ha="right", fontsize=6, color="0.4")
    with atomic_write(path, binary=True) as file:
        file.write(_small_png(figure))


def _small_png(figure: Figure) -> bytes:
    from PIL import Image

    for dpi in (130, 110, 90, 75):
        whole, reduced = BytesIO(), BytesIO()
        figure.savefig(whole, format="png", dpi=dpi)
        if whole.tell() <= MAX_BYTES:
            break
        image = Image.open(whole).convert("RGB")
        image.quantize(COLOURS, dither=Image.Dither.NONE).save(reduced, "PNG", optimize=True)
        whole = reduced
        if whole.tell() <= MAX_BYTES:
            break
    return whole.getvalue()
