"""The report's page as a whole in a real browser: it opens from disk, can be read by everyone, and its tables sort."""

from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from browser import CLOUD, WIPE, canvas_pixels, choose, complains, opened, part, place_of, point_at, settled, show_scene
from page_example import COTTON_TITLE, DOTS_TITLE, PICTURE_TITLE, Example

from sepi.extensions.page.page import page_of
from sepi.report.runs import Runs
from sepi.report.tables import table


def test_the_page_opens_from_disk_and_asks_for_nothing(page: Any) -> None:
    """Everything is looked at once; whatever is loaded late would be asked for then, which the fixture forbids."""
    for section in page.query_selector_all("section[id]"):
        section.scroll_into_view_if_needed()
        settled(page)
    page.wait_for_selector(f"{CLOUD}[data-points]")
    for title in (COTTON_TITLE, DOTS_TITLE, PICTURE_TITLE):
        show_scene(page, title)
    assert page.title().startswith("sepi")


def test_the_page_could_not_send_anything(browser: Any, example: Example) -> None:
    """Results may be secret: the page's own policy forbids it to connect or to load."""
    told: list[str] = []
    with opened(browser, example.page, told=told) as page:
        policy = page.get_attribute('meta[http-equiv="Content-Security-Policy"]', "content")
        assert "default-src 'none'" in policy
        stopped = page.evaluate(
            """async () => {
              const found = [];
              addEventListener("securitypolicyviolation", (event) => found.push(event.effectiveDirective));
              await fetch("http://127.0.0.1:9/").catch(() => {});
              new Image().src = "http://127.0.0.1:9/picture.png";
              await new Promise((done) => setTimeout(done, 200));
              return found.sort();
            }"""
        )
    assert stopped == ["connect-src", "img-src"]


def column(page: Any, table: Any, number: int) -> list[str]:
    found: list[str] = table.evaluate(
        "(t, n) => [...t.tBodies[0].rows].map((r) => r.cells[n].textContent.trim())", number
    )
    return found


def test_tables_sort(page: Any) -> None:
    """By numbers, up, down, and back, and names as text; averages and rows without a figure stay at the end."""
    table = page.locator("#table1_mse table").nth(1)
    heads = table.locator("thead th")
    names = column(page, table, 0)
    zhou = [head.strip() for head in heads.all_text_contents()].index("Zhou et al. (SEPI)")
    original = column(page, table, zhou)
    ends = sum(name.startswith("Average") for name in names)
    assert ends >= 1
    assert len(original) - ends > 10

    def numbers() -> list[float]:
        return [float(text) for text in column(page, table, zhou)[:-ends]]

    assert numbers() != sorted(numbers())
    button = heads.nth(zhou).locator("button")
    for order, expected in (("ascending", sorted(numbers())), ("descending", sorted(numbers(), reverse=True))):
        button.click()
        assert heads.nth(zhou).get_attribute("aria-sort") == order
        assert numbers() == expected
        assert column(page, table, 0)[-ends:] == names[-ends:]
    button.click()
    assert heads.nth(zhou).get_attribute("aria-sort") == "none"
    assert (column(page, table, 0), column(page, table, zhou)) == (names, original)
    # only the scene available has a figure of ours: it comes first, up and down
    button = heads.nth(1).locator("button")
    for _ in range(2):
        button.click()
        found = column(page, table, 1)
        assert found[0] != ""
        assert not any(found[1:-2])
        assert column(page, table, 0)[0] == "Cotton"
    heads.nth(0).locator("button").press("Enter")
    names = column(page, table, 0)[:-ends]
    assert names == sorted(names, key=str.lower)
    assert [heads.nth(n).get_attribute("aria-sort") for n in (0, 1)] == ["ascending", "none"]


def luminance(colour: str) -> float:
    """Of a computed colour such as ``rgb(1, 2, 3)``, as WCAG 2 defines it."""
    channels = np.array([float(number) for number in colour.strip("rgba()").split(",")[:3]]) / 255
    linear = np.where(channels <= 0.04045, channels / 12.92, ((channels + 0.055) / 1.055) ** 2.4)
    return float(linear @ (0.2126, 0.7152, 0.0722))


