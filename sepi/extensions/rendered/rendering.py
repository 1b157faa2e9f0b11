"""Rendering of a path-traced scene, view by view; a later run continues an interrupted one."""

import hashlib
import json
import math
import pickle
import shutil
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from typing import Annotated, Any
from zipfile import is_zipfile

import numpy as np
import numpy.typing as npt
from pydantic import Field

from sepi.extensions.rendered.render_file import Render, seen_bits, surface_bits, write_render
from sepi.extensions.rendered.sampling import pictured, planned, with_shared_light
from sepi.extensions.rendered.shapes import Points
from sepi.extensions.rendered.tracing import Tracer
from sepi.extensions.rendered.world import FloatArray, Rig, Share, World
from sepi.io.files import atomic_path, write_whole
from sepi.io.provenance import package_version
from sepi.process.threads import threads_used, use_threads
from sepi.stage import Progress, no_progress
from sepi.validation.models import CheckedModel, Positive

Arrays = dict[str, npt.NDArray[Any]]
_Rows = Annotated[int, Field(ge=1, le=33)]


class RenderOptions(CheckedModel):
    """Options of rendering."""

    size: int = Field(512, ge=32, le=4096, description="height and width of a view in pixels; disparities stay")
    grid: tuple[_Rows, _Rows] = Field((9, 9), description="rows and columns of views")
    samples: int = Field(64, ge=1, le=65536, description="paths of light for each pixel; few leave their own noise")
    baseline: Positive = Field(1.0, description="distance of views, and so disparity, as part of the scene's own")
    lens: Share = Field(0.0, description="radius in view steps; a point of disparity d is 2 lens |d| pixels wide")
    position_error: Share = Field(0.0, description="standard deviation of positions but the reference's, view steps")
    rotation_error: Share = Field(0.0, description="standard deviation of these views' turns about each axis, degrees")
    seed: int = Field(0, ge=0, lt=2**31, description="of the light's paths and of these errors")

    @property
    def shares_light(self) -> bool:
        """Whether views share the light of matte surfaces, which needs sharp views without turns."""
        return not (self.lens or self.rotation_error)


def made_by(name: str, options: RenderOptions) -> dict[str, Any]:
    """Record of the options and versions of a render, for its file."""
    return {"scene": name, "version": package_version(), **options.model_dump(mode="json")}


def render_world(name: str, world: World, options: RenderOptions, path: Path, progress: Progress = no_progress) -> None:
    """Render a world into a file.

    Parameters
    ----------
    name : str
        Name of the scene.
    world : World
        That of a scene of the catalogue, or your own.
    options : RenderOptions
    path : Path
        HDF5 file to write (:mod:`sepi.extensions.rendered.render_file`). Finished views lie in a folder beside it until
        all are finished; a later run with the same scene and options uses them.
    progress : callable, optional
        Called with the fraction done.

    Raises
    ------
    SepiError
        If the files cannot be written.
    """
    rig = Rig(world, options.size, options.grid, options.baseline)
    count = math.prod(options.grid)
    # the folder of finished views
    parts = path.with_name(f"{path.name}.parts")
    digest = hashlib.sha256(pickle.dumps(world)).hexdigest()
    record, note = json.dumps({**made_by(name, options), "world": digest}, sort_keys=True), parts / "made_by.json"
    if not (note.is_file() and note.read_text(encoding="utf-8") == record):
        shutil.rmtree(parts, ignore_errors=True)
        write_whole(note, record)
    files = [parts / f"view_{number:03d}.npz" for number in range(count)]
    # those that are not there, or cut off
    missing = [number for number, file in enumerate(files) if not is_zipfile(file)]
    for done, (number, values) in enumerate(_views(world, rig, options, missing), count - len(missing) + 1):
        with atomic_path(files[number]) as temporary, temporary.open("wb") as stream:
            np.savez(stream, allow_pickle=False, **values)
        progress(done / (count + 1))
    write_render(path, _assembled(name, world, rig, options, files))
    shutil.rmtree(parts)
    progress(1.0)


