"""The directive ``drawing``: a picture that ``make_pictures.py`` made, once for light pages and once for dark ones."""

from __future__ import annotations

from typing import ClassVar

from docutils import nodes
from docutils.parsers.rst import directives
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

FOLDER = "/_made"


class Drawing(SphinxDirective):
    """``NAME`` of the picture as argument, ``:alt:`` what it shows; the content is the caption."""

    required_arguments = 1
    has_content = True
    option_spec: ClassVar = {"alt": directives.unchanged_required, "width": directives.length_or_percentage_or_unitless}

    def run(self) -> list[nodes.Node]:
        """A figure of two images, of which the theme shows one."""
        figure = nodes.figure(classes=["drawing"])
        for ink in ("light", "dark"):
            place = f"{FOLDER}/{self.arguments[0]}-{ink}.svg"
            figure += nodes.image(uri=place, alt=self.options["alt"], classes=[f"only-{ink}", "dark-light"])
        if self.content:
            caption = nodes.caption()
            words = nodes.Element()
            self.state.nested_parse(self.content, self.content_offset, words)
            for paragraph in words.findall(nodes.paragraph):
                caption += paragraph.children
            figure += caption
        return [figure]


def setup(app: Sphinx) -> dict[str, bool]:
    """Register it."""
    app.add_directive("drawing", Drawing)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
