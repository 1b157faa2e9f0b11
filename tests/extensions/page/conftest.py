"""The page of the small report in one window, which every test opens anew: a window of its own takes twice as long."""

from collections.abc import Iterator
from typing import Any

import pytest
from browser import opened, settled, shown, window
from page_example import Example

WIDTH, HEIGHT = 1400, 900


@pytest.fixture(scope="session")
def one_window(browser: Any) -> Iterator[Any]:
    """An empty page of desktop width."""
    context, page = window(browser, WIDTH, HEIGHT, color_scheme="light")
    yield page
    context.close()


@pytest.fixture(scope="session")
def kept_page(browser: Any, example: Example) -> Iterator[tuple[Any, list[str]]]:
    """The page of the small report in another window, opened once, and what it complained of."""
    told: list[str] = []
    with opened(browser, example.page, WIDTH, HEIGHT, told, color_scheme="light") as page:
        yield page, told


@pytest.fixture
def same_page(kept_page: tuple[Any, list[str]]) -> Iterator[Any]:
    """The page as an earlier test may have left it, scrolled and with other maps: for tests that choose what they see.

    The scene is the first, all parts are as they were, and nothing may complain or leave the page.
    """
    page, told = kept_page
    yield page
    settled(page)
    assert not told, told


@pytest.fixture
def page(one_window: Any, example: Example) -> Iterator[Any]:
    """The page of the small report at desktop width, light; nothing may complain or leave the page."""
    try:
        with shown(one_window, example.page):
            yield one_window
    finally:
        # the page keeps nothing beyond its document; what the browser keeps is as at first
        one_window.goto("about:blank")
        one_window.mouse.move(0, 0)
        one_window.set_viewport_size({"width": WIDTH, "height": HEIGHT})
        one_window.emulate_media(color_scheme="light")
