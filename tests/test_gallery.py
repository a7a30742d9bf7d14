"""Examples of the gallery have what the build of the site needs, which runs them."""

import ast
from pathlib import Path

import pytest

GALLERY = Path(__file__).parents[1] / "docs" / "gallery"
EXAMPLES = sorted(GALLERY.glob("plot_*.py"))


def test_gallery_has_at_least_14_examples() -> None:
    assert len(EXAMPLES) >= 14


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.stem)
def test_example_has_title_blocks_and_a_plot(example: Path) -> None:
    text = example.read_text(encoding="utf-8")
    tree = ast.parse(text)
    title, underline, *more = (ast.get_docstring(tree) or "").splitlines()
    assert underline == "=" * len(title)
    assert len(" ".join(more)) > 40
    assert text.count("\n# %%\n") >= 2
    names = {node.id for node in ast.walk(tree) if isinstance(node, ast.Name)}
    assert names & {"ax", "axes", "figure"}  # names of which the site takes pictures
