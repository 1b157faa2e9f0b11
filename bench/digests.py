"""Checks that maps are identical, byte for byte, for any number of threads and the kernels of any processor."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from hashlib import sha256
from multiprocessing import get_context
from typing import NamedTuple

from sepi import kernels
from sepi.kernels import LEVEL

# read when a library is loaded
_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "OPENCV_FOR_THREADS_NUM")


class Condition(NamedTuple):
    """How a process computes: threads, possibly more than cores, and whether with kernels for any processor."""

    threads: int
    baseline: bool = False

    def __str__(self) -> str:
        return f"{self.threads} thread{'s' * (self.threads > 1)}{', for any processor' * self.baseline}"


def digests(condition: Condition, variants: Iterable[str], scene: str, size: int, views: int) -> dict[str, str]:
    """Digest of each variant's maps of a built-in scene, computed in a separate process."""
    with _environment(condition), ProcessPoolExecutor(1, get_context("spawn")) as process:
        return process.submit(_digests, condition.threads, tuple(variants), scene, size, views).result()


@contextmanager
def _environment(condition: Condition) -> Iterator[None]:
    before = {name: os.environ.get(name) for name in (*_THREADS, LEVEL)}
    os.environ.update(dict.fromkeys(_THREADS, str(condition.threads)))
    if condition.baseline:
        os.environ[LEVEL] = "baseline"
    try:
        yield
    finally:
        for name, value in before.items():
            os.environ.pop(name, None)
            if value is not None:
                os.environ[name] = value


def _digests(threads: int, variants: tuple[str, ...], scene: str, size: int, views: int) -> dict[str, str]:
    import cv2

    from sepi.pipeline import estimate_depth
    from sepi.scenes import render

    # not by sepi.process.threads, which is limited to the number of cores
    kernels.set_thread_count(threads)
    cv2.setNumThreads(threads)
    light_field = render(scene, size=size, views=views)
    found = {}
    for variant in variants:
        digest = sha256()
        for name, values in sorted(estimate_depth(light_field, variant).all().items()):
            digest.update(f"{name} {values.dtype} {values.shape}".encode())
            digest.update(values.tobytes())
        found[variant] = digest.hexdigest()
    return found
