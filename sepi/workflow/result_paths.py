"""Paths of all result files; the rules' patterns and the report's files are defined only here.

With wildcards instead of names, as in ``scene_files("{dataset}", "{scene}")``, a path is a rule's pattern.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from sepi.variants import HANDED_ON, STAGES

RESULTS = Path("results")
"""Folder of the results, relative to the workflow's working directory."""


class SceneFiles:
    """The files of one scene.

    Attributes
    ----------
    folder : Path
        ``results/DATASET/SCENE``.
    light_field : Path
        The light field.
    truth : Path
        Ground truth and masks, if available.
    external : Path
        The maps of all external methods and their scores.
    stages : Path
        The folder of the stage files.
    """

    def __init__(self, folder: Path) -> None:
        self.folder, self.stages = folder, folder / "stages"
        files = (folder / f"{name}.h5" for name in ("lightfield", "truth", "external"))
        self.light_field, self.truth, self.external = files

    def stage(self, labels: Mapping[str, str], stage: str, ending: str = "h5") -> Path:
        """The file with the maps after a stage, or with another ``ending`` its companion, such as ``"time.json"``.

        If the stage passes its maps on unchanged, it is the file of the earlier stage.

        Parameters
        ----------
        labels : mapping of str to str
            Stage to the label of its choice, in the order of the stages.
        stage : str
        ending : str
        """
        key = key_of(labels, stage)
        return self.stages / key / f"{list(STAGES)[key.count('/')]}.{ending}"

    def scores(self, which: str = "") -> Path:
        """The scores of the maps; with ``which``, those of the report ``_REPORT`` alone."""
        return self.folder / f"scores{which}.h5"

    def variant(self, name: str) -> Path:
        """The folder of a variant's final maps."""
        return self.folder / name


def scene_files(dataset: str, scene: str, results: Path = RESULTS) -> SceneFiles:
    """The files of a scene of a dataset."""
    return SceneFiles(results / dataset / scene)


def key_of(labels: Mapping[str, str], stage: str) -> str:
    """Key of the maps after a stage: the labels up to the stage that made them, such as ``"sepi/half_sepi/lti"``.

    Variants with the same first stages share it; a stage that passes its maps on has the previous stage's key. It is
    the folder of the stage file.

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
