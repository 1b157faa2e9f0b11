"""The commands, configurations and Python in the documents: each is run, or read by what would run it.

``sepi`` and Python run, on a small scene in place of the pages' light fields. Snakemake reads configuration and rules,
``bench`` its words. What other programs do (pip, docker, git) is theirs.
"""

from __future__ import annotations

import importlib
import json
import re
import shutil
import subprocess
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import click
import cv2
import numpy as np
import pytest
import yaml
from error_lines import done
from markdown_links import FILES, REPOSITORY, blocks, spans
from scipy.io import savemat
from small_networks import convolution
from snakemake.cli import get_argument_parser, parse_config
from workflow_copy import Workflow

from sepi.cli.main import main
from sepi.io.disparity_maps import write_pfm
from sepi.lightfield import DisparityRange, LightField
from sepi.process.command import SepiCommand
from sepi.scenes import render, write_hci
from sepi.variants import STAGES
from sepi.workflow.config import load_settings
from sepi.workflow.settings import Settings

PROGRAMS = ("sepi", "snakemake", "make", "python")
# COLMAP; the twelve scenes of a benchmark; a renderer; parts of larger pictures
NOT_RUN = {"calibrate", "submission", "check-submission", "--rendered", "--crop-of"}
SMALL = ("--size", "64", "--views", "3")
# what stands for the light fields of configurations, and for their ground truth
STAND_INS = {"path": "field", "truth": "field/gt_disp_lowres.pfm"}

# Programs are none that this Bash finds, which tells their words. Each prints a number, as `seq` does
SHELL = """exec 3>&1 >/dev/null
PATH=/nowhere
command_not_found_handle() { printf '%s\\037' "$@" $'\\036' >&3; echo 1; }
"""


def commands(text: str, folder: Path) -> list[list[str]]:
    """The words of each command of some lines for a shell, as that gives them to a program."""
    script = SHELL + text.replace(".venv/bin/", "")
    done = subprocess.run(["bash"], input=script, cwd=folder, capture_output=True, text=True, check=False)
    assert "unexpected" not in done.stderr, done.stderr
    found = [words.split("\037")[:-1] for words in done.stdout.split("\036\037")]
    # "..." means and so on
    return [[word for word in words if word != "..."] for words in found if words[:1] and words[0] in PROGRAMS]


def is_shell(text: str) -> bool:
    """Whether some of these lines call a program, at their beginning or in a loop."""
    called = rf"(?:^|; do)\s*(?:\.venv/bin/)?(?:{'|'.join(PROGRAMS)})(?: |$)"
    return re.search(called, text, re.MULTILINE) is not None


def resolved(words: list[str]) -> tuple[click.Command, list[str]] | None:
    """The command of this project that is called, and its words; None for one without such a parser."""
    command, rest = main, words[1:]
    if words[0] == "python":
        assert [word for word in words if word.endswith(".py") and not (REPOSITORY / word).exists()] == []
        if rest[:1] != ["-m"] or rest[1].partition(".")[0] not in ("sepi", "bench", "tests"):
            return None
        spec = find_spec(rest[1])
        assert spec is not None, f"no module {rest[1]}"
        module = importlib.import_module(f"{spec.name}.__main__" if spec.submodule_search_locations else spec.name)
        command, rest = getattr(module, "main", None), rest[2:]
    while isinstance(command, click.Group) and rest and re.match("[a-z]", rest[0]):
        name, *rest = rest
        command = command.get_command(click.Context(command), name)
        assert command is not None, f"no command {name}"
    if isinstance(command, SepiCommand):
        command = command.extended()
    return (command, rest) if isinstance(command, click.Command) else None


snakemake_parser = cache(get_argument_parser)


def check(words: list[str], hci: Path) -> None:
    """Fail where a command, flag, target, parameter or key of the configuration is none."""
    for stage, choice, name in re.findall(rf"(?:^|\s)({'|'.join(STAGES)})\.(\w+)\.(\w+)", " ".join(words)):
        assert name in STAGES[stage][choice].parameters.model_fields, name
    if words[0] == "make":
        made = re.findall(r"^([\w-]+):", (REPOSITORY / "Makefile").read_text(), re.MULTILINE)
        assert [word for word in words[1:] if "=" not in word and word not in made] == []
    elif words[0] == "snakemake":
        given = snakemake_parser().parse_args(words[1:])
        assert given.workflow_profile is None or (REPOSITORY / given.workflow_profile).is_dir()
        config = parse_config(given.config)
        config |= {key: str(hci) for key in config if key.endswith("_root")}
        rules, settings = read_workflow(json.dumps(config), hci.parent)
        for target in given.targets:
            settings.require_target(target)
            # in a workflow that has this one as a module, its rules have that before their names
            names = {target, target.removeprefix("sepi_")}
            assert any(rule.name in names or rule.is_producer(target) for rule in rules), target
    elif (found := resolved(words)) is not None:
        command, rest = found
        flags = {"-h", "--help", *(flag for option in command.params for flag in option.opts)}
        assert {word.partition("=")[0] for word in rest if re.match("--?[a-z]", word)} <= flags, words


