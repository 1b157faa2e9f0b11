"""What is done while threads work: it must neither fail a job that does without, nor be left undone."""

import sys
import threading
from pathlib import Path

import pytest

from sepi.meanwhile import do_meanwhile, importing_meanwhile, wait_usefully


def test_modules_are_imported_meanwhile_and_what_is_wrong_with_one_is_left_to_its_user(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A library that is broken stops the stage that needs it, in its words, and no other."""
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / "sepi_sound.py").write_text("import threading\nthread = threading.current_thread().name\n")
    (tmp_path / "sepi_broken.py").write_text("raise RuntimeError('broken')\n")
    interval = sys.getswitchinterval()
    with importing_meanwhile(["sepi_sound", "sepi_broken"]):
        assert sys.getswitchinterval() < interval
    assert sys.modules.pop("sepi_sound").thread == "imports"
    assert "sepi_broken" not in sys.modules
    assert sys.getswitchinterval() == interval
    before = threading.active_count()
    with importing_meanwhile(["sys", "pathlib"]):
        assert threading.active_count() == before


def test_tasks_are_done_once_when_there_is_time() -> None:
    done = []

    def task() -> None:
        done.append(1)

    do_meanwhile(task)
    do_meanwhile(task)
    assert done == []
    wait_usefully()
    wait_usefully()
    assert done == [1]