def contrast(one: str, other: str) -> float:
    low, high = sorted((luminance(one), luminance(other)))
    return (high + 0.05) / (low + 0.05)


# colours of all text and of what it stands on, each pair once, with an example
_TEXT_COLOURS = """() => {
  const found = {};
  const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  while (walker.nextNode()) {
    const text = walker.currentNode.textContent.trim();
    const element = walker.currentNode.parentElement;
    if (!text || element.closest("script, option, noscript") || !element.getClientRects().length) continue;
    let below = element;
    const ground = () => getComputedStyle(below).backgroundColor;
    while (below && (below instanceof SVGElement || ground() === "rgba(0, 0, 0, 0)")) below = below.parentElement;
    const style = getComputedStyle(element);
    const ink = element instanceof SVGElement ? style.fill : style.color;
    const what = `${element.tagName}.${element.getAttribute("class")}: ${text.slice(0, 40)}`;
    found[`${ink}|${below ? ground() : "none"}`] ??= what;
  }
  return found;
}"""


def test_all_text_is_readable(page: Any) -> None:
    """WCAG AA: a contrast of 4.5 between every text and what it stands on, light and dark."""
    page.evaluate("document.querySelectorAll('details').forEach((d) => (d.open = true))")
    for scheme in ("light", "dark"):
        page.emulate_media(color_scheme=scheme)
        pairs = page.evaluate(_TEXT_COLOURS)
        assert len(pairs) > 5
        ratios = {pair: contrast(*pair.split("|")) for pair in pairs}
        poor = {(scheme, f"{ratios[pair]:.2f}", pair, what) for pair, what in pairs.items() if ratios[pair] < 4.5}
        assert not poor


def test_light_and_dark(page: Any) -> None:
    """As the system wishes, until the button says otherwise."""

    def paper() -> float:
        return luminance(page.evaluate("getComputedStyle(document.body).backgroundColor"))

    assert page.text_content("#theme") == "dark"
    light = paper()
    page.emulate_media(color_scheme="dark")
    dark = paper()
    assert (light > 0.8, dark < 0.05) == (True, True)
    page.reload()
    page.wait_for_selector("#viewer[data-shown]")
    assert (page.text_content("#theme"), paper()) == ("light", dark)
    page.click("#theme")
    assert (page.text_content("#theme"), paper()) == ("dark", light)
    page.click("#theme")
    assert (page.text_content("#theme"), paper()) == ("light", dark)


@pytest.mark.parametrize("mobile", [False, True])
def test_nothing_makes_the_page_scroll_sideways(browser: Any, example: Example, mobile: bool) -> None:
    """Wide tables scroll in their own frame."""
    phone = {"is_mobile": True, "has_touch": True, "device_scale_factor": 2} if mobile else {}
    with opened(browser, example.page, 390, 844, **phone) as page:
        page.evaluate("document.querySelectorAll('details').forEach((d) => (d.open = true))")
        for width in (320, 390) if mobile else (390, 700, 801, 1400):
            page.set_viewport_size({"width": width, "height": 844})
            for title in (COTTON_TITLE, PICTURE_TITLE):
                show_scene(page, title)
                assert page.evaluate("document.documentElement.scrollWidth") <= width
                assert page.evaluate("innerWidth") == width


