"""All stages on odd but legal light fields, and the refusal of those that hold no depth."""

import re
from dataclasses import replace

import numpy as np
import pytest
from several_threads import SEVERAL, threads

import sepi
from sepi.inspection.disparity_range import estimate_range
from sepi.lightfield import DisparityRange, LightField
from sepi.scenes import render
from sepi.variants import STAGES, VARIANTS, Variant, choice_label, choice_of, compared_methods, stage_parameters

CANDIDATES = {"initial": {"num_disparities": 21}, "occlusion": {"num_disparities": 21}}


def light_field(shape, dtype=np.uint8, low=0.0, disparities=(-1.0, 1.0), **values) -> LightField:
    views = np.random.default_rng(0).uniform(low, 1, shape)
    views = views.astype(dtype) if dtype == np.float32 else (views * np.iinfo(dtype).max).astype(dtype)
    return LightField(views, "odd", disparity_range=DisparityRange(*disparities, "given"), **values)


ODD = {
    "smallest": light_field((3, 3, 2, 2, 3)),
    "small": light_field((3, 3, 8, 8, 3)),
    "narrow": light_field((3, 3, 30, 8, 3)),
    "one row of views": light_field((1, 9, 20, 24, 3)),
    "one column of views": light_field((9, 1, 20, 24, 3)),
    "two views": light_field((1, 2, 20, 24, 3)),
    "grey": light_field((3, 3, 20, 24, 1)),
    "one colour": light_field((3, 3, 20, 24, 3), low=1.0),
    "black": LightField(np.zeros((3, 3, 20, 24, 3), np.uint8), "black", disparity_range=DisparityRange(-1, 1, "given")),
    "range far from zero": light_field((3, 3, 20, 24, 3), disparities=(3.0, 9.0)),
    "range wider than the picture": light_field((3, 3, 20, 24, 3), disparities=(-60.0, 60.0)),
    "range beyond the picture": light_field((3, 3, 20, 24, 3), disparities=(100.0, 101.0)),
    "missing views": light_field((3, 3, 20, 24, 3), present=np.array([[0, 1, 0], [1, 1, 1], [0, 0, 0]], bool)),
    "nothing but corners": light_field((3, 3, 20, 24, 3), present=np.array([[1, 0, 1], [0, 1, 0], [1, 0, 1]], bool)),
    "closer rows": light_field((3, 3, 20, 24, 3), row_spacing=0.43),
    "corner view": light_field((3, 3, 20, 24, 3), view=(0, 0)),
}


@pytest.mark.parametrize("name", ODD)
@pytest.mark.parametrize("variant", ["paper", "no_sepi", "wang", "best", "fast", *compared_methods()])
def test_odd_light_fields_get_finite_maps(name: str, variant: str) -> None:
    """Someone's light field is never quite like a benchmark's: no crash, no NaN, nothing out of bounds."""
    odd = ODD[name]
    if (name, variant) == ("nothing but corners", "no_sepi"):
        # a map of one value would look like a result
        with pytest.raises(sepi.SepiError, match="a second view in the row or the column of view 1,1"):
            sepi.estimate_depth(odd, variant)
        return
    stages = {"paper": CANDIDATES, "wang": CANDIDATES, "best": CANDIDATES, "fast": CANDIDATES, "no_sepi": ["occlusion"]}
    parameters = {stage: CANDIDATES[stage] for stage in stages.get(variant, ["initial"])}
    maps = sepi.estimate_depth(odd, variant=variant, parameters=parameters)
    known = odd.require_disparity_range()
    for values in (maps.disparity, maps.confidence):
        assert values.shape == odd.shape
        assert values.dtype == np.float32
    assert np.isfinite(maps.disparity).all()
    assert maps.disparity.min() >= known.minimum - 1e-6 * abs(known.minimum)
    assert maps.disparity.max() <= known.maximum + 1e-6 * abs(known.maximum)
    assert maps.confidence.min() >= 0
    assert maps.confidence.max() <= 1


def test_an_unknown_range_is_estimated() -> None:
    """In the Python API, too: an array of views alone is enough."""
    whole = render("pyramids", size=64, views=5)
    alone = LightField(whole.views, "alone")
    maps = sepi.estimate_depth(alone, variant="no_occlusion_no_textureless")
    known = sepi.estimate_depth(alone.with_range(estimate_range(alone)), variant="no_occlusion_no_textureless")
    np.testing.assert_array_equal(maps.disparity, known.disparity)
    assert np.median(np.abs(maps.disparity - whole.ground_truth)) < 0.1


