"""Makes the site of ``docs`` in the folder ``site``, with warnings as errors; lays out those pages that are named.

Every page is read, its references are resolved and its text becomes HTML: what is left out is the frame around it,
which is one for all.
"""

import gc
import sys
from typing import Any

from sphinx.builders.html import StandaloneHTMLBuilder
from sphinx.cmd.build import main

whole = StandaloneHTMLBuilder.handle_page


def handle_page(builder: StandaloneHTMLBuilder, name: str, *words: Any, **given: Any) -> None:
    if name in sys.argv[1:]:
        whole(builder, name, *words, **given)


StandaloneHTMLBuilder.handle_page = handle_page  # type: ignore[method-assign]
# documents are full of cycles, through which the collector goes again and again
gc.disable()
sys.exit(main(["-W", "--keep-going", "--quiet", "-t", "quick", "-b", "html", "docs", "site"]))