def _views(world: World, rig: Rig, options: RenderOptions, numbers: Sequence[int]) -> Iterator[tuple[int, Arrays]]:
    """Picture and ground truth of each of these views.

    A thread prepares the next view while the renderer works, since the preparation uses one core only.
    """
    if not numbers:
        return
    tracer = Tracer(world, rig, options.lens * rig.baseline)
    with ThreadPoolExecutor(1, initializer=use_threads, initargs=(threads_used(),)) as beside:
        coming = beside.submit(_looked_at, tracer, options, numbers[0])
        for number, following in zip(numbers, [*numbers[1:], None], strict=True):
            truth, picture = coming.result()
            if following is not None:
                coming = beside.submit(_looked_at, tracer, options, following)
            yield number, {**truth, "views": picture()}


def _looked_at(tracer: Tracer, options: RenderOptions, number: int) -> tuple[Arrays, Callable[[], FloatArray]]:
    """Ground truth of a view by name, and what makes its picture."""
    (down, across), turn = (values[number].tolist() for values in _stand(tracer.rig, options))
    # one seed per view, far from others: a view's tiles use several in a row
    seed = int(np.random.SeedSequence([options.seed, number]).generate_state(1)[0])
    at = tracer.position(down, across, turn)
    seen = tracer.surfaces.first(at)
    disparity = tracer.rig.disparity(seen.depth).astype(np.float32)
    straight = tracer.surfaces.first(tracer.position(down, across)) if any(turn) else seen
    truth: Arrays = {"disparity": disparity, "normal": seen.normal.astype(np.float16)}
    truth["masks"] = surface_bits(tracer.world.things, seen, disparity)
    # occlusion masks need a view without a turn
    truth["upright"] = tracer.rig.disparity(straight.depth).astype(np.float32)
    if not options.shares_light:
        return truth, partial(tracer.picture, at, seed, options.samples)
    passes, albedo, whole = planned(tracer, at, seen, options.samples, seed)
    truth |= {"albedo": albedo, "things": seen.thing.astype(np.int16), "whole": whole}
    return truth, partial(pictured, passes, options.size)


def _stand(rig: Rig, options: RenderOptions) -> tuple[Points, Points]:
    """Positions ``(N, 2)`` and turns ``(N, 3)`` of the views; those of the reference view are exact."""
    rng, (rows, columns) = np.random.default_rng(options.seed), rig.grid
    shift, turns = rng.standard_normal((rows * columns, 2)), rng.standard_normal((rows * columns, 3))
    for values in (shift, turns):
        values[rows // 2 * columns + columns // 2] = 0
    stand = np.array(list(np.ndindex(rows, columns)), float) - (rows // 2, columns // 2)
    return stand + options.position_error * shift, np.radians(options.rotation_error) * turns


def _assembled(name: str, world: World, rig: Rig, options: RenderOptions, files: Sequence[Path]) -> Render:
    """The render of all views, with their occlusion masks."""
    loaded: list[Arrays] = []
    for file in files:
        with np.load(file) as values:
            loaded.append(dict(values))
    views: Arrays = {part: np.stack([one.pop(part) for one in loaded]) for part in tuple(loaded[0])}
    upright, (positions, turns) = views.pop("upright"), _stand(rig, options)
    if options.shares_light:
        albedo, things, whole = (views.pop(part) for part in ("albedo", "things", "whole"))
        views["views"] = with_shared_light(views["views"], albedo, things, whole, upright, positions)
    # the limit of half precision lies far beyond white
    views["views"] = np.minimum(views["views"], 60000.0).astype(np.float16)
    # unknown for turned views
    straight = ~turns.any(axis=1)
    views["masks"][straight] |= seen_bits(upright, positions)[straight]
    views |= {"positions": positions, "turns": turns}
    arrays = {part: values.reshape(*options.grid, *values.shape[1:]) for part, values in views.items()}
    return Render(name, settings=rig.settings, light=world.light.share, made_by=made_by(name, options), **arrays)