def test_a_variant_overrides_and_the_caller_overrides_it() -> None:
    scene = render("pyramids", size=64, views=3)
    mine = Variant("structure_tensor", "none", "none", "wls", {"optimize": {"alpha": 0, "tau_2": 1}})
    found = stage_parameters(mine, {"optimize": {"alpha": 1e-5}})["optimize"]
    assert found.model_dump() == stage_parameters(VARIANTS["paper"])["optimize"].model_dump() | {
        "alpha": 1e-5,
        "tau_2": 1,
    }
    set_by_caller = sepi.estimate_depth(scene, replace(mine, overrides={}), {"optimize": {"alpha": 0, "tau_2": 1}})
    np.testing.assert_array_equal(sepi.estimate_depth(scene, mine).disparity, set_by_caller.disparity)


@pytest.mark.parametrize(
    ("overrides", "complaint"),
    [
        ({"optimise": {}}, "variant, overrides: unknown 'optimise'; did you mean 'optimize'"),
        ({"initial": {"scale": 5}}, "initial.sepi.scale: input should be less than or equal to 2, got 5"),
    ],
)
def test_a_wrong_override_is_named(overrides: dict[str, dict[str, float]], complaint: str) -> None:
    with pytest.raises(sepi.SepiError, match=complaint):
        Variant("sepi", "none", "none", "wls", overrides)


@pytest.mark.parametrize(
    ("overrides", "label"),
    [
        ({}, "wls"),
        ({"b": 0.0, "a": 12}, "wls+a=12+b=0"),
        ({"a": 1e-12, "b": 1e20}, "wls+a=1e-12+b=1e20"),
        ({"a": 0.1 + 0.2}, "wls+a=0.30000000000000004"),
        ({"a": "x/y"}, r"wls\+[0-9a-f]{12}"),
        ({"a" * 100: 1, "b" * 100: 1}, r"wls\+[0-9a-f]{12}"),
    ],
)
def test_a_label_is_a_short_folder_name(overrides: dict[str, object], label: str) -> None:
    found = choice_label("wls", overrides)
    assert found == label or re.fullmatch(label, found)
    assert choice_of(found) == "wls"
    assert found == choice_label("wls", dict(reversed(overrides.items())))


@pytest.mark.parametrize(
    ("views", "present", "complaint"),
    [
        (np.zeros((3, 3, 1, 20, 3), np.uint8), None, "at least 2x2 pixels, got 20x1"),
        (np.zeros((3, 3, 0, 20, 3), np.uint8), None, "shape"),
        (np.zeros((3, 3, 20, 20, 4), np.uint8), None, "C = 1 or 3"),
        (np.zeros((3, 3, 20, 20, 3)), None, "float32"),
        (np.zeros((3, 3, 20, 20, 3), np.uint8), np.arange(9).reshape(3, 3) == 4, "only the centre view"),
        (np.zeros((3, 3, 20, 20, 3), np.uint8), np.arange(9).reshape(3, 3) != 4, "centre view"),
    ],
)
def test_light_fields_without_depth_are_refused(views, present, complaint) -> None:
    with pytest.raises(sepi.SepiError, match=complaint):
        LightField(views, "refused", present=present)


@pytest.mark.parametrize("variant", ["fast", "wang", "paper", "no_sepi", "best", *compared_methods()])
def test_equal_maps_for_any_number_of_threads(variant: str) -> None:
    """A result made on another machine must be the same, byte for byte: cores are not part of the input."""
    whole = render("curved_occluders", size=64, views=3)
    scene = LightField(whole.views[:, :, 16:48, 16:48].copy(), "part", disparity_range=whole.disparity_range)
    maps = []
    for count in (1, SEVERAL):
        with threads(count):
            maps.append(
                sepi.estimate_depth(
                    scene, variant, {} if variant == "no_sepi" else {"initial": CANDIDATES["initial"]}
                ).all()
            )
    for name, values in maps[0].items():
        np.testing.assert_array_equal(maps[1][name], values, err_msg=name)


@pytest.mark.parametrize("variant", ["best", "paper"])
def test_progress_goes_from_nothing_to_all_once(variant: str) -> None:
    """A bar that starts anew says nothing about when the map is there."""
    told: list[float] = []
    sepi.estimate_depth(ODD["small"], variant, CANDIDATES, told.append)
    assert told == sorted(told)
    assert 0 <= told[0] <= 1 / len(STAGES)
    assert told[-1] == 1
    assert len([fraction for fraction in told if 0 < fraction < 1]) >= len(STAGES) - 1
