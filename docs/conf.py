"""How Sphinx builds these pages: ``make docs``."""

from __future__ import annotations

import os
import sys
from pathlib import Path

DOCS = Path(__file__).parent
# extensions/ and pictures/ beside this file
sys.path.insert(0, str(DOCS))
os.environ.setdefault("MPLBACKEND", "agg")

from sphinx.util.tags import Tags  # noqa: E402

import sepi  # noqa: E402

# `-t quick`: the gallery's scripts are shown, not run; `-t demo`: the landing page has the report
tags: Tags

project = "sepi"
author = "The sepi developers"
copyright = author
release = version = sepi.__version__

extensions = [
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "numpydoc",
    "myst_parser",
    "sphinx_design",
    "sphinx_click",
    "sphinx_copybutton",
    "extensions.command_help",
    "extensions.drawing",
    "extensions.generated",
    "extensions.links",
    "extensions.figures_in_tables",
]
exclude_patterns = [
    "_made",
    "_templates",
    "gallery",
    "extensions",
    "example_extension",
    "pictures",
    "**/GALLERY_HEADER.*",
]
templates_path = ["_templates"]
source_suffix = {".md": "markdown", ".rst": "restructuredtext"}

# warnings stop `make docs`, those of references among them
nitpicky = True

highlight_language = "none"
myst_enable_extensions = ["colon_fence", "deflist", "attrs_inline"]
myst_heading_anchors = 4
# a code block of shell commands in the Markdown pages is indented, and has no language
copybutton_selector = "div.highlight pre"

autosummary_generate = True
autosummary_imported_members = False
autodoc_typehints = "none"
autodoc_member_order = "bysource"
toc_object_entries_show_parents = "hide"
numpydoc_show_class_members = False
numpydoc_class_members_toctree = False
numpydoc_validation_checks = {"PR02", "PR04", "GL08"}

html_theme = "pydata_sphinx_theme"
html_title = "sepi"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_copy_source = False
html_show_sourcelink = False
html_theme_options = {
    "logo": {"text": "sepi"},
    "header_links_before_dropdown": 7,
    "navbar_align": "left",
    "show_prev_next": True,
    "show_toc_level": 2,
    "footer_start": ["copyright"],
    "footer_end": ["theme-version"],
    "pygments_light_style": "a11y-high-contrast-light",
    "pygments_dark_style": "a11y-high-contrast-dark",
}
html_sidebars: dict[str, list[str]] = {"index": []}

# external addresses: `make docs-links`, which needs the network
linkcheck_timeout = 20
linkcheck_retries = 2
# answered to browsers only
linkcheck_ignore = [r"https://doi\.org/.*"]

if list((DOCS / "gallery").glob("plot_*.py")):
    extensions.append("sphinx_gallery.gen_gallery")
    sphinx_gallery_conf = {
        "examples_dirs": "gallery",
        "gallery_dirs": "examples",
        "filename_pattern": "/plot_",
        "within_subsection_order": "FileNameSortKey",
        "download_all_examples": False,
        "show_memory": False,
        "write_computation_times": False,
        "show_signature": False,
        "min_reported_time": 1,
        "plot_gallery": not tags.has("quick"),  # noqa: F821
        "abort_on_example_error": True,
        "image_scrapers": ("matplotlib",),
        "image_srcset": ["2x"],
        "reset_modules": ("extensions.gallery_reset.reset",),
        "capture_repr": (),
        "remove_config_comments": True,
    }
else:
    # contents and a card of index.md name it
    suppress_warnings = ["toc.not_readable", "ref.doc"]
