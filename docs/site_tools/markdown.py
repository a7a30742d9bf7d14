"""Links of the Markdown pages that lead out of the folder of documents, or to raw HTML anchors."""

import re
import tomllib
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[2]
PAGES = {
    "CONTRIBUTING.md": "docs/contributing.md",
    "README.md": "docs/index.md",
    "docs/gallery": "docs/auto_gallery/index.rst",
}
EXAMPLE = re.compile(r"^docs/gallery/(plot_\w+)\.py$")
ANCHOR = re.compile(r'^<a id="([\w-]+)"></a>$', re.MULTILINE)
BLANK_END = re.compile(r"(^```python\n(?:(?!```).*\n)*?)\n(?=```$)", re.MULTILINE)  # of doctest
LINK = re.compile(r"\[([^\]]*)\]\((?!https?:)([^)\s]+)\)")


def rewrite(app: object, page: str, source: list[str]) -> None:
    """Rewrite the source of a page, as Sphinx's event `source-read` asks for."""
    source[0] = rewritten(source[0], Path("docs") / f"{page}.md")


def rewritten(text: str, page: Path) -> str:
    """Return a page in which anchors are targets, and links lead to pages or to the repository.

    `page` is relative to the root of the repository.
    """
    text = BLANK_END.sub(r"\1", ANCHOR.sub(r"(\1)=", text))
    return LINK.sub(lambda found: link(found[1], found[2], page), text)


def link(words: str, target: str, page: Path) -> str:
    """Return one link of a page in Markdown."""
    path, _, anchor = target.partition("#")
    file = (ROOT / page.parent / path).resolve()
    if not file.is_relative_to(ROOT):
        return f"[{words}]({target})"
    if not path or anchor in anchors(file):
        return f"[{words}](#{anchor})"
    inside = EXAMPLE.sub(r"docs/auto_gallery/\1.rst", file.relative_to(ROOT).as_posix())
    inside = PAGES.get(inside, inside)
    if inside.startswith("docs/"):
        up = "../" * (len(page.parts) - 2)
        return f"[{words}]({up}{inside.removeprefix('docs/')}{'#' * bool(anchor)}{anchor})"
    return f"[{words}]({repository()}/{inside})" if repository() else f"{words} (`{inside}`)"


@cache
def anchors(file: Path) -> frozenset[str]:
    """Return the raw HTML anchors of a Markdown file; headings are not among them."""
    if file.suffix != ".md" or not file.exists():
        return frozenset()
    return frozenset(ANCHOR.findall(file.read_text(encoding="utf-8")))


@cache
def repository() -> str:
    """Return the address of the files of the repository, from pyproject.toml; "" without one."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    urls = {name.lower(): url for name, url in project.get("urls", {}).items()}
    address = urls.get("repository", urls.get("source", ""))
    return f"{address.rstrip('/')}/blob/main" if address else ""
