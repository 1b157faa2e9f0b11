"""The dataset of rendered scenes: its configuration keys and its scenes."""

from collections.abc import Collection, Sequence
from pathlib import Path
from typing import Any, Literal

from pydantic import Field, field_validator

from sepi.extensions.rendered.worlds import RENDERED
from sepi.report.plan import Plan
from sepi.validation import require_known
from sepi.variants import VARIANTS, needing_files
from sepi.workflow.datasets import Dataset as ADataset
from sepi.workflow.datasets import Scene
from sepi.workflow.rendered_scenes import DATASET, NOISE_LEVELS, WITHOUT_NOISE, RenderedScene
from sepi.workflow.result_paths import RESULTS


class Dataset(ADataset):
    """Keys of ``rendered``."""

    description = (
        "Dataset 'rendered', used only by 'snakemake rendered': path-traced scenes with exact ground truth, at several "
        "noise levels (docs/reproduce/rendered.md). Rendering needs the extra sepi[render]."
    )
    apart = True

    scenes: list[str] = Field(
        list(RENDERED), min_length=1, description="rendered scenes to use, in the order of the tables"
    )
    size: int = Field(512, ge=64, le=2048, description="height and width of a view in pixels")
    views: int = Field(9, ge=3, le=17, description="rows and columns of views")
    samples: int = Field(64, ge=1, le=4096, description="traced paths per pixel; fewer are faster but noisier")
    noise: list[str] = Field(list(NOISE_LEVELS), min_length=1, description="levels of noise, a light field each")
    seeds: int = Field(1, ge=1, le=99, description="light fields per scene and level; 2 or more show how scores vary")
    variants: list[str] | Literal["all"] | None = Field(
        None,
        description="variants to run in addition to 'paper'; null: 'best', 'fast', your own and the compared methods; "
        "all: every built-in variant that needs no file of yours",
    )

    @field_validator("noise", mode="before")
    @classmethod
    def _off_is_a_word(cls, value: Any) -> Any:
        # YAML reads a bare off as false
        return [WITHOUT_NOISE if level is False else level for level in value] if isinstance(value, list) else value

    def found(self, where: str, variants: Collection[str]) -> list[Scene]:
        """Every scene at every noise level; without noise there is only one per scene."""
        require_known(f"{where}.variants", self.variants if isinstance(self.variants, list) else (), variants)
        require_known(f"{where}.scenes", self.scenes, RENDERED)
        require_known(f"{where}.noise", self.noise, NOISE_LEVELS)
        return [
            self._scene(RenderedScene(world, noise, seed))
            for noise in dict.fromkeys(self.noise)
            for world in dict.fromkeys(self.scenes)
            for seed in range(1, 2 if noise == WITHOUT_NOISE else self.seeds + 1)
        ]

    def report(self, plan: Plan, scenes: Sequence[str]) -> Plan:
        """The plan for these scenes, with the chosen variants."""
        chosen = [name for name in VARIANTS if name not in needing_files()] if self.variants == "all" else self.variants
        return plan.rendered(scenes, [name for name, entry in RENDERED.items() if entry.for_choosing], chosen)

    def _scene(self, name: RenderedScene) -> Scene:
        file, size = render_file(name.world), self.size
        flags = ("--set", f"noise={name.noise}", "--set", f"seed={name.seed}")
        module = "sepi.extensions.rendered.exposure"
        return Scene(DATASET, name.name, file, (file,), self.views**2, size, size, flags=flags, module=module)


def render_file(world: str) -> Path:
    """The renderer's output for a scene: noise-free views and ground truth, shared by all noise levels."""
    return RESULTS / "renders" / f"{world}.h5"
