"""Settings of the documentation site: `python -m sphinx -W docs site`."""

import os
import sys
from pathlib import Path

# One BLAS thread: the matrices of the examples are small. Read by numpy and by the notebooks.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
DOCS = Path(__file__).parent
sys.path.insert(0, str(DOCS))

from docutils.parsers.rst import roles
from site_tools import docstrings, markdown, reference
from sphinx.application import Sphinx

import arrivals

project = "Arrivals"
author = "Arrivals contributors"
copyright = "Arrivals contributors"  # noqa: A001
version = release = arrivals.__version__

extensions = [
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "numpydoc",
    "myst_nb",
    "sphinx_gallery.gen_gallery",
]
exclude_patterns = [
    "site_tools",
    "array_files/*.py",
    "gallery",
    "auto_gallery/*.ipynb",
    "auto_gallery/*.py",
    "sg_execution_times.rst",
    "**/sg_execution_times.rst",
    "**/.ipynb_checkpoints",
]
highlight_language = "none"
default_role = "name"  # site_tools.docstrings: a link for a public name

# Reference: one page a public name, written by site_tools.reference before pages are read.
autodoc_typehints = "none"  # types are in the tables of parameters
autodoc_member_order = "groupwise"
autosummary_generate = False
numpydoc_show_class_members = False

# Markdown as on GitHub; links to headings are checked.
myst_enable_extensions = ["colon_fence"]
myst_heading_anchors = 4
suppress_warnings = [
    "myst.header",  # a page of docs may begin at the second level
    "sphinx_gallery.space_in_filename",  # the checkout may lie in a folder whose name has a space
]

# Notebooks are stored without outputs and run here.
nb_execution_mode = "force"
nb_execution_timeout = 120
nb_execution_raise_on_error = True
nb_ipywidgets_js: dict[str, dict[str, str]] = {}  # no scripts from elsewhere

sphinx_gallery_conf = {
    "examples_dirs": "gallery",
    "gallery_dirs": "auto_gallery",
    "image_scrapers": ("site_tools.pictures.scrape",),
    "abort_on_example_error": True,
    "download_all_examples": False,
    "min_reported_time": 5,
    "show_signature": False,
    "within_subsection_order": "site_tools.pictures.place",
}

html_theme = "pydata_sphinx_theme"
html_title = "Arrivals"
html_show_sourcelink = False
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_theme_options = {
    "navigation_depth": 2,
    "show_nav_level": 1,
    "collapse_navigation": True,
    "show_toc_level": 2,
    "secondary_sidebar_items": ["page-toc"],
    "navbar_end": ["theme-switcher"],
    "footer_start": ["copyright"],
    "footer_end": ["sphinx-version"],
}
html_sidebars = {"index": [], "contributing": [], "reference/*": []}


def setup(app: Sphinx) -> None:
    """Write the generated pages, and connect the reader of Markdown links."""
    reference.write(DOCS / "reference")
    roles.register_local_role("name", docstrings.name_role(reference.documented()))
    app.connect("source-read", markdown.rewrite)
    app.connect("autodoc-process-signature", docstrings.signature)
    app.connect("autodoc-process-docstring", docstrings.escape, priority=600)
