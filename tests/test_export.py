"""The workflow's final maps: those of the command, with what no view knows marked."""

from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from error_lines import done

from sepi import export
from sepi.io.hdf5 import read_light_field, read_stage, write_light_field, write_stage
from sepi.io.provenance import stage_attributes
from sepi.lightfield import DisparityRange, LightField
from sepi.stage import entry, no_progress
from sepi.variants import STAGES, stage_parameters, variant_named


@pytest.fixture
def light_field(tmp_path: Path) -> Path:
    """A textured disc before black, one pixel per step."""
    y, x = np.mgrid[:48, :56]
    disc = (y - 24) ** 2 + (x - 26) ** 2 < 15**2
    colours = np.random.default_rng(0).integers(60, 256, (48, 56, 3), np.uint8) * disc[..., None].astype(np.uint8)
    views = np.stack([[np.roll(colours, (1 - t, 1 - s), (0, 1)) for s in range(3)] for t in range(3)])
    path = tmp_path / "disc.h5"
    write_light_field(path, LightField(views, "disc", "made", disparity_range=DisparityRange(0, 2, "given")))
    return path


@pytest.mark.parametrize("variant", ["best", "paper", "no_occlusion_no_textureless"])
def test_workflow_and_command_write_the_same_bytes(light_field: Path, tmp_path: Path, variant: str) -> None:
    """Whoever goes from one to the other gets the same maps, the same unknown pixels, and the same provenance."""
    called = done("depth", light_field, "-o", tmp_path / "a", "--variant", variant)
    assert "% of the pixels" in called.stdout
    assert "candidates" in called.stdout
    scene, maps, steps = read_light_field(light_field), None, []
    settings = stage_parameters(variant_named(variant))
    for stage, choice in variant_named(variant).choices.items():
        maps = STAGES[stage][choice].run(scene, maps, settings[stage], no_progress)
        if choice != "none":
            steps.append(entry(stage, choice, settings[stage], scene))
    last = tmp_path / "last.h5"
    write_stage(last, maps, stage_attributes(scene, steps))
    assert "unknown" not in read_stage(last).extra
    flags = {"--light-field": light_field, "--maps": last, "--variant": variant, "--output": tmp_path / "b"}
    # Snakemake removes what the rule names, but not what an earlier run wrote beside it
    (tmp_path / "b").mkdir()
    for name in ("mask_of_an_earlier_run.png", "depth.pfm"):
        (tmp_path / "b" / name).write_text("old")
    exported = CliRunner().invoke(export.main, [str(word) for pair in flags.items() for word in pair])
    assert exported.exit_code == 0, exported.output
    by_command, by_workflow = (
        {path.name: path.read_bytes() for path in (tmp_path / name).iterdir()} for name in ("a", "b")
    )
    assert by_command == by_workflow
    result = read_stage(tmp_path / "b" / "result.h5")
    unknown = result.mask("unknown")
    assert 0.5 < unknown.mean() < 0.9
    assert not result.confidence[unknown].any()
    np.testing.assert_array_equal(result.disparity, maps.disparity)
