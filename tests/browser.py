"""A real browser for the tests of pages: where it is, and what a reader does in it."""

import base64
import os
import shutil
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

WIPE, CLOUD = '[data-part="wipe"]', '[data-part="cloud"]'
"""Selectors of the large picture and of the point cloud."""

NAMES = ("chromium", "chromium-browser", "google-chrome")

Pixels = npt.NDArray[np.uint8]

# enough for the slowest machine; a page that is right takes a fraction of it
_PATIENCE = 20_000


# the pixels of a canvas, top row first, RGBA
_READ = """(canvas) => {
  // a copy: a canvas that is read from often would be told to be slow
  const copy = Object.assign(document.createElement("canvas"), { width: canvas.width, height: canvas.height });
  const context = copy.getContext("2d", { willReadFrequently: true });
  context.drawImage(canvas, 0, 0);
  const { data } = context.getImageData(0, 0, canvas.width, canvas.height);
  let text = "";
  for (let i = 0; i < data.length; i += 8192) text += String.fromCharCode(...data.subarray(i, i + 8192));
  return [canvas.width, canvas.height, btoa(text)];
}"""


def find_browser() -> str | None:
    """The browser's program: what ``SEPI_BROWSER`` names, else a Chromium on the path."""
    named = os.environ.get("SEPI_BROWSER")
    return named or next(filter(None, map(shutil.which, NAMES)), None)


@contextmanager
def launched() -> Iterator[Any]:
    """A headless browser; where there is none, the test is skipped, or fails if ``SEPI_REQUIRE_BROWSER`` is set."""
    program = find_browser()
    try:
        from playwright.sync_api import sync_playwright
    except ImportError:
        _absent("the Python package playwright is not installed")
    if program is None:
        _absent(f"no browser found: none of {', '.join(NAMES)} on the path, and SEPI_BROWSER is not set")
    with sync_playwright() as playwright:
        # a sandbox needs rights that containers do not give
        browser = playwright.chromium.launch(executable_path=program, args=["--no-sandbox", "--disable-gpu"])
        yield browser
        browser.close()


def _absent(why: str) -> None:
    if os.environ.get("SEPI_REQUIRE_BROWSER"):
        pytest.fail(f"{why}, but a browser is required here (SEPI_REQUIRE_BROWSER)")
    pytest.skip(why)


@contextmanager
def opened(
    browser: Any, path: Path, width: int = 1400, height: int = 900, told: list[str] | None = None, **options: Any
) -> Iterator[Any]:
    """A page opened from disk without a network, once it shows its maps.

    Whatever it complains about, and every request beyond the file itself, fails the test at the end; ``told`` takes
    them instead where it is given.
    """
    context, page = window(browser, width, height, **options)
    try:
        with shown(page, path, told):
            yield page
    finally:
        context.close()


def window(browser: Any, width: int = 1400, height: int = 900, **options: Any) -> tuple[Any, Any]:
    """An empty page without a network, and the context that is to be closed after it."""
    context = browser.new_context(viewport={"width": width, "height": height}, offline=True, **options)
    context.set_default_timeout(_PATIENCE)
    return context, context.new_page()


@contextmanager
def shown(page: Any, path: Path, told: list[str] | None = None) -> Iterator[None]:
    """A file in an empty page, watched as :func:`opened` says."""
    wrong: list[str] = [] if told is None else told
    address = path.resolve().as_uri()

    def requested(request: Any) -> None:
        if request.url != address and not request.url.startswith(("data:", "blob:")):
            wrong.append(f"request: {request.url}")

    watched = {
        "console": lambda message: wrong.append(f"console: {message.text}") if complains(message) else None,
        "pageerror": lambda error: wrong.append(f"error: {error}"),
        "request": requested,
    }
    for event, watch in watched.items():
        page.on(event, watch)
    try:
        page.goto(address)
        page.wait_for_selector("#viewer[data-shown]")
        yield
        # errors of what the last action began
        settled(page)
        if told is None:
            assert not wrong, wrong
    finally:
        for event, watch in watched.items():
            page.remove_listener(event, watch)


def complains(message: Any) -> bool:
    """Whether a console message is an error or a warning."""
    return message.type in ("error", "warning")


def settled(page: Any) -> None:
    """Wait until what was asked of the page is drawn: a drawing that was ordered is done two frames later."""
    page.evaluate("() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => done())))")


