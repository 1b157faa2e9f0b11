"""A dataset of the workflow: every such file in a folder."""

from collections.abc import Collection
from pathlib import Path

from pydantic import Field

from sepi.workflow import datasets


class Dataset(datasets.Dataset):
    """Keys of ``shots`` in the configuration."""

    description = "Dataset 'shots': files NAME.views."
    folder: str | None = Field(None, description="folder of the files; null for none")

    def found(self, where: str, variants: Collection[str]) -> list[datasets.Scene]:
        """A scene for each file."""
        files = [] if self.folder is None else sorted(Path(self.folder).glob("*.views"))
        return [datasets.Scene("shots", file.stem, file, (file,), 9, 64, 64) for file in files]
