"""The detail of the views equals a plain NumPy twin."""

from dataclasses import replace

import numpy as np
import pytest

from sepi.image.noise import noise_level
from sepi.lightfield import LightField, as_unit_float
from sepi.matching.base_detail import DETAIL_UNIT, BaseDetailParameters, base_detail_decomposition
from sepi.matching.row_bands import Rows
from sepi.process.workspace import Workspace
from sepi.scenes import render


def detail_twin(view: np.ndarray, radius: int, edge: float, width: float) -> np.ndarray:
    """Mean of the channels, less its mean over a disc with weights that fall with the distance and the difference."""
    height, columns, _ = view.shape
    padded = np.pad(view, ((radius, radius), (radius, radius), (0, 0)), mode="reflect").astype(float)
    total, weights = np.zeros((2, height, columns))
    for dy in range(-radius, radius + 1):
        for dx in range(-radius, radius + 1):
            if dy**2 + dx**2 <= radius**2:
                there = padded[radius + dy :, radius + dx :][:height, :columns]
                squared = (np.abs(there - view).sum(axis=2) / edge) ** 2 / 2
                w = np.maximum(0, 1 - squared / 32) ** 32 * np.exp(-(dy**2 + dx**2) / (2 * width**2))
                total += w * there.mean(axis=2)
                weights += w
    return view.mean(axis=2) - total / weights


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32])
@pytest.mark.parametrize("channels", [1, 3])
def test_detail_equals_a_plain_twin(dtype: type, channels: int) -> None:
    """What matching sees inside surfaces is made here."""
    colours = np.random.default_rng(0).random((1, 2, 20, 37, channels), np.float32) * 0.2
    views = colours if dtype == np.float32 else np.round(colours * np.iinfo(dtype).max).astype(dtype)
    field = LightField(views, "random")
    edge = float(np.hypot(0.05, 3 * noise_level(field.reference_view)))
    found = base_detail_decomposition(field, BaseDetailParameters()).detail * DETAIL_UNIT
    for s in range(2):
        expected = detail_twin(as_unit_float(field.rgb_views[0, s]), 4, edge, 4.0)
        np.testing.assert_allclose(found[0, s], expected, atol=1.5 * DETAIL_UNIT)


def test_some_rows_of_some_views_are_those_of_the_whole() -> None:
    """In bands, as little memory takes it, every pixel has the same bytes."""
    field = render("dots", size=64)
    present = np.zeros((9, 9), bool)
    present[2, 3] = present[4, 4] = True
    whole = base_detail_decomposition(field, BaseDetailParameters()).detail
    part = base_detail_decomposition(field, BaseDetailParameters(), Rows(13, 50), present)
    assert part.low == 13
    np.testing.assert_array_equal(part.detail[present], whole[present][:, 13:50])
    assert not part.detail[~present].any()


def test_what_is_kept_of_views_changes_nothing() -> None:
    """A view's detail that was made for other views, parameters or light fields would give a wrong map."""
    first, second = (replace(render(name, size=64, views=5), masks={}) for name in ("dots", "stripes"))
    few, all_views = np.zeros((5, 5), bool), np.ones((5, 5), bool)
    few[::2, ::2] = True
    asked = [
        (field, BaseDetailParameters(use_detail=use_detail), views)
        for field in (first, second, first)
        for use_detail, views in ((True, few), (True, all_views), (False, few), (True, few))
    ]
    alone = [base_detail_decomposition(field, parameters, None, views) for field, parameters, views in asked]
    workspace = Workspace()
    for (field, parameters, views), expected in zip(asked, alone, strict=True):
        kept = replace(field, workspace=workspace)
        found = base_detail_decomposition(kept, parameters, None, views)
        np.testing.assert_array_equal(found.detail[views], expected.detail[views])
        assert found.noise == expected.noise
        # of some rows, as in bands: not kept
        band = base_detail_decomposition(kept, parameters, Rows(8, 40), views)
        np.testing.assert_array_equal(band.detail[views], expected.detail[views][:, 8:40])
