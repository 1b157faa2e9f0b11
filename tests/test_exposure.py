"""Views of unlike exposure: as real cameras take them, and left alone where they are alike."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
from error_lines import done

from sepi.initial import CHOICES
from sepi.io.hdf5 import read_stage, write_light_field
from sepi.lightfield import LightField
from sepi.matching.exposure import brightness_factors, equally_bright
from sepi.pipeline import estimate_depth
from sepi.process.command import stage_command
from sepi.scenes import SCENES, render
from sepi.variants import Variant

pytestmark = pytest.mark.slow


def exposed(light_field: LightField, factors: npt.NDArray[np.float64]) -> LightField:
    """Each channel of each view so many times as bright; factors (T, S, C)."""
    views = light_field.views.astype(np.float64) * factors[:, :, None, None, :]
    return replace(light_field, views=np.clip(np.rint(views), 0, 255).astype(light_field.views.dtype))


def unlike(light_field: LightField, deviation: float) -> LightField:
    """Other exposures and white balances, but for the reference view's."""
    factors = 1 + deviation * np.random.default_rng(3).standard_normal((*light_field.grid, 3))
    factors[light_field.reference_position] = 1
    return exposed(light_field, factors)


def test_views_that_are_alike_stay_as_they_are() -> None:
    """What moves into a view and out of it changes its brightness, too: taken for exposure it would do harm."""
    # the outermost views, in which most has moved, are among these
    fields = {name: LightField(render(name, size=64).views[::2, ::2], name) for name in SCENES}
    assert [name for name, field in fields.items() if equally_bright(field) is not field] == []


@pytest.mark.parametrize("dtype", [np.uint8, np.float32])
def test_exposures_are_told_and_made_equal(dtype: npt.DTypeLike) -> None:
    """Also with a view missing, and one of which a corner is."""
    whole = render("curved_occluders", size=128, views=5)
    given = unlike(whole, 0.06)
    if dtype == np.float32:
        given = replace(given, views=given.views.astype(np.float32) / np.float32(255))
    present = np.ones((5, 5), bool)
    present[0, 1] = False
    missing = np.zeros((5, 5, 128, 128), bool)
    missing[4, 4, :90, :90] = True
    # whatever stands where a view shows nothing
    given.views[missing] = given.views[missing] // 2 if dtype == np.uint8 else given.views[missing] / 2
    given = replace(given, present=present, missing=missing)
    factors, _ = brightness_factors(given)
    found, before = (factors, brightness_factors(whole)[0])
    assert (found[0, 1] == 1).all()
    # as bright as the reference view is what the scene's views are, within what moves in them
    true = 1 / (1 + 0.06 * np.random.default_rng(3).standard_normal((5, 5, 3)))
    true[2, 2] = 1
    assert np.abs(np.log(found / (true * before)))[present].max() < 0.02
    made = equally_bright(given)
    assert made.views.dtype == dtype
    levels = made.views * (255 if dtype == np.float32 else 1)
    seen = present[:, :, None, None] & ~missing
    assert np.abs(levels[seen].astype(float) - whole.views[seen]).mean() < 1.0
    assert given.views is not made.views


def test_bright_floats_stay_in_their_range() -> None:
    """A view half as bright as the reference view, but for one lamp: twice as bright, no light field may hold it."""
    light_field = render("pyramids", size=64, views=3)
    views = light_field.views.astype(np.float32) / np.float32(255)
    views[0, 0] *= 0.5
    views[0, 0, :4, :4] = 1
    made = equally_bright(replace(light_field, views=views))
    assert np.abs(made.views[0, 0, 8:].mean() / light_field.views[0, 0, 8:].mean() * 255 - 1) < 0.02
    (note,) = (note for note in made.notes if "brightness" in note)
    assert float(note.split("up to ")[1].split(" %")[0]) == pytest.approx(100, abs=5)


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_what_is_nearly_white_in_a_darker_view_becomes_white(dtype: npt.DTypeLike) -> None:
    """A lamp of 252 in a view 8 % too dark would become 16: whole numbers begin anew."""
    light_field = render("pyramids", size=64, views=3)
    white = np.iinfo(np.dtype(dtype)).max
    views = np.rint(light_field.views * (white / 255)).astype(dtype)
    views[0, 0] = np.rint(0.92 * views[0, 0])
    views[0, 0, :4, :4] = round(0.99 * white)
    made = equally_bright(replace(light_field, views=views))
    assert (made.views[0, 0, :4, :4] == white).all()


@pytest.mark.parametrize("variant", ["fast", "paper"])
def test_unlike_exposures_cost_hardly_any_accuracy(variant: str) -> None:
    """Left as they are, a twentieth more or less light from view to view makes a third of the paper's map wrong."""
    scene = render("pyramids", size=96, views=7)
    truth = scene.ground_truth
    bad = [
        float((np.abs(estimate_depth(field, variant).disparity - truth) > 0.07).mean())
        for field in (scene, unlike(scene, 0.05))
    ]
    assert bad[1] < 1.2 * bad[0] + 0.01


def test_a_stage_of_the_workflow_makes_them_equal_too(tmp_path: Path) -> None:
    """The command line and the workflow have the same maps."""
    light_field = unlike(render("pyramids", size=64, views=5), 0.05)
    write_light_field(tmp_path / "lf.h5", light_field)
    words = ["--light-field", tmp_path / "lf.h5", "--choice", "sepi", "--output", tmp_path / "initial.h5"]
    done(*words, of=stage_command("initial", CHOICES))
    expected = estimate_depth(light_field, Variant("sepi", "none", "none", "none"))
    np.testing.assert_array_equal(read_stage(tmp_path / "initial.h5").disparity, expected.disparity)
