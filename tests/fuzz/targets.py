"""The readers of all that a user hands in, by name: what they begin with, and how they are called."""

from collections.abc import Callable, Iterable
from pathlib import Path

import rigs
import seed_files as seeds
import texts
from executions import Target
from mutations import MAT, PNG

from sepi.errors import SepiError
from sepi.extensions.benchmark.hci_submission import problems_of
from sepi.io.disparity_maps import TruthFile, is_disparity, read_disparity, read_error_bars
from sepi.io.hdf5 import read_light_field as read_own
from sepi.io.hdf5 import read_stage
from sepi.io.images import picture_header, png_texts, read_picture
from sepi.io.provenance import history_of, read_origin
from sepi.io.readers.formats import format_of, read, size_of
from sepi.io.readers.options import ReadOptions
from sepi.io.result_folder import read_result
from sepi.io.scores import read_evaluations, read_external, read_scores
from sepi.reading import read_light_field
from sepi.report.runs import read_numbers


def _each(*reads: Callable[[Path], object]) -> Callable[[Path], object]:
    """Every one of several readers of a file, also where another refuses it; the first refusal is raised."""

    def read_all(path: Path) -> None:
        refused = []
        for one in reads:
            try:
                one(path)
            except SepiError as error:
                refused.append(error)
        if refused:
            raise refused[0]

    return read_all


def _light_field(path: Path) -> None:
    """A light field as ``sepi depth`` reads it, but for what it finds out from the pixels."""
    # of damaged files it must give some size, since the workflow plans with them, too
    size_of([path])
    format_of(path)
    read(path, ReadOptions())


def _picture(path: Path) -> None:
    png_texts(path)
    picture_header(path)
    read_picture(path)


def _map(path: Path) -> None:
    is_disparity(path)
    read_disparity(path)
    read_disparity(path, scale=-0.5, offset=1)


def _map_with_scale(path: Path) -> None:
    read_disparity(path, scale=1e300, offset=-1e300)


def _truth(path: Path) -> None:
    TruthFile(path, 0.1).read()
    assert TruthFile(path, 0.1).step in (0, 0.1)


def _submission(path: Path) -> None:
    for problem in problems_of(path, partial=True):
        assert problem.isprintable(), problem


def _pictures_of(seed: Callable[[Path], Iterable[bytes]], ending: str) -> Target:
    return Target(f"a.{ending}", seed, _picture)


def _hdf5(seed: Callable[[Path], Iterable[bytes]], *reads: Callable[[Path], object], name: str = "a.h5") -> Target:
    return Target(name, seed, _each(*reads))


TARGETS: dict[str, Target] = {
    "png": Target("a.png", seeds.png_files, _picture, wrappings=PNG),
    "jpeg": _pictures_of(seeds.jpeg_files, "jpg"),
    "tiff": _pictures_of(seeds.tiff_files, "tif"),
    "tiff-stack": Target("a.tif", seeds.tiff_stack_files, _light_field),
    "exr": _pictures_of(seeds.exr_files, "exr"),
    "bmp": _pictures_of(seeds.bmp_files, "bmp"),
    "webp": _pictures_of(seeds.webp_files, "webp"),
    "pnm": _pictures_of(seeds.pnm_files, "pgm"),
    "pfm": Target("a.pfm", seeds.pfm_files, _each(_map, _map_with_scale, _truth)),
    "map-npy": Target("a.npy", seeds.npy_map_files, _each(_map, _map_with_scale, _truth)),
    "map-png": Target("a.png", texts.map_png_files, _each(_map, _map_with_scale, _truth), wrappings=PNG),
    "map-tiff": Target("a.tif", seeds.tiff_map_files, _each(_map, _map_with_scale, _truth)),
    "map-hdf5": _hdf5(seeds.hdf5_map_files, _map, read_error_bars),
    "hci-parameters": Target("parameters.cfg", texts.parameter_files, texts.read_parent, seeds.hci_pictures),
    "hci-mask": Target("mask_occluded.png", seeds.mask_files, texts.read_parent, seeds.hci_folder, wrappings=PNG),
    "hci-truth": Target("gt_disp_lowres.pfm", seeds.pfm_files, texts.read_parent, seeds.hci_folder),
    "exported": Target("light_field.json", seeds.manifest_files, texts.read_parent, seeds.exported_pictures),
    "hci-2013": _hdf5(seeds.hci_2013_files, _light_field),
    "openlf": _hdf5(seeds.open_lf_files, _light_field),
    "hdf5": _hdf5(seeds.hdf5_array_files, _light_field),
    "mat-5": Target("a.mat", seeds.mat_5_files, _light_field, wrappings=MAT),
    "mat-7.3": _hdf5(seeds.mat_7_3_files, _light_field, name="a.mat"),
    "npy": Target("a.npy", seeds.npy_files, _light_field),
    "npz": Target("a.npz", seeds.npz_files, _light_field, wrappings=(seeds.NPZ,)),
    "eslf": Target("a_eslf.png", texts.lenslet_files, _light_field, wrappings=PNG),
    "looked-at": Target("a.npy", texts.larger_npy_files, read_light_field),
    "own-light-field": _hdf5(seeds.own_light_field_files, read_own, _light_field),
    "stage": _hdf5(seeds.stage_files, read_stage, history_of, read_origin),
    "result": _hdf5(seeds.result_files, read_result, read_origin, read_error_bars, _map),
    "scores": _hdf5(seeds.score_files, read_evaluations, read_scores),
    "external-maps": _hdf5(seeds.external_files, read_external, lambda path: read_external(path, with_maps=False)),
    "submission": Target("a.zip", seeds.submission_files, _submission, wrappings=(seeds.SUBMISSION,)),
    "runtime": Target("runtime.txt", texts.runtime_files, texts.read_runtime),
    "json": Target("a.json", seeds.json_files, read_numbers),
    "json-flags": Target("a.json", seeds.json_files, texts.read_json_flags, names_path=False),
    "names-of-views": Target("names.txt", texts.name_files, texts.read_names, texts.one_picture),
    "pattern": Target("pattern.txt", texts.pattern_files, texts.read_pattern, names_path=False),
    "config": Target("config.yaml", texts.config_files, texts.read_config, texts.config_folder, names_path=False),
    "flags": Target("flags.txt", texts.flag_files, texts.read_flags, texts.flag_folder, names_path=False),
    "cameras-yaml": Target("cameras.yaml", rigs.table_files, texts.read_parent, rigs.pictures),
    "cameras-csv": Target("cameras.csv", rigs.csv_files, texts.read_parent, rigs.pictures),
    "transforms": Target("transforms.json", rigs.transforms_files, texts.read_parent, rigs.pictures),
    "colmap-images": Target("images.txt", rigs.images_files, texts.read_parent, rigs.rest_of_model),
    "settings": Target("settings.txt", texts.setting_files, texts.read_settings, names_path=False),
}
"""Name to target."""
