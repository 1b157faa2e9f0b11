"""A learned method's network: who has one gets its map, whatever order and range its inputs have."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from onnx import helper
from small_networks import convolution, network

from sepi.errors import SepiError
from sepi.lightfield import LightField
from sepi.pipeline import estimate_depth
from sepi.scenes import render
from sepi.variants import Variant

SIZE, VIEWS = 64, 3


@pytest.fixture(scope="module")
def light_field() -> LightField:
    return render("slanted_plane", size=SIZE, views=VIEWS)


def estimated(light_field: LightField, path: Path | None, **parameters: Any) -> Any:
    """The map of a network, as a user's variant gives it."""
    own = {"model": None if path is None else str(path), **parameters}
    variant = Variant("onnx", "none", "none", "none", {"initial": own})
    return estimate_depth(light_field, variant).disparity


def unit(light_field: LightField) -> Any:
    return light_field.rgb_views.astype(np.float32) / 255


def test_the_axes_of_all_views_are_as_written(tmp_path: Path, light_field: LightField) -> None:
    """Views in another order than a network learned give a map that looks right and is not."""
    kernel = np.arange(VIEWS * VIEWS * 3).reshape(1, -1, 1, 1)
    made = estimated(light_field, convolution(tmp_path / "net.onnx", kernel), inputs=("all: 1 (t s c) y x",))
    expected = np.einsum("tsyxc,tsc->yx", unit(light_field), kernel.reshape(VIEWS, VIEWS, 3))
    np.testing.assert_allclose(made, expected, rtol=1e-5)


def test_colours_disparity_and_order_are_turned_as_asked(tmp_path: Path, light_field: LightField) -> None:
    """A network for 0..255 and far-is-positive gives nonsense for 0..1 and near-is-positive."""
    kernel = np.arange(9).reshape(1, 9, 1, 1)
    path = convolution(tmp_path / "net.onnx", kernel)
    made = estimated(
        light_field, path, inputs=("all: 1 (s t) y x",), grey=True, scale=255.0, offset=-10.0, reversed=("t",),
        disparity_scale=-0.5, disparity_offset=2.0,
    )  # fmt: skip
    grey = unit(light_field) @ np.array([0.299, 0.587, 0.114], np.float32) * 255 - 10
    expected = 2 - 0.5 * np.einsum("tsyx,st->yx", grey[::-1], kernel.reshape(3, 3))
    np.testing.assert_allclose(made, expected, rtol=1e-4)


@pytest.mark.parametrize(
    ("inputs", "parts"),
    [
        (("row: 1 s y x",), lambda v: [v[1]]),
        (("column: 1 t y x",), lambda v: [v[:, 1]]),
        (("diagonal: 1 t y x", "antidiagonal: 1 t y x"), lambda v: [v[[0, 1, 2], [0, 1, 2]], v[[0, 1, 2], [2, 1, 0]]]),
        (("each: 1 1 y x",), lambda v: list(v.reshape(9, 1, SIZE, SIZE))),
    ],
)
def test_an_input_takes_its_views(
    tmp_path: Path, light_field: LightField, inputs: tuple[str, ...], parts: Callable[[Any], list[Any]]
) -> None:
    """Networks with streams for rows, columns and diagonals, or an input for each view, see what they learned on."""
    grey = unit(light_field) @ np.array([0.299, 0.587, 0.114], np.float32)
    expected = parts(grey)
    names = [f"in{n}" for n in range(len(expected))]
    kernels = [(f"k{n}", np.arange(1 + n, 1 + n + len(part), dtype=np.float32)) for n, part in enumerate(expected)]
    nodes = [helper.make_node("Conv", [name, f"k{n}"], [f"o{n}"]) for n, name in enumerate(names)]
    nodes.append(helper.make_node("Sum", [f"o{n}" for n in range(len(names))], ["out"]))
    weights = [(name, kernel.reshape(1, -1, 1, 1)) for name, kernel in kernels]
    path = network(tmp_path / "net.onnx", [(name, ["b", "c", "y", "x"]) for name in names], nodes, weights)
    made = estimated(light_field, path, inputs=inputs, grey=True)
    total = sum(np.tensordot(kernel, part, 1) for (_, kernel), part in zip(kernels, expected, strict=True))
    np.testing.assert_allclose(made, total, rtol=1e-5)


