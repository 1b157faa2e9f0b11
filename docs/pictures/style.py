"""Ink for light and for dark pages, and how a figure is written: twice, on a transparent ground."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib
from matplotlib.figure import Figure

from sepi.io.files import atomic_path


@dataclass(frozen=True)
class Ink:
    """Colours of a drawing: words and lines, what matters less, and three that are told apart by every kind of eye."""

    name: str
    text: str
    faint: str
    near: str
    far: str
    marked: str


INKS = (
    Ink("light", text="#222832", faint="#8a94a3", near="#b3500a", far="#0a6ea8", marked="#007a5a"),
    Ink("dark", text="#d5dce3", faint="#7d8793", near="#ffa55c", far="#6cc0f5", marked="#4fd1a5"),
)

Draw = Callable[[Ink], Figure]
"""A drawing, but for its colours."""


def new_sheet(width: float, height: float) -> Figure:
    """An empty figure of this size in inches; no pyplot, whose figures are global state."""
    return Figure(figsize=(width, height), layout="constrained")


def write_drawing(folder: Path, name: str, draw: Draw) -> None:
    """Write ``NAME-light.svg`` and ``NAME-dark.svg``; equal drawings give equal bytes."""
    options: dict[str, Any] = {"format": "svg", "transparent": True, "metadata": {"Date": None, "Creator": None}}
    for ink in INKS:
        settings: dict[Any, Any] = {
            "svg.hashsalt": name,
            "font.size": 9,
            "text.color": ink.text,
            "axes.labelcolor": ink.text,
            "axes.edgecolor": ink.faint,
            "axes.titlesize": 9,
            "xtick.color": ink.text,
            "ytick.color": ink.text,
        }
        with matplotlib.rc_context(settings), atomic_path(folder / f"{name}-{ink.name}.svg") as temporary:
            draw(ink).savefig(temporary, dpi=150, **options)
