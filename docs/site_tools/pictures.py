"""Pictures of the gallery's examples, and their order."""

from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

ORDER = (
    "first_track", "talkers", "tow", "infrasound", "crossing", "missing_data", "sphere", "range",
    "arrays", "fused_radio", "fused_wildlife", "rss_crossing", "ble_tag", "delay_ekf",
    "ar_separation", "own_motion", "subclass", "filterpy_in_imm", "models_in_filterpy",
    "monte_carlo", "reliability",
)  # fmt: skip


def place(file: str) -> tuple[int, str]:
    """Return the place of an example in the gallery; those that are not listed come last."""
    name = file.removeprefix("plot_").removesuffix(".py")
    return (ORDER.index(name) if name in ORDER else len(ORDER), name)


def scrape(block: Any, block_vars: dict[str, Any], gallery_conf: dict[str, Any]) -> str:
    """Save the figures that a block of an example has made, and return them in reStructuredText.

    Figures are found by the names of the example: `arrivals.plots` makes them without a window,
    where sphinx-gallery's own scraper does not look.
    """
    from sphinx_gallery.scrapers import figure_rst

    files = []
    for value in block_vars["example_globals"].values():
        figure = value.figure if isinstance(value, Axes) else value
        if isinstance(figure, Figure) and not getattr(figure, "in_gallery", False):
            figure.in_gallery = True  # type: ignore[attr-defined]
            files.append(next(block_vars["image_path_iterator"]))
            figure.savefig(files[-1], dpi=100)
    return figure_rst(files, gallery_conf["src_dir"])
