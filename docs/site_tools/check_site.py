"""Check a built site: its links, its public names, and its pictures."""

import sys
from functools import cache
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

from site_tools import reference

LINKS = {"a": "href", "img": "src", "link": "href", "script": "src", "source": "src"}
MIN_EXAMPLES = 14


class Page(HTMLParser):
    """Anchors of a page, and its links as (tag, address)."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.anchors: set[str] = {"", "top"}
        self.links: list[tuple[str, str]] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Keep the anchors and the link of a tag."""
        values = dict(attrs)
        self.anchors |= {value for key in ("id", "name") if (value := values.get(key))}
        if address := values.get(LINKS.get(tag, "")):
            self.links.append((tag, address))


@cache
def parsed(file: Path) -> Page:
    """Return the anchors and links of an HTML file."""
    return Page(file.read_text(encoding="utf-8"))


def pages(site: Path) -> list[Path]:
    """Return the HTML files of a site, without templates among the static files."""
    return sorted(file for file in site.rglob("*.html") if "_static" not in file.parts)


def link_faults(site: Path) -> list[str]:
    """Return one line for each link inside the site that leads nowhere, and each foreign file."""
    faults = []
    for file in pages(site):
        for tag, address in parsed(file).links:
            parts = urlsplit(address)
            where = f"{file.relative_to(site)}: {address}"
            if parts.scheme or parts.netloc:
                if tag != "a":
                    faults.append(f"{where} is loaded from elsewhere")
                continue
            path = unquote(parts.path)
            target = (file.parent / path).resolve() if path else file
            target = target / "index.html" if target.is_dir() else target
            if not target.is_file():
                faults.append(f"{where} does not exist")
            elif target.suffix == ".html" and unquote(parts.fragment) not in parsed(target).anchors:
                faults.append(f"{where} has no such anchor")
    return faults


def name_faults(site: Path) -> list[str]:
    """Return one line for each public name without an entry in the reference."""
    faults = []
    for name in sorted(set(reference.documented().values())):
        file = site / "reference" / f"{name}.html"
        if not file.is_file() or name not in parsed(file).anchors:
            faults.append(f"reference/{name}.html has no entry of {name}")
    return faults


def gallery_faults(site: Path, examples: Path) -> list[str]:
    """Return one line for each example without a page or a picture, and if there are too few."""
    names = sorted(file.stem for file in examples.glob("plot_*.py"))
    faults = [] if len(names) >= MIN_EXAMPLES else [f"the gallery has {len(names)} examples"]
    for name in names:
        if not (site / "auto_gallery" / f"{name}.html").is_file():
            faults.append(f"auto_gallery/{name}.html does not exist")
        elif not list((site / "_images").glob(f"sphx_glr_{name}_0*.png")):
            faults.append(f"auto_gallery/{name}.html has no picture")
    return faults


def main(site: Path) -> int:
    """Print all faults of a site; return 1 if there are any."""
    docs = Path(__file__).parents[1]
    faults = link_faults(site) + name_faults(site) + gallery_faults(site, docs / "gallery")
    links = sum(len(parsed(file).links) for file in pages(site))
    print(*faults, sep="\n", end="\n" if faults else "")
    print(f"{len(pages(site))} pages, {links} links, {len(faults)} faults")
    return int(bool(faults))


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]).resolve()))
