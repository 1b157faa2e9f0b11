"""The point cloud of the report's page in a real browser: it draws, and turns by keyboard, mouse and touch."""

from typing import Any

import numpy as np
import pytest
from browser import CLOUD, canvas_pixels, changed_pixels, part, settled
from page_example import SIZE


def cloud_at(page: Any) -> None:
    """The point cloud in sight and drawn."""
    page.locator(CLOUD).scroll_into_view_if_needed()
    page.wait_for_selector(f"{CLOUD}[data-points]")
    settled(page)


def angles(page: Any) -> list[float]:
    return [float(angle) for angle in page.get_attribute(CLOUD, "data-angles").split()]


def drawn_share(pixels: Any) -> float:
    """Share of a canvas that points cover."""
    return float((pixels[:, :, 3] == 255).mean())


def test_the_point_cloud_draws(page: Any) -> None:
    """In colours of the view, of disparity, and of another map."""
    cloud_at(page)
    assert int(page.get_attribute(CLOUD, "data-points")) > 0.9 * SIZE * SIZE
    seen = canvas_pixels(page, CLOUD)
    assert 0.05 < drawn_share(seen) < 0.95
    assert len(np.unique(seen.reshape(-1, 4), axis=0)) > 100
    assert "metric" in part(page, "cloud-note")
    page.select_option('[data-part="cloud-colours"]', "disparity")
    two = changed_pixels(page, CLOUD, seen)
    assert (seen[:, :, 3] == two[:, :, 3]).all()
    page.select_option('[data-part="cloud-map"]', "external/SPO/disparity")
    assert (changed_pixels(page, CLOUD, two)[:, :, 3] != two[:, :, 3]).any()
    assert int(page.get_attribute(CLOUD, "data-points")) < SIZE * SIZE - 20, "unknown pixels have no point"


@pytest.mark.parametrize("camera", [None, {"scale": 30, "offset": 5, "focal": 40, "from_centre": [0, 0]}])
def test_the_point_cloud_is_upright_and_not_mirrored(same_page: Any, camera: dict[str, Any] | None) -> None:
    """Seen from the front it is the picture: each quarter has its colour; and what is nearer is nearer to the eye."""
    quarters = same_page.evaluate(
        """(camera) => {
          const [width, height, side] = [40, 40, 100];
          const colours = Uint32Array.from({ length: 1600 }, (_, i) => 1 + (i % 40 < 20 ? 0 : 1) + (i < 800 ? 0 : 2));
          const scene = { width, height, stride: 1, camera };
          const drawn = (disparity) => {
            const pixels = new Uint32Array(side * side);
            const cloud = Sepi.points(scene, Float32Array.from({ length: 1600 }, disparity), colours);
            Sepi.splat(cloud, pixels, side, side, [0, 0], 0.6);
            return [...pixels].map((pixel) => pixel & 0xff);
          };
          // flat; then the left half nearer
          return [drawn(() => 1), drawn((_, i) => (i % 40 < 20 ? 2 : -2))];
        }""",
        camera,
    )
    flat, stepped = (np.array(found).reshape(100, 100) for found in quarters)
    assert [flat[y, x] for y in (40, 60) for x in (40, 60)] == [1, 2, 3, 4]
    near, far = (np.isin(stepped, colours).any(axis=1).sum() for colours in ([1, 3], [2, 4]))
    # in a relief all have one size; of two metric surfaces that fill as many pixels, the nearer is smaller
    assert near > 1.2 * far if camera is None else far > 1.2 * near


def test_near_points_hide_far_ones(same_page: Any) -> None:
    """The depth buffer: of two points on one place, the nearer is seen, whichever comes first."""
    for order in ([0, 1], [1, 0]):
        colours = [0x0000FF, 0x00FF00]
        found = same_page.evaluate(
            """([z, colours]) => {
              const pixels = new Uint32Array(400);
              const positions = Float32Array.of(0, 0, z[0], 0, 0, z[1]);
              Sepi.splat({ positions, colours: Uint32Array.from(colours), n: 2 }, pixels, 20, 20, [0, 0], 1);
              return pixels[10 * 20 + 10];
            }""",
            [[0.5 * place for place in order], [colours[place] for place in order]],
        )
        assert found == 0xFF0000FF


def test_the_point_cloud_turns_by_keyboard_and_mouse(page: Any) -> None:
    cloud_at(page)
    page.locator(CLOUD).focus()
    start, before = angles(page), canvas_pixels(page, CLOUD)
    page.keyboard.press("ArrowRight")
    page.keyboard.press("ArrowDown")
    settled(page)
    assert (angles(page)[0] > start[0], angles(page)[1] > start[1]) == (True, True)
    assert (canvas_pixels(page, CLOUD) != before).any()
    page.click('[data-part="cloud-reset"]')
    settled(page)
    assert (canvas_pixels(page, CLOUD) == before).all()
    box = page.locator(CLOUD).bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 90, y + 30, steps=4)
    page.mouse.up()
    settled(page)
    assert angles(page) == pytest.approx([start[0] + 0.6, start[1] + 0.2], abs=0.03)
    page.mouse.move(x, y)
    assert angles(page) == pytest.approx([start[0] + 0.6, start[1] + 0.2], abs=0.03), "turns without a button"
