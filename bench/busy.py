"""Time of stages beside another program that keeps one core busy."""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from bench.measure import Figures, Prepared
from sepi.io.hdf5 import read_light_field
from sepi.lightfield import LightField
from sepi.stage import StageMaps, no_progress
from sepi.variants import HANDED_ON, STAGES, Variant, stage_parameters, variant_named

_TURNS = 3


def stages_beside_another_program(path: Path, variant: str) -> Prepared:
    """All stages, with and without the other program in turn, with the ratio of their times."""
    light_field, chosen = read_light_field(path), variant_named(variant)
    # loads the kernels first
    _seconds(light_field, chosen)

    def call() -> Figures:
        quiet, busy = [], []
        for _ in range(_TURNS):
            quiet.append(_seconds(light_field, chosen))
            with _one_core_busy():
                busy.append(_seconds(light_field, chosen))
        return {
            name: statistics.median(one[name] for one in busy) / statistics.median(one[name] for one in quiet)
            for name in quiet[0]
        }

    return Prepared(call, lambda ratios: ratios)


def _seconds(light_field: LightField, chosen: Variant) -> dict[str, float]:
    settings, seconds = stage_parameters(chosen), {}
    maps: StageMaps | None = None
    for name, choice in chosen.choices.items():
        begun = time.perf_counter()
        maps = STAGES[name][choice].run(light_field, maps, settings[name], no_progress)
        if choice != HANDED_ON:
            seconds[name] = time.perf_counter() - begun
    return seconds


@contextmanager
def _one_core_busy() -> Iterator[None]:
    process = subprocess.Popen([sys.executable, "-c", "while True: pass"])
    try:
        if hasattr(os, "sched_setaffinity"):
            os.sched_setaffinity(process.pid, {min(os.sched_getaffinity(0))})
        yield
    finally:
        process.kill()
        process.wait()
