"""The report's page as a whole in a real browser: it opens from disk, can be read by everyone, and its tables sort."""

from pathlib import Path
from typing import Any

from browser import CLOUD, WIPE, choose, opened, part, place_of, point_at, settled, show_scene
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
