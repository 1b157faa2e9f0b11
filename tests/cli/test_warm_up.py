"""Kernels compiled ahead: the first run must find all of them, whatever the variant."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner

from sepi.cli import warm_up
from sepi.cli.warm_up import COMPARED, command
from sepi.compared.methods import METHODS

pytestmark = pytest.mark.slow

# every kernel with code kept on disk that was not called; those that only other kernels call are part of these
_UNCALLED = """
import importlib, pkgutil, sys
import sepi
from numba.core.caching import FunctionCache
from numba.core.registry import CPUDispatcher
from sepi.cli.warm_up import COMPARED, SHARES, compile_kernels
for share in (*SHARES, *COMPARED):
    compile_kernels(share)
for module in pkgutil.walk_packages(sepi.__path__, "sepi."):
    if module.name.rpartition(".")[2] != "__main__" and not module.name.startswith("bench"):
        importlib.import_module(module.name)
kernels = {
    id(value): (name, module, value)
    for module, found in list(sys.modules.items()) if module.startswith("sepi")
    for name, value in vars(found).items()
    if isinstance(value, CPUDispatcher) and isinstance(value._cache, FunctionCache)
}
called = {name for name, _, value in kernels.values() if value.stats.cache_hits or value.stats.cache_misses}
# what a called kernel calls is compiled into it
inside = set()
for name, _, value in kernels.values():
    inside |= set(value.py_func.__code__.co_names) - {name}
print(*sorted({name for name, _, _ in kernels.values()} - called - inside))
print(len(called))
"""


@pytest.mark.system
def test_every_kernel_is_compiled() -> None:
    """One that is left out is compiled by the first jobs that need it, several at a time."""
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])}
    done = subprocess.run(
        [sys.executable, "-c", _UNCALLED], env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    uncalled, count = done.stdout.split("\n")[:2]
    assert uncalled == ""
    assert int(count) > 20


def test_every_compared_method_is_in_a_share() -> None:
    assert {variant for share in COMPARED for variant in share} == set(METHODS)


def test_kernels_that_differ_once_loaded_are_told(monkeypatch: pytest.MonkeyPatch) -> None:
    """Else whoever runs something a second time has another map. (`make` compiles all of them with this check.)"""
    digests = iter([[{"best": "a", "fast": "b"}, {"paper": "c"}], [{"best": "a", "fast": "x"}, {"paper": "c"}]])
    monkeypatch.setattr(warm_up, "_by_processes", lambda *_: next(digests))
    result = CliRunner().invoke(command, ["--check"])
    assert result.exit_code == 1
    assert result.stderr == (
        "sepi: kernels for views of uint8: loaded from disk they make another map than just compiled, of fast\n"
    )


def test_digests_are_of_the_maps() -> None:
    """One that is of less would find nothing."""
    found = warm_up.maps_of_kernels_on_disk(("no_occlusion_no_textureless", "no_sepi"))
    assert len(set(found.values())) == 2
