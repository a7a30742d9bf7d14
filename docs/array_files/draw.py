"""Draw the arrays of array_files.md: each example whose picture follows it."""

import re
import tomllib
from pathlib import Path

from arrivals.measurement_models.arrays import from_description
from arrivals.plots import plot_array
from arrivals.plots.bearing_time import save

PAGE = Path(__file__).parents[1] / "array_files.md"
EXAMPLE = re.compile(r"```toml\n(.*?)```\n\n!\[[^\]]*\]\((\S+\.png)\)", re.DOTALL)


def main() -> None:
    """Draw all examples."""
    for text, picture in EXAMPLE.findall(PAGE.read_text(encoding="utf-8")):
        keys = tomllib.loads(text)
        ax = plot_array(from_description(keys), clockwise=keys.get("clockwise", False))
        save(ax, PAGE.parent / picture, dpi=90)


if __name__ == "__main__":
    main()