def test_everything_has_a_name_for_those_who_do_not_see_it(same_page: Any) -> None:
    same_page.locator("#ablation").scroll_into_view_if_needed()
    nameless = same_page.evaluate(
        """() => {
          const named = (e) => (e.getAttribute("aria-label") ?? e.getAttribute("alt") ?? "").trim() ||
            e.querySelector(":scope > title")?.textContent;
          const labelled = (e) => named(e) || [...(e.labels ?? [])].some((label) => label.textContent.trim());
          const all = (selector) => [...document.querySelectorAll(selector)];
          return [
            ...all("img, canvas, svg").filter((e) => !named(e)),
            ...all("select, input").filter((e) => !labelled(e)),
            ...all("button").filter((e) => !named(e) && !e.textContent.trim()),
          ].map((e) => e.outerHTML.slice(0, 120));
        }"""
    )
    assert nameless == []
    names = same_page.locator("canvas[role=img]").evaluate_all("(all) => all.map((c) => c.getAttribute('aria-label'))")
    assert len(names) > 20
    assert same_page.get_attribute("html", "lang") == "en"
    levels = same_page.evaluate("[...document.querySelectorAll('h1, h2, h3')].map((h) => Number(h.tagName[1]))")
    assert levels.count(1) == 1
    assert all(after - before <= 1 for before, after in pairwise(levels))


def test_the_page_opens_on_maps(page: Any) -> None:
    """What a newcomer waited for, of a scene that the paper has, is seen without scrolling, and tables come later; the
    keyboard reaches everything, and where the focus is, is seen.
    """
    assert page.evaluate("Sepi.viewer.scene.scene") == "cotton"
    assert page.eval_on_selector("#scene", "(select) => select.selectedOptions[0].textContent") == COTTON_TITLE
    assert page.input_value('[data-part="a"]') == "reference_view"
    assert page.input_value('[data-part="b"]') == "best/4_optimize"
    assert page.evaluate("document.querySelector('main section').id") == "scenes"
    box = page.locator(WIPE).bounding_box()
    assert box["y"] < 450
    assert (canvas_pixels(page, WIPE)[:, :, 3] == 255).all()
    page.keyboard.press("Tab")
    assert page.evaluate("document.activeElement.textContent") == "Scenes"
    style = page.evaluate("getComputedStyle(document.activeElement).outlineStyle")
    assert style != "none"
    for selector in (WIPE, CLOUD, '[data-part="slider"]', "#scene", ".scroll"):
        page.locator(selector).first.focus()
        assert page.evaluate("(s) => document.activeElement === document.querySelector(s)", selector), selector


@pytest.mark.parametrize("width", [390, 1400])
def test_nothing_jumps(browser: Any, example: Example, width: int) -> None:
    """Neither when the page opens, nor when another scene or another pixel is chosen.

    The choices are made by scripts: a browser does not count what moves under a reader's hand.
    """
    with opened(browser, example.page, width, 844) as page:
        settled(page)
        assert page.evaluate("jumped") < 0.1
        for place in ("#scenes", WIPE, '[data-part="grid"]'):
            look_at(page, place)
            for title in (DOTS_TITLE, COTTON_TITLE):
                page.eval_on_selector(
                    "#scene",
                    """(select, title) => {
                      select.selectedIndex = [...select.options].findIndex((option) => option.text === title);
                      select.dispatchEvent(new Event("change"));
                    }""",
                    title,
                )
                settled(page)
            assert page.evaluate("jumped") < 0.1, place
        look_at(page, "#pixel-section")
        for number in range(3):
            page.eval_on_selector_all('[data-part="pixels"] button', "(all, number) => all[number].click()", number)
            settled(page)
        assert page.evaluate("jumped") < 0.1


def look_at(page: Any, selector: str) -> None:
    """Scroll there, and count jumps from now on."""
    page.eval_on_selector(selector, "(element) => element.scrollIntoView({ block: 'start' })")
    settled(page)
    page.evaluate("window.jumped = 0")


def renamed(value: Any, names: dict[str, str]) -> Any:
    """JSON in which names, as keys, as values and as parts of the keys of panels, are others."""
    if isinstance(value, dict):
        return {names.get(key, key): renamed(inner, names) for key, inner in value.items()}
    if isinstance(value, list):
        return [renamed(inner, names) for inner in value]
    if isinstance(value, str) and len(value) < 200:
        for name, other in names.items():
            value = value.replace(name, other)
    return value