def changed_pixels(page: Any, selector: str, before: Pixels) -> Pixels:
    """What a canvas shows once it no longer shows ``before``: a map may have to be unpacked first."""
    end = time.monotonic() + _PATIENCE / 1000
    while True:
        settled(page)
        now = canvas_pixels(page, selector)
        if now.shape != before.shape or (now != before).any():
            return now
        assert time.monotonic() < end, f"{selector} shows what it showed before"


def canvas_pixels(page: Any, selector: str) -> Pixels:
    """What a canvas shows, (H, W, 4)."""
    return _decoded(page.eval_on_selector(selector, _READ))


def map_pixels(page: Any, key: str) -> Pixels:
    """The picture of a panel in the size of the maps, (H, W, 4)."""
    return _decoded(page.evaluate(f"async (key) => ({_READ})(await Sepi.viewer.panels.picture(key))", key))


def _decoded(found: tuple[int, int, str]) -> Pixels:
    width, height, text = found
    return np.frombuffer(base64.b64decode(text), np.uint8).reshape(height, width, 4)


def part(page: Any, name: str) -> str:
    """Text of a part of the viewer."""
    return str(page.text_content(f'[data-part="{name}"]')).strip()


def read_out(page: Any) -> dict[str, str]:
    """The numbers under the cursor."""
    sides = {
        f"{name} {side}": part(page, f"{name}-{side}")
        for name in ("value", "error", "confidence", "sigma", "interval")
        for side in "ab"
    }
    return sides | {"ground_truth": part(page, "ground_truth"), "pixel": part(page, "pixel")}


def choose(page: Any, **panels: str) -> None:
    """Show panels as A or B, and wait until they are there."""
    for side, key in panels.items():
        page.select_option(f'[data-part="{side}"]', key)
    wanted = " ".join(page.input_value(f'[data-part="{side}"]') for side in "ab")
    page.wait_for_function("(wanted) => document.getElementById('viewer').dataset.shown === wanted", arg=wanted)


def show_scene(page: Any, title: str) -> None:
    """Choose a scene, and wait until it is there."""
    page.select_option("#scene", label=title)
    page.wait_for_function(
        """() => {
          const select = document.getElementById("scene");
          return Sepi.viewer.shown && document.getElementById("viewer").dataset.scene === select.value;
        }"""
    )


def place_of(page: Any, selector: str, x: int, y: int) -> tuple[float, float]:
    """Where on the screen an element that shows the maps has their pixel (x, y)."""
    page.locator(selector).scroll_into_view_if_needed()
    box = page.locator(selector).bounding_box()
    width, height = page.evaluate("[Sepi.viewer.scene.width, Sepi.viewer.scene.height]")
    return box["x"] + (x + 0.5) * box["width"] / width, box["y"] + (y + 0.5) * box["height"] / height


def point_at(page: Any, x: int, y: int, selector: str = WIPE) -> None:
    """Move the mouse to a pixel of the maps, and wait until it is read out."""
    page.mouse.move(*place_of(page, selector, x, y))
    page.wait_for_function(
        """(wanted) => document.querySelector('[data-part="pixel"]').textContent === wanted""", arg=f"x {x}, y {y}"
    )


def touch(page: Any, paths: Mapping[int, list[tuple[float, float]]]) -> None:
    """Move fingers over the screen, each along its path of equally many points."""
    session = page.context.new_cdp_session(page)
    steps = list(zip(*paths.values(), strict=True))
    for number, places in enumerate(steps):
        points = [{"x": x, "y": y, "id": finger} for finger, (x, y) in zip(paths, places, strict=True)]
        kind = "touchStart" if number == 0 else "touchMove"
        session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})
    session.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})


def as_shown(value: float, decimals: int = 3) -> float:
    """A value as it is printed, as a number: -0.000 is 0.000."""
    return float(f"{value:.{decimals}f}")


def border_is(page: Any, border: int) -> bool:
    """Whether the wipe shows A's picture left of a column and B's from there on."""
    shown = canvas_pixels(page, WIPE)
    a, b = (map_pixels(page, page.input_value(f'[data-part="{side}"]')) for side in "ab")
    assert (a != b).any(axis=(0, 2)).mean() > 0.9, "the two maps look alike: nothing could be told apart"
    expected = np.concatenate([a[:, :border], b[:, border:]], axis=1)
    return bool((shown == expected).all())