def test_a_row_goes_through_the_reference_view(tmp_path: Path, light_field: LightField) -> None:
    """Another reference view has another row, and the map is of that view."""
    path = convolution(tmp_path / "net.onnx", np.array([1, 2, 4]).reshape(1, 3, 1, 1))
    made = estimated(light_field.seen_from((2, 0)), path, inputs=("row: 1 s y x",), grey=True)
    grey = unit(light_field) @ np.array([0.299, 0.587, 0.114], np.float32)
    np.testing.assert_allclose(made, np.tensordot([1.0, 2, 4], grey[2], 1), rtol=1e-5)


@pytest.mark.parametrize("tile", [None, 16, 29, 80])
def test_pieces_make_the_same_map(tmp_path: Path, light_field: LightField, tile: int | None) -> None:
    """A picture that does not fit goes through in tiles without a seam, and one without padding cuts no border."""
    kernel = np.random.default_rng(0).random((1, 27, 5, 3)).astype(np.float32)
    kernel = np.concatenate([kernel, np.zeros((1, 27, 5, 2), np.float32)], axis=3)
    path = convolution(tmp_path / "net.onnx", kernel)
    made = estimated(light_field, path, margin=2, tile=tile, overlap=2)
    padded = np.pad(unit(light_field), [(0, 0), (0, 0), (2, 2), (2, 2), (0, 0)], mode="edge")
    stack = padded.transpose(0, 1, 4, 2, 3).reshape(27, SIZE + 4, SIZE + 4)
    windows = np.lib.stride_tricks.sliding_window_view(stack, (5, 5), axis=(1, 2))
    np.testing.assert_allclose(made, np.einsum("cyxij,cij->yx", windows, kernel[0]), rtol=1e-4)


def test_the_views_round_the_reference_view_are_taken(tmp_path: Path) -> None:
    """A network for 3x3 views, a light field of 5x5."""
    wide = render("slanted_plane", size=SIZE, views=5)
    path = convolution(tmp_path / "net.onnx", np.ones((1, 27, 1, 1)))
    made = estimated(wide, path, grid=(3, 3))
    np.testing.assert_allclose(made, unit(wide)[1:4, 1:4].sum(axis=(0, 1, 4)), rtol=1e-5)


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"inputs": ("all: 1 (t s) y x",)}, r"'all: 1 \(t s\) y x' does not fit views with .*'c': 3"),
        ({"inputs": ("all: 1 (t s c) y x", "row: 1 (s c) y x")}, "has 1 inputs .*describes 2"),
        ({"grid": (5, 5)}, "3x3 views; .* takes 5x5 round view 1,1"),
        ({"margin": 1}, r"output 'out' of shape \(1, 1, 66, 66\).*expected 64x64 .*margin is 1"),
        ({"inputs": ("row: 1 (s c) y x",)}, r"does not take views \(1, 9, 64, 64\)"),
        ({"output": "depth"}, "does not take views"),
    ],
)
def test_what_does_not_fit_is_told(
    tmp_path: Path, light_field: LightField, parameters: dict[str, Any], message: str
) -> None:
    path = convolution(tmp_path / "net.onnx", np.ones((1, 27, 1, 1)), (1, 27, "y", "x"))
    with pytest.raises(SepiError, match=message) as told:
        estimated(light_field, path, **parameters)
    assert "\n" not in str(told.value)


def test_a_wrong_file_or_none_is_told_in_one_line(tmp_path: Path, light_field: LightField) -> None:
    (tmp_path / "text.onnx").write_text("no network")
    with pytest.raises(SepiError, match=r"text\.onnx: not a network"):
        estimated(light_field, tmp_path / "text.onnx")
    with pytest.raises(SepiError, match=r"absent\.onnx: no such file"):
        estimated(light_field, tmp_path / "absent.onnx")
    with pytest.raises(SepiError, match=r"initial\.onnx\.model: .*ONNX file"):
        estimated(light_field, None)


def test_missing_views_are_told(tmp_path: Path, light_field: LightField) -> None:
    present = np.ones((VIEWS, VIEWS), bool)
    present[0, 0] = False
    path = convolution(tmp_path / "net.onnx", np.ones((1, 27, 1, 1)))
    with pytest.raises(SepiError, match="some are missing"):
        estimated(replace(light_field, present=present), path)
