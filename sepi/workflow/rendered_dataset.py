"""The dataset of rendered scenes: its configuration keys and its scenes."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import Field, field_validator

from sepi.models import CheckedModel
from sepi.rendered.catalogue import NOISE_LEVELS, RENDERED, WITHOUT_NOISE
from sepi.validation import require_known
from sepi.workflow.datasets import Scene
from sepi.workflow.rendered_scenes import DATASET, RenderedScene
from sepi.workflow.result_paths import render_file


class Rendered(CheckedModel):
    """Keys of ``rendered``."""

    scenes: list[str] = Field(list(RENDERED), description="rendered scenes to use, in the order of the tables")
    size: int = Field(512, ge=64, le=2048, description="height and width of a view in pixels")
    views: int = Field(9, ge=3, le=17, description="rows and columns of views")
    samples: int = Field(64, ge=1, le=4096, description="traced paths per pixel; fewer are faster but noisier")
    noise: list[str] = Field(
        list(NOISE_LEVELS),
        min_length=1,
        description="camera noise levels; each gives one light field per scene",
    )
    seeds: int = Field(
        1, ge=1, le=99, description="light fields per scene and noise level; from 2 on, tables show how scores vary"
    )
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

    def found(self, where: str) -> dict[str, Scene]:
        """Every scene at every noise level, by ``rendered/NAME``; without noise there is only one per scene.

        Raises
        ------
        SepiError
            If a scene or level does not exist; ``where`` is the key in the message.
        """
        require_known(f"{where}.scenes", self.scenes, RENDERED)
        require_known(f"{where}.noise", self.noise, NOISE_LEVELS)
        names = [
            RenderedScene(world, noise, seed)
            for noise in dict.fromkeys(self.noise)
            for world in dict.fromkeys(self.scenes)
            for seed in range(1, 2 if noise == WITHOUT_NOISE else self.seeds + 1)
        ]
        return {f"{DATASET}/{name.name}": self.scene(name) for name in names}

    def scene(self, name: RenderedScene) -> Scene:
        """A rendered scene as a scene of the workflow."""
        file = render_file(name.world)
        flags = ("--noise", name.noise, "--seed", str(name.seed))
        return Scene(DATASET, name.name, file, (file,), self.views**2, self.size, self.size, flags=flags)