@cache
def read_workflow(config: str, folder: Path) -> tuple[list[Any], Settings]:
    """The rules and settings with this configuration."""
    # nothing is computed that could be a part
    values = json.loads(config.replace('"partial": "true"', '"partial": "false"'))
    workflow = Workflow(REPOSITORY, folder / "run", values).read()
    # globals are those of the workflow that was read last
    return list(workflow.rules), workflow.globals["SETTINGS"]


@pytest.fixture(scope="session")
def hci(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a scene as large as the benchmark's, of which no pixel is looked at."""
    folder = tmp_path_factory.mktemp("planned") / "hci"
    views = np.zeros((1, 3, 512, 512, 3), np.uint8)
    write_hci(LightField(views, "cotton", disparity_range=DisparityRange(-1, 1, "given")), folder / "cotton")
    return folder


@pytest.mark.workflow
@pytest.mark.parametrize("page", FILES)
def test_commands_exist(page: str, hci: Path, tmp_path: Path) -> None:
    """A user who pastes one is told that there is no such command, flag, target or key."""
    text = FILES[page].read_text(encoding="utf-8")
    for words in (words for _, block in blocks(text) if is_shell(block) for words in commands(block, tmp_path)):
        check(words, hci)
        found = resolved(words) if words[0] in ("sepi", "python") else None
        if found is not None:
            found[0].make_context(words[0], found[1])
    # in a sentence they may lack words, or have those in brackets that may be left out
    for span in filter(is_shell, spans(text)):
        for words in commands(re.sub("[|<>()]", " ", span), tmp_path):
            check(words, hci)


@pytest.fixture(scope="session")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a light field ``field``, its maps ``maps``, and ``rig``, a workspace of COLMAP of both."""
    folder = tmp_path_factory.mktemp("made")
    write_hci(render("pyramids", size=64, views=3), folder / "field")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        done("depth", "field", "-o", "maps", "--all-views")
        done("poses", "field", "maps", "-o", "rig")
    return folder


def provide(given: dict[str, Any], made: Path, views: int) -> None:
    """Put what a command of ``sepi`` reads where it names it, if nothing is there; the flags tell the kind."""
    for name in ("light_field_path", "ground_truth", "result_path", "estimate", "a", "b", "truth"):
        path = given.get(name)
        if path is None or path.exists():
            continue
        path.parent.mkdir(parents=True, exist_ok=True)
        field = render("pyramids", size=64, views=7)
        if path.suffix == ".pfm":
            write_pfm(path, field.ground_truth)
        elif name == "truth":
            cv2.imwrite(str(path), np.clip(128 + field.ground_truth / given["truth_scale"], 1, 255).astype(np.uint8))
        elif path.suffix == ".mat":
            axes = ["TSHWC".index(axis) for axis in given["axes"]]
            savemat(path, {given["variable"] or "LF": field.views[:4, 3::-1].transpose(axes)})
        elif given.get("pattern"):
            path.mkdir()
            rows, columns = given["grid"]
            for number, view in enumerate(field.views[:rows, :columns].reshape(-1, 64, 64, 3)):
                cv2.imwrite(str(path / given["pattern"].format(number=f"{number:03d}")), view)
        elif given.get("images"):
            shutil.copytree(made / "rig/sparse/0", path)
            shutil.copytree(made / "rig/images", given["images"])
        elif name in ("light_field_path", "ground_truth"):
            write_hci(render("pyramids", size=64, views=views), path)
        else:
            shutil.copytree(made / "maps", path)
    for setting in given.get("settings", ()):
        if setting.endswith(".onnx"):
            convolution(Path(setting.partition("=")[2]), np.full((1, 9, 1, 1), 0.01))


@pytest.mark.slow
@pytest.mark.parametrize("page", FILES)
def test_commands_run(page: str, made: Path, here: Path) -> None:
    """A user who pastes one after the other gets an error; so does one who pastes the Python that follows them."""
    found = blocks(FILES[page].read_text(encoding="utf-8"))
    said = [words for _, block in found if is_shell(block) for words in commands(block, here)]
    called = [words for words in said if words[0] == "sepi" and not NOT_RUN & {*words}]
    given = [command.make_context("sepi", rest).params for command, rest in filter(None, map(resolved, called))]
    views = max((params.get("central") or 3 for params in given), default=3)
    for words, params in zip(called, given, strict=True):
        provide(params, made, views)
        done(*words[1:], *(SMALL if words[1] == "scenes" else ()))
    for language, text in found:
        # a Snakefile is highlighted as Python, too
        if language == "python" and not text.startswith("configfile:"):
            exec(compile(text, page, "exec"), {})


@pytest.mark.slow
@pytest.mark.parametrize("page", FILES)
def test_configurations_are_valid(page: str, made: Path, hci: Path) -> None:
    """A user who copies one is told that there is no such key, variant or choice."""
    for language, text in blocks(FILES[page].read_text(encoding="utf-8")):
        values = yaml.safe_load(text) if language in ("", "yaml") and re.match(r"(#.*\n)?\w+:\s", text) else {}
        # that of a workflow which has this one as a module
        values = values.get("sepi", values)
        # a rig's cameras are another file
        if "cameras" not in values:
            for entry in values.get("light_fields", {}).values():
                entry |= {key: str(made / STAND_INS[key]) for key in STAND_INS.keys() & entry}
            load_settings(values | {"hci_root": str(hci)})
