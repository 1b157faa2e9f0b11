"""Compile the kernels for views of 8-bit colours ahead of the first run: ``python -m sepi.cli.warm_up``.

Compiled code is kept on disk, beside the package or in ``NUMBA_CACHE_DIR``, so this is done once in an environment.
Without it the first jobs of a workflow compile what they need, several of them the same at the same time. Here every
stage of enough variants runs on a tiny light field, in two processes, since one compiles one function at a time.
Kernels for 16-bit and float views are compiled when they are first needed.
"""

from __future__ import annotations

import os
import subprocess
import sys
import time

import click

from sepi.command import SepiCommand
from sepi.errors import SepiError

SHARES: tuple[tuple[str, ...], ...] = (("paper", "no_sepi", "wang"), ("best", "best_no_detail"))
"""Variants that together call every kernel; those of one share have few kernels in common with the other's."""

_SCENE, _SIZE, _VIEWS = "curved_occluders", 64, 3


def compile_kernels(variants: tuple[str, ...]) -> None:
    """Call every kernel that these variants use, and those that reading and evaluating use, as their jobs do."""
    from dataclasses import replace

    from sepi.evaluate import evaluation_of
    from sepi.inspection.disparity_range import estimate_range
    from sepi.inspection.view_order import order_warning
    from sepi.pipeline import estimate_depth
    from sepi.scenes import render

    light_field = render(_SCENE, size=_SIZE, views=_VIEWS)
    for variant in variants:
        maps = estimate_depth(light_field, variant, {})
    bare = replace(light_field, disparity_range=None, masks={})
    evaluation_of(bare, maps.disparity)
    order_warning(bare, "as-given")
    estimate_range(bare)


@click.command(name="python -m sepi.cli.warm_up", cls=SepiCommand)
@click.option(
    "--share", type=click.IntRange(0, len(SHARES) - 1), help="Compile one share of the kernels, in this process."
)
def command(share: int | None) -> None:
    """Compile the kernels, so that the first run need not."""
    if share is not None:
        compile_kernels(SHARES[share])
        return
    started = time.perf_counter()
    words = [sys.executable, "-m", "sepi.cli.warm_up", "--share"]
    # one thread each: compiling is all there is to do
    environment = os.environ | {"OMP_NUM_THREADS": "1", "NUMBA_NUM_THREADS": "1"}
    running = [subprocess.Popen([*words, str(number)], env=environment) for number in range(len(SHARES))]
    codes = [process.wait() for process in running]
    if any(codes):
        raise SepiError("the kernels could not be compiled; see above")
    click.echo(f"kernels ready after {time.perf_counter() - started:.0f} s")


if __name__ == "__main__":
    command()
