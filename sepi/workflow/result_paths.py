"""Where every file of the results lies: the patterns of the rules and the files of the report are made here alone.

A path with wildcards in place of names, ``scene_files("{dataset}", "{scene}")``, is the pattern of a rule.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from sepi.variants import HANDED_ON, STAGES

RESULTS = Path("results")
"""Folder of the results, in the folder that the workflow runs in."""

PARTS_ENDING = "_parts"
"""Ending of the files that belong to the ablation of the best variant alone."""


def render_file(world: str) -> Path:
    """What the renderer makes of a rendered scene: views without noise and ground truth, for all levels of noise."""
    return RESULTS / "renders" / f"{world}.h5"


@dataclass(frozen=True)
class SceneFiles:
    """The files of one scene.

    Attributes
    ----------
    folder : Path
        That holds them: ``results/DATASET/SCENE``.
    """

    folder: Path

    @property
    def light_field(self) -> Path:
        """The light field."""
        return self.folder / "lightfield.h5"

    @property
    def truth(self) -> Path:
        """Ground truth and masks, if there are any."""
        return self.folder / "truth.h5"

    @property
    def external(self) -> Path:
        """The maps of all external methods and their scores."""
        return self.folder / "external.h5"

    @property
    def stages(self) -> Path:
        """The folder of the stage files."""
        return self.folder / "stages"

    def stage(self, labels: Mapping[str, str], stage: str, ending: str = "h5") -> Path:
        """The file with the maps after a stage, or one beside it: ``ending`` is ``"time.json"``.

        It is that of an earlier stage where this one hands its maps on.

        Parameters
        ----------
        labels : mapping of str to str
            Stage to the label of its choice, in the order of the stages.
        stage : str
        ending : str
        """
        key = key_of(labels, stage)
        return self.stages / key / f"{stage_of(key)}.{ending}"

    def scores(self, which: str = "") -> Path:
        """The scores of the maps; ``which`` is :data:`PARTS_ENDING` or ``_REPORT`` for those of these alone."""
        return self.folder / f"scores{which}.h5"

    def variant(self, name: str) -> Path:
        """The folder of a variant's final maps."""
        return self.folder / name


def scene_files(dataset: str, scene: str, results: Path = RESULTS) -> SceneFiles:
    """The files of a scene of a dataset."""
    return SceneFiles(results / dataset / scene)


def key_of(labels: Mapping[str, str], stage: str) -> str:
    """What names the maps after a stage: the labels up to the stage that made them, ``"sepi/half_sepi/lti"``.

    Variants that begin alike share it, and a stage that hands maps on has that of the stage before. It is the folder of
    the stage file.

    Parameters
    ----------
    labels : mapping of str to str
        Stage to the label of its choice, in the order of the stages.
    stage : str
    """
    names = list(labels.values())[: list(labels).index(stage) + 1]
    while names[-1] == HANDED_ON:
        names.pop()
    return "/".join(names)


def stage_of(key: str) -> str:
    """The stage that made the maps which :func:`key_of` names."""
    return list(STAGES)[key.count("/")]
