"""Compile the kernels for views of 8-bit colours ahead of the first run: ``python -m sepi.cli.warm_up``.

Compiled code is kept on disk, beside the package or in ``NUMBA_CACHE_DIR``, so this is done once in an environment.
Without it the first jobs of a workflow compile what they need, several of them the same at the same time. Here every
stage of enough variants runs on a tiny light field, in two processes, since one compiles one function at a time.
Kernels for 16-bit, float and grey views are compiled when they are first needed, or with ``--all-types``; those of the
compared methods with ``--comparison``. ``--check`` looks whether what was just compiled computes what it computes once
it is loaded from disk: else two machines would never agree.
"""

from __future__ import annotations

import hashlib
import time
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from typing import TYPE_CHECKING

import click
import numpy as np

from sepi.command import SepiCommand
from sepi.errors import SepiError
from sepi.kernel_cache import tell_kernel_cache
from sepi.threads import available_cores, use_threads

if TYPE_CHECKING:
    from collections.abc import Callable

    from sepi.lightfield import LightField
    from sepi.stage import StageMaps

SHARES: tuple[tuple[str, ...], ...] = (("paper", "no_sepi", "wang"), ("best", "best_no_detail"))
"""Variants that together call every kernel; those of one share have few kernels in common with the other's."""

COMPARED: tuple[tuple[str, ...], ...] = (("acc", "mishiba", "oavc", "pobr"), ("cae", "occ", "spo"))
"""The compared methods, whose kernels are compiled only when asked for: `snakemake all` runs none of them."""

GREY = "grey "
"""Before a type: of one channel, which kernels read as three at the same place."""

TYPES = ("uint16", "float32", *(GREY + kind for kind in ("uint8", "uint16", "float32")))
"""What views may be but 8-bit colours."""

_SCENE, _SIZE, _VIEWS = "curved_occluders", 64, 3


def compile_kernels(variants: tuple[str, ...], kind: str = "uint8") -> dict[str, str]:
    """Call every kernel that these variants use, and those that reading and evaluating use, as their jobs do.

    ``kind`` is the type of the views, one of uint8 and :data:`TYPES`. Returns variant to a digest of its maps.
    """
    from dataclasses import replace

    from sepi.applications.all_views import estimate_all_views
    from sepi.applications.refocusing import all_in_focus, refocus
    from sepi.built_in_variants import DEFAULT_VARIANT
    from sepi.evaluate import evaluation_of
    from sepi.inspection.disparity_range import estimate_range
    from sepi.inspection.view_order import check_order
    from sepi.pipeline import estimate_depth

    # one thread: compiling is all there is to do
    use_threads(1)
    light_field = _light_field(kind)
    digests = {}
    for variant in variants:
        maps = estimate_depth(light_field, variant, {})
        digests[variant] = _digest(maps)
    bare = replace(light_field, disparity_range=None, masks={})
    evaluation_of(bare, maps.disparity)
    check_order(bare)
    estimate_range(bare)
    if DEFAULT_VARIANT in variants:
        _denoise(light_field)
        _look()
        _share_light(light_field)
        estimate_all_views(light_field, maps)
        all_in_focus(light_field, maps)
        refocus(light_field, 0.0, maps)
    return digests


def maps_of_kernels_on_disk(variants: tuple[str, ...], kind: str = "uint8") -> dict[str, str]:
    """Variant to a digest of its maps, on as many threads as there are."""
    from sepi.pipeline import estimate_depth

    use_threads(available_cores())
    light_field = _light_field(kind)
    return {variant: _digest(estimate_depth(light_field, variant, {})) for variant in variants}


def _digest(maps: StageMaps) -> str:
    return hashlib.sha256(b"".join(values.tobytes() for values in maps.all().values())).hexdigest()


def _light_field(kind: str) -> LightField:
    from sepi.scenes import render

    return _of_type(render(_SCENE, size=_SIZE, views=_VIEWS), kind)


def _look() -> None:
    """Call what a scene takes that is seen by a camera of any pose."""
    from sepi.camera import Camera
    from sepi.rig import Lens, Shot
    from sepi.scenes import render_shot

    shot = Shot("", Lens(8, 8, (8.0, 8.0), (3.5, 3.5)), np.eye(3), np.zeros(3))
    render_shot(_SCENE, shot, camera=Camera(4.0, 4.0, 8.0), size=_SIZE)