def test_no_name_breaks_the_page_or_runs_as_code(browser: Any, example: Example, tmp_path: Path) -> None:
    """Scenes, methods and labels may have any name."""
    attack = "<img src=x onerror=hacked()></script><script>hacked()</script> &amp; \"q\" 'r' ${x} {{ 7*7 }} \\u003c"
    names = {"cotton": f"c {attack}", "SPO": f"m {attack}", "asked for": f"l {attack}", "wrong_size": f"w {attack}"}
    facts = renamed(example.numbers.facts, names)
    facts["parameters"]["initial"][attack] = [{attack: attack}]
    numbers = Runs(facts, example.numbers.numbers.replace(names))
    scenes = renamed(example.scenes, names)
    page_file = tmp_path / "index.html"
    page_file.write_text(page_of(numbers, scenes), encoding="utf-8")
    with opened(browser, page_file) as page:
        show_scene(page, f"hci/{names['cotton']}")
        choose(page, b=f"external/{names['SPO']}/disparity")
        page.evaluate("document.querySelectorAll('details').forEach((d) => (d.open = true))")
        page.locator(CLOUD).scroll_into_view_if_needed()
        point_at(page, 5, 60)
        text = page.inner_text("main")
        assert text.count(names["SPO"]) > 3
        assert names["asked for"] in text
        assert names["cotton"] in text
        assert page.locator("main img[src=x]").count() == 0
        page.mouse.click(*place_of(page, WIPE, 60, 60))
        assert names["cotton"] in part(page, "asked")
        assert page.evaluate("document.documentElement.scrollWidth") <= 1400


def test_external_maps_are_told_apart(same_page: Any) -> None:
    """A cell and a line for what is wrong with a map; the rest of the report is there."""
    text = same_page.text_content("main")
    assert "7x5 instead of 64x64" in text
    assert "no file" in text
    assert same_page.locator('figure[data-key="external/SPO/disparity"] figcaption').text_content().startswith("AB")
    assert "external" in same_page.locator('figure[data-key="external/SPO/disparity"] figcaption').text_content()
    assert same_page.locator('figure[data-key="external/wrong_size/disparity"]').count() == 0


def test_a_page_without_scenes_opens(browser: Any, example: Example, tmp_path: Path) -> None:
    """Tables alone: nothing to draw, and no error."""
    page_file = tmp_path / "index.html"
    page_file.write_text(page_of(example.numbers, []), encoding="utf-8")
    told: list[str] = []
    context = browser.new_context(offline=True)
    page = context.new_page()
    page.on("pageerror", lambda error: told.append(str(error)))
    page.on("console", lambda message: told.append(message.text) if complains(message) else None)
    page.goto(page_file.as_uri())
    page.locator("#table1_mse table thead button").first.click()
    assert page.locator("#table1_mse table thead th").first.get_attribute("aria-sort") == "ascending"
    context.close()
    assert told == []


def test_what_the_page_says_without_scripts(browser: Any, example: Example) -> None:
    """Figures can be read where scripts are switched off."""
    context = browser.new_context(java_script_enabled=False, offline=True)
    page = context.new_page()
    page.goto(example.page.as_uri())
    assert page.locator("noscript p").is_visible()
    assert page.locator("#table1_mse table").first.is_visible()
    context.close()


def test_the_page_prints_the_numbers_of_the_tables(same_page: Any, example: Example) -> None:
    """Every cell of every table stands in the page as it does in the table's files."""
    best = 0
    for name in example.plan.tables:
        lines = [cells for section in table(name, example.numbers).sections for _, _, cells in section.lines]
        shown = same_page.eval_on_selector_all(
            f"#{name} tbody tr", "(rows) => rows.map((row) => [...row.cells].map((cell) => cell.textContent))"
        )
        assert shown == [[text for text, *_ in cells] for cells in lines], name
        marks = sum(mark == "best" for cells in lines for *_, mark in cells)
        assert same_page.locator(f"#{name} td .best").count() == marks
        best += marks
    assert best > 5
