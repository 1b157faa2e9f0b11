"""One tiny scene, everything that is made of it, and what a run after a fault must come to."""

import os
from hashlib import sha256
from pathlib import Path

from workflow_copy import SIZE, TINY, Workflow, copy_of_the_project, files_below

from sepi.io.files import is_temporary
from sepi.scenes import render, write_hci

# every rule but those of the report; a part of it, where the fault is the same for all
TARGET = "results/hci/box/complete"
PART = "results/hci/box/paper/result.h5"


def undisturbed_run(root: Path, target: str = TARGET) -> Workflow:
    """A run to its end."""
    write_hci(render("curved_occluders", size=SIZE, views=3), root / "scenes" / "box")
    config = TINY | {"builtin": {"scenes": []}, "hci_root": str(root / "scenes")}
    workflow = Workflow(copy_of_the_project(root / "tree"), root / "undisturbed", config)
    result = workflow.run(target)
    assert result.returncode == 0, result.stdout
    return workflow


def made(workflow: Workflow) -> dict[str, str]:
    """File to digest, of all that is made of a scene but times and what holds them."""
    folders = [workflow.folder / "results", workflow.folder / "reports" / "maps"]
    files = [path for folder in folders for path in files_below(folder) if not path.name.endswith(".time.json")]
    return {str(path.relative_to(workflow.folder)): sha256(path.read_bytes()).hexdigest() for path in files}


def healed(disturbed: Workflow, expected: dict[str, str], target: str = TARGET, told: object = None) -> None:
    """The documented way to go on, to unlock the folder and start again, makes what an undisturbed run does."""
    unlock(disturbed)
    # a run removes what a day ago was begun
    for path in filter(is_temporary, list(disturbed.folder.rglob(".*"))):
        os.utime(path, (0, 0))
    result = disturbed.run(target)
    assert result.returncode == 0, (told, result.stdout)
    made_now = made(disturbed)
    assert target in made_now
    assert made_now.items() <= expected.items(), told
    assert target == PART or len(made_now) == len(expected), told
    assert not [path for path in disturbed.folder.rglob(".*") if is_temporary(path)], told


def unlock(disturbed: Workflow) -> None:
    """Take away the lock that a killed run leaves."""
    result = disturbed.run("all", flags=("--unlock",))
    assert result.returncode == 0, result.stdout


def nothing_half_written(disturbed: Workflow, expected: dict[str, str]) -> bool:
    """Whether what a fault left under the names of an undisturbed run is whole."""
    left = {name: digest for name, digest in made(disturbed).items() if name in expected}
    return left.items() <= expected.items()