def _of_type(light_field: LightField, kind: str) -> LightField:
    """The same views as numbers of another type, or as grey ones."""
    from dataclasses import replace

    from sepi.lightfield import as_unit_float, full_scale

    if kind.startswith(GREY):
        light_field, kind = replace(light_field, views=light_field.views[..., :1].copy()), kind.removeprefix(GREY)
    if light_field.views.dtype == kind:
        return light_field
    return replace(light_field, views=(as_unit_float(light_field.views) * full_scale(np.dtype(kind))).astype(kind))


def _denoise(light_field: LightField) -> None:
    """Call what noisy views need: the scene has none."""
    from dataclasses import replace

    from sepi.matching.base_detail import BaseDetailParameters, detail_of
    from sepi.matching.denoising import denoised
    from sepi.matching.row_bands import Rows

    noise = np.random.default_rng(0).integers(0, 64, light_field.views.shape, np.uint8)
    noisy = _of_type(replace(light_field, views=noise), str(light_field.views.dtype))
    denoised(noisy, 1.0)
    detail_of(noisy.reference_view, BaseDetailParameters(), 1.0, Rows(0, noisy.shape[0]))


def _share_light(light_field: LightField) -> None:
    """Call what rendering calls of views together, of what rays meet, and of what is painted."""
    from sepi.rendered.first_kernels import first_met
    from sepi.rendered.masks import seen_bits
    from sepi.rendered.paint_kernels import painted
    from sepi.rendered.shared_light import with_shared_light

    rows, columns = light_field.grid
    flat = np.zeros((rows * columns, *light_field.shape), np.float32)
    grey, stands = np.ones((*flat.shape, 3), np.float32), light_field.baselines.reshape(-1, 2)
    with_shared_light(grey, grey, flat, flat.astype(np.int16), flat == 0, stands)
    seen_bits(flat, stands)
    # one triangle, of one texel
    none, number = np.zeros(0, np.int32), np.zeros(1, np.int64)
    space, plane = np.zeros((1, 3)), np.zeros((1, 2))
    texels = np.zeros((1, 3), np.int64), np.zeros((1, 3), np.float32)
    painted(none, np.zeros((0, 2), np.int64), np.zeros(5), space, space, plane, np.zeros((1, 2, 3)), number, *texels, 1)
    first_met(np.zeros((1, 3, 3)), np.zeros(3), np.eye(3), np.ones(3), 1, 0.1)


@click.command(name="python -m sepi.cli.warm_up", cls=SepiCommand)
@click.option("--comparison", is_flag=True, help="Those of the compared methods, too.")
@click.option("--all-types", is_flag=True, help="Those for 16-bit, float and grey views, too.")
@click.option("--check", is_flag=True, help="Look whether they compute the same once they are loaded from disk.")
def command(comparison: bool, all_types: bool, check: bool) -> None:
    """Compile the kernels, so that the first run need not."""
    started = time.perf_counter()
    tell_kernel_cache()
    work = [(share, "uint8") for share in ((*SHARES, *COMPARED) if comparison else SHARES)]
    # a process for each type, which all of its kernels have in common
    work += [(sum(SHARES, ()), kind) for kind in TYPES] if all_types else []
    compiled = _by_processes(compile_kernels, work)
    if check:
        for (_, kind), before, after in zip(work, compiled, _by_processes(maps_of_kernels_on_disk, work), strict=True):
            unlike = [variant for variant in before if before[variant] != after[variant]]
            if unlike:
                raise SepiError(
                    f"kernels for views of {kind}: loaded from disk they make another map than just compiled, of "
                    f"{', '.join(unlike)}"
                )
    click.echo(f"kernels ready after {time.perf_counter() - started:.0f} s")


def _by_processes(
    function: Callable[[tuple[str, ...], str], dict[str, str]], work: list[tuple[tuple[str, ...], str]]
) -> list[dict[str, str]]:
    with ProcessPoolExecutor(len(SHARES), get_context("spawn")) as processes:
        # taken from the iterator, so that an error in a process is one here
        return list(processes.map(function, *zip(*work, strict=True)))


if __name__ == "__main__":
    command()
