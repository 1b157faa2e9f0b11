"""How easily each page reads: ``python docs/readability.py``. A report, by which nothing fails.

Flesch's reading ease of paragraphs and lists: 60 to 70 is plain English, below 30 hard. Code in them counts as a word.
Syllables are groups of vowels, which are a fiftieth fewer than a dictionary of pronunciation has.
"""

from __future__ import annotations

import re
from itertools import pairwise
from pathlib import Path

from markdown_it import MarkdownIt
from tabulate import tabulate

# endings that are no syllable: "stage", "named", "planes"
SILENT = re.compile(r"(?<=[^aeiouyl])e$|(?<=[^dt])ed$|(?<=[^cghsxz])es$")
ROOT = Path(__file__).parents[1]
MADE = ("docs/_made", "docs/examples", "docs/reference/api")


def readability(markdown: str) -> tuple[float, float, int]:
    """Reading ease, mean words of a sentence, and words, without headings, tables, blocks of code and directives."""
    sentences = []
    for before, token in pairwise(MarkdownIt("commonmark").enable("table").parse(markdown)):
        if before.type == "paragraph_open" and not token.content.startswith((":", "(", "$")):
            said = {"code_inline": "code", "softbreak": " "}
            text = "".join(said.get(part.type, part.content) for part in token.children or ())
            sentences += [re.findall(r"[a-z][a-z'-]*", part) for part in re.split(r"[.!?]\s", text.lower())]
    words = [word for sentence in sentences for word in sentence]
    syllables = sum(len(re.findall("[aeiouy]+", SILENT.sub("", word))) or 1 for word in words)
    length = len(words) / max(sum(map(bool, sentences)), 1)
    return 206.835 - 1.015 * length - 84.6 * syllables / max(len(words), 1), length, len(words)


if __name__ == "__main__":
    pages = {page.relative_to(ROOT).as_posix(): page for page in (*ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md"))}
    found = [(name, *readability(page.read_text("utf-8"))) for name, page in pages.items() if not name.startswith(MADE)]
    rows = sorted((row for row in found if row[-1]), key=lambda row: row[1])
    print(tabulate(rows, ["page", "reading ease", "words a sentence", "words"], tablefmt="pipe", floatfmt=".1f"))
