"""The workflow's configuration: the model of ``config.yaml``, and its check, which returns the rules' settings."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Collection, Mapping
from contextlib import suppress
from dataclasses import fields, replace
from importlib import import_module
from pathlib import Path
from typing import Any

from pydantic import Field, create_model

from sepi.errors import SepiError
from sepi.io.disparity_maps import SUFFIXES, TruthFile
from sepi.io.readers.formats import FORMATS
from sepi.io.readers.options import AS_GIVEN, ORDERS, ReadOptions
from sepi.io.scores import ExternalSource
from sepi.lightfield import DisparityRange
from sepi.registry import added
from sepi.scenes import SCENES
from sepi.validation import require_known
from sepi.validation.models import CheckedModel, Positive, model_of, validated
from sepi.variants import VARIANT_ENTRIES, VARIANTS, Variant, variant_from
from sepi.workflow.datasets import LONGEST_NAME, Dataset, Scene, own_scene, require_plain_path, scenes_in
from sepi.workflow.settings import Report, Settings, stage_settings

# names already in use for folders, panels and table columns, where variants have theirs too
_RESERVED = ("stages", "complete", "external", "ground_truth", "reference_view", "dataset", "scene", "row", "region")
# the built-in scenes have 9x9 views
_BUILTIN_VIEWS = 81
_RENDERER = "sepi.scenes.light_field"
_WORDS = {"true": True, "false": False, "null": None}
# keys whose values stay text even if they look like numbers
_TEXTS = ("path", "truth", "images", "reference", "pattern", "variable", "include", "exclude")


class Builtin(CheckedModel):
    """Keys of ``builtin``."""

    scenes: list[str] = Field(list(SCENES), description="built-in scenes, in the order of the tables; [] for none")
    size: int = Field(192, ge=64, le=1024, description="height and width of a view in pixels")


class Root(CheckedModel):
    """A folder of scenes, and name patterns to include and exclude."""

    path: str
    include: list[str] = Field([])
    exclude: list[str] = Field([])


class _Own(CheckedModel):
    """Keys of one of the ``light_fields``, apart from those of :class:`ReadOptions`: its path and ground truth."""

    path: str = Field(min_length=1)
    truth: str | None = Field(None, min_length=1)
    truth_scale: Positive | None = None
    format: str | None = None

    @property
    def flags(self) -> tuple[str, ...]:
        """Its reading options as flags of the command line."""
        pairs = {"grid": "x", "view": ","}
        flags: list[str] = []
        given = self.model_dump(exclude={"path", "truth", "truth_scale"}, exclude_defaults=True)
        last = [flag for view in given.pop("exclude", ()) for flag in ("--exclude", view)]
        last += ["--follow-links"] * given.pop("follow_links", False)
        for key, value in given.items():
            flags += [f"--{key.replace('_', '-')}", pairs[key].join(map(str, value)) if key in pairs else str(value)]
        return (*flags, *last)

    @property
    def own_truth(self) -> TruthFile | None:
        """The ground truth file, if given."""
        return None if self.truth is None else TruthFile(Path(self.truth).expanduser(), self.truth_scale)


OwnLightField: type[_Own] = model_of(ReadOptions, _Own)
"""Keys of one of the ``light_fields``, including the reading flags of ``sepi depth``."""


class _Config(CheckedModel):
    """Keys of ``config.yaml``, apart from those of datasets that extensions add."""

    builtin: Builtin = Field(
        Builtin(),
        description="Dataset 'builtin': light fields that the package renders itself, with exact ground truth.",
    )
    hci_root: Root | None = Field(
        None,
        description="Dataset 'hci': a folder of HCI 4D benchmark scenes; every folder in it with input_Cam*.png is a "
        "scene, also below category folders such as training/. {path: FOLDER, include: [...], exclude: [...]} takes "
        "some of them by patterns of their names, such as 'c*'. null for none.",
    )
    hci_2013_root: Root | None = Field(
        None,
        description="Dataset 'hci_2013': a folder with HDF5 files of the HCI archive of 2013 (Wanner et al.), as "
        "hci_root. null for none.",
    )
    light_fields: dict[str, dict[str, Any]] = Field(
        {},
        description="Dataset 'own': light fields of any format that 'sepi depth' reads, by names that you choose, such "
        "as {lego: {path: /data/lego, grid: [17, 17]}}. Besides path: format, "
        f"{', '.join(option.name for option in fields(ReadOptions))}, which are flags of 'sepi depth'; truth, a "
        "ground truth file, and truth_scale, pixels per view step per unit of its values "
        "(docs/reproduce/real_truth.md).",
    )
    external: dict[str, dict[str, Any]] = Field(
        {},
        description="Disparity maps of external methods, by the method's name, to be scored and shown next to ours: "
        "a folder with SCENE.pfm, .npy, .png or .h5, a file pattern such as {SPO: '/maps/{dataset}/{scene}/spo.pfm'}, "
        "or {path: ..., scale: ..., offset: ...} where disparity = value * scale + offset.",
    )
    bad_thresholds: list[Positive] = Field(
        [],
        description="Error thresholds in pixels per view step, in addition to 0.07, 0.03 and 0.01; the score is the "
        "percentage of pixels with a larger error.",
    )
    report: Report = Field(Report(), description="The report's page.")
    disparity_range: dict[str, tuple[float, float]] = Field(
        {},
        description="Disparity ranges of individual scenes in pixels per view step, such as {hci/cotton: [-1.6, 1.5]}. "
        "Other scenes use the range in their parameters.cfg, or one estimated from the views.",
    )
    variants: dict[str, dict[str, Any]] = Field(
        dict(VARIANT_ENTRIES),
        description="Each variant has a choice per stage, or {choice: CHOICE, PARAMETER: VALUE} to set parameters; "
        "with base, only its differences from that variant. 'paper' is the published method; 'paper' to "
        "'no_occlusion_no_textureless' are the columns of its table 4, 'no_noise_correction' is for noisy light "
        "fields. 'best' is the most accurate variant, 'best_...' are 'best' with one part switched off; 'oavc' to "
        "'occ' are the compared methods, 'onnx' is your own network (docs/reproduce/compared.md). Built-in variants "
        "cannot be changed; add your own after them.",
    )
    stages: dict[str, dict[str, dict[str, Any] | None] | None] = Field(
        {}, description="Parameters of each stage, by choice. Those of several choices are explained at the first."
    )


DATASETS: dict[str, type[Dataset]] = {name: import_module(module).Dataset for name, module in added("datasets").items()}
"""Key to dataset, of those that extensions add."""

Config: type[_Config] = create_model(  # type: ignore[call-overload]
    "Config",
    __base__=_Config,
    **{name: (kind, Field(kind(), description=kind.description)) for name, kind in DATASETS.items()},
)
"""Keys of ``config.yaml``."""


def load_settings(values: Mapping[str, Any]) -> Settings:
    """Check a configuration (as read from YAML) and find its scenes.

    Raises
    ------
    SepiError
        At the first wrong key, scene, variant, stage or choice; the one-line message names it and what is expected.
    """
    try:
        # a key without a value counts as absent
        given = {key: value for key, value in _with_paths(values).items() if value is not None}
        spelled = {key: _with_numbers(value) for key, value in given.items()}
    except RecursionError as error:
        raise SepiError("config: a key contains itself (through & and *), or values are nested too deeply") from error
    config = validated(Config, spelled, "config")
    entries = {**VARIANT_ENTRIES, **config.variants}
    datasets: dict[str, Dataset] = {name: getattr(config, name) for name in DATASETS}
    found = {name: dataset.found(f"config.{name}", entries) for name, dataset in datasets.items()}
    scenes = _scenes(config, [scene for name in found if not datasets[name].apart for scene in found[name]])
    scenes |= {f"{name}/{scene.name}": scene for name in found if datasets[name].apart for scene in found[name]}
    ranges = config.disparity_range
    require_known("config.disparity_range", ranges, scenes)
    for name, (minimum, maximum) in ranges.items():
        DisparityRange(minimum, maximum, f"config.disparity_range of {name}")
    _require_inside(config.report.pixels, scenes)
    variants = {name: _variant(name, entries) for name in entries}
    return Settings(
        {(one.dataset, one.name): replace(one, disparity_range=ranges.get(name)) for name, one in scenes.items()},
        variants,
        stage_settings(config.stages, variants),
        {name: _external(name, entry, variants) for name, entry in config.external.items()},
        config.report,
        {name: dataset for name, dataset in datasets.items() if dataset.apart},
        tuple(config.bad_thresholds),
    )


def _with_paths(values: Mapping[str, Any]) -> Mapping[str, Any]:
    """Entries of ``external`` and scene folders given as a bare path become ``{path: ...}``."""
    roots = {key: values[key] for key in ("hci_root", "hci_2013_root") if isinstance(values.get(key), str)}
    values = {**values, **{key: {"path": root} if root else None for key, root in roots.items()}}
    external = values.get("external")
    if not isinstance(external, Mapping):
        return values
    known = {name: {"path": entry} if isinstance(entry, str) else entry for name, entry in external.items()}
    return {**values, "external": known}


def _with_numbers(value: Any, top: bool = True) -> Any:
    """Convert text below a key to the number, true, false or null that it spells.

    Snakemake reads every value of ``--config 'builtin={size: 96}'`` as text, and YAML reads 1e-4 as text.
    """
    if isinstance(value, Mapping):
        return {key: inner if key in _TEXTS else _with_numbers(inner, False) for key, inner in value.items()}
    if isinstance(value, list):
        return [_with_numbers(inner, False) for inner in value]
    if top or not isinstance(value, str):
        return value
    if value in _WORDS:
        return _WORDS[value]
    for kind in (int, float):
        with suppress(ValueError):
            number = kind(value)
            return number if math.isfinite(number) else value
    return value


def _scenes(config: _Config, more: list[Scene]) -> dict[str, Scene]:
    """Every scene, with these more, by ``DATASET/NAME``."""
    require_known("config.builtin.scenes", config.builtin.scenes, SCENES)
    size = config.builtin.size
    drawn = Scene("", "", Path(), (), _BUILTIN_VIEWS, size, size, flags=("--set", f"size={size}"), module=_RENDERER)
    scenes = [replace(drawn, dataset="builtin", name=name, source=Path(name)) for name in config.builtin.scenes]
    for dataset, root in (("hci", config.hci_root), ("hci_2013", config.hci_2013_root)):
        if root:
            folder = Path(root.path).expanduser()
            scenes += scenes_in(folder, dataset, f"config.{dataset}_root", root.include, root.exclude)
    for name, values in config.light_fields.items():
        where = f"config.light_fields.{name}"
        own = validated(OwnLightField, values, where)
        require_known(f"{where}.order", [values.get("order", AS_GIVEN)], ORDERS)
        require_known(f"{where}.format", filter(None, [own.format]), FORMATS)
        if own.truth is None and own.truth_scale is not None:
            raise SepiError(f"{where}.truth_scale: needs a ground truth file; give truth as well")
        scenes.append(own_scene(name, Path(own.path).expanduser(), own.flags, where, own.own_truth))
    scenes += more
    if not scenes:
        raise SepiError("config: no scenes; list some in builtin.scenes or light_fields, or set hci_root")
    for scene in scenes:
        for file in (*scene.files, *scene.truth):
            require_plain_path(str(file), f"config: scene {scene.dataset}/{scene.name}")
    return {f"{scene.dataset}/{scene.name}": scene for scene in scenes}


def _variant(name: str, entries: Mapping[str, Any]) -> Variant:
    variant = variant_from(name, entries, "config.variants")
    where = f"config.variants.{name}"
    if name in VARIANTS and variant != VARIANTS[name]:
        raise SepiError(
            f"{where}: a built-in variant cannot be redefined; the entry may come from the configuration of another "
            f"version: remove it, or rename your variant"
        )
    if not name.isidentifier() or name in _RESERVED or len(name.encode()) > LONGEST_NAME:
        raise SepiError(
            f"{where}: a variant's name must be letters, digits and _, at most {LONGEST_NAME}, and none of "
            f"{', '.join(_RESERVED)}"
        )
    return variant


def _external(name: str, entry: Mapping[str, Any], variants: Collection[str]) -> ExternalSource:
    where = f"config.external.{name}"
    source = validated(ExternalSource, entry, where)
    if name in variants:
        raise SepiError(f"{where}: a variant already has this name; rename the method")
    plain = name.strip() == name != "" and "/" not in name and not name.startswith(".") and name.isprintable()
    if not plain or len(name.encode()) > LONGEST_NAME:
        raise SepiError(
            f"config.external.{name[:LONGEST_NAME]}: a method's name must be printable text without '/', not "
            f"beginning with '.', of at most {LONGEST_NAME} bytes"
        )
    require_known(f"{where}.path", re.findall(r"\{[^{}]*\}", source.path), ("{dataset}", "{scene}"))
    require_plain_path(source.path.replace("{dataset}", "").replace("{scene}", ""), f"{where}.path")
    path = Path(os.path.expanduser(source.path))
    if "{scene}" not in source.path and (
        os.path.isfile(path) or (path.suffix.lower() in SUFFIXES and not os.path.isdir(path))
    ):
        # a single file would be used as the map of every scene
        raise SepiError(f"{where}.path: '{source.path}' is a single file; give a folder, or a pattern with {{scene}}")
    if source.scale == 0:
        raise SepiError(f"{where}.scale: must not be 0")
    return source


def _require_inside(chosen: Mapping[str, list[tuple[int, int]]], scenes: Mapping[str, Scene]) -> None:
    """Check the report's pixels against the sizes of the scenes."""
    require_known("config.report.pixels", chosen, scenes)
    for name, pixels in chosen.items():
        scene = scenes[name]
        for y, x in pixels:
            if y >= scene.height or x >= scene.width:
                raise SepiError(
                    f"config.report.pixels.{name}: row {y}, column {x} lies outside the view, which has {scene.height} "
                    f"rows and {scene.width} columns, counted from 0"
                )
