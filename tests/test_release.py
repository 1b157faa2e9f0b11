"""What is published agrees with itself: version, archives, the README's examples, files for GitHub and Docker."""

import os
import re
import shutil
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from pathlib import Path
from typing import Any

import pytest
import yaml

from sepi.io.provenance import package_version
from tools import check_release

ROOT = Path(__file__).parents[1]
PROJECT: dict[str, Any] = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]


def loaded(path: Path) -> dict[Any, Any]:
    """A YAML file; ``on`` of GitHub's workflows is read as ``True``."""
    content: dict[Any, Any] = yaml.safe_load(path.read_text())
    return content


# --- version and metadata


def test_version_is_one() -> None:
    """A result, a citation and the changelog name another version than the one that is installed."""
    citation = loaded(ROOT / "CITATION.cff")
    changelog = (ROOT / "CHANGELOG.md").read_text()
    heading = re.search(r"^## (\S+) \((unreleased|\d{4}-\d\d-\d\d)\)$", changelog, flags=re.MULTILINE)
    version, day = heading.groups()
    assert {version, citation["version"], package_version()} == {PROJECT["version"]}
    assert str(citation.get("date-released", "unreleased")) == day
    assert citation["license"] == PROJECT["license"]


# --- archives


@pytest.fixture(scope="module")
def tree(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of what git knows."""
    if not (ROOT / ".git").exists():
        pytest.skip("not a checkout")
    copy = tmp_path_factory.mktemp("tree")
    for name in subprocess.check_output(["git", "ls-files", "-z"], cwd=ROOT, text=True).split("\0"):
        if (ROOT / name).is_file():
            (copy / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, copy / name)
    return copy


# of kernels, and what the type checker knows of them
BUILT = (".so", ".pyi", "built_from")


def build(tree: Path, kind: str) -> Path:
    """What is built of a copy: ``"sdist"`` or ``"wheel"``."""
    call = f"from scikit_build_core.setuptools import build_meta; build_meta.build_{kind}('out')"
    subprocess.run([sys.executable, "-c", call], cwd=tree, capture_output=True, check=True)
    (built,) = (tree / "out").glob("*.tar.gz" if kind == "sdist" else "*.whl")
    return built


def files_of(tree: Path, folder: str = ".") -> set[str]:
    """Files of a copy below a folder, without what building leaves there."""
    names = {path.relative_to(tree).as_posix() for path in (tree / folder).rglob("*") if path.is_file()}
    made = ("out/", "build/", "sepi.egg-info/")
    return {name for name in names if not name.startswith(made) and not name.endswith(BUILT)}


@pytest.mark.system
def test_source_archive_holds_all_that_git_knows(tree: Path) -> None:
    """Who unpacks it has no Snakefile, rule, test or document that a checkout has; MANIFEST.in lists them."""
    with tarfile.open(build(tree, "sdist")) as archive:
        names = {member.name.partition("/")[2] for member in archive if member.isfile()}
    made = {name for name in names if name in ("PKG-INFO", "setup.cfg") or name.startswith("sepi.egg-info/")}
    assert names - made == files_of(tree)


@pytest.mark.system
def test_wheel_holds_the_whole_package(tree: Path) -> None:
    """Installed from the index, the report has no templates or published figures: ``package-data`` lists them."""
    with zipfile.ZipFile(build(tree, "wheel")) as wheel:
        names = {name for name in wheel.namelist() if ".dist-info/" not in name}
        kernels = [wheel.read(name) for name in names if name.startswith("sepi/kernels/baseline/_native.")]
    built = {name for name in names if name.endswith(BUILT)}
    assert names - built == files_of(tree, "sepi")
    assert kernels
    # by its Clang, not by the compiler that built Python, which scikit-build-core would name
    assert "CXX" in os.environ or sys.platform != "linux" or all(re.search(rb"Clang \d+\.\d+", one) for one in kernels)


# --- the check of a release


@pytest.mark.parametrize(
    ("tag", "changelog", "told"),
    [
        ("v1.2.4", "## 1.2.3 (2026-01-31)\n", "tag v1.2.4: pyproject.toml says version 1.2.3"),
        ("1.2.3", "## 1.2.3 (2026-01-31)\n", "its tag would be v1.2.3"),
        ("v1.2.3", "## 1.2.3 (unreleased)\n", "CHANGELOG.md: no heading"),
        ("v1.2.3", "## 1.2.30 (2026-01-31)\n", "CHANGELOG.md: no heading"),
    ],
)
def test_wrong_tags_are_refused(tag: str, changelog: str, told: str) -> None:
    """A tag of a slip of the finger is published, and cannot be taken back."""
    with pytest.raises(check_release.CheckError, match=re.escape(told)):
        check_release.check_tag(tag, "1.2.3", changelog)


# --- files for GitHub, pre-commit and Docker. Their schemas are checked by `make lint`


def test_image_is_made_of_what_docker_is_given() -> None:
    """`docker build` stops at a file that is not there, or that .dockerignore keeps from it."""
    given = {line[1:] for line in (ROOT / ".dockerignore").read_text().splitlines() if line.startswith("!")}
    dockerfile = (ROOT / "Dockerfile").read_text()
    copied = " ".join(re.findall(r"^COPY (.*) \S+$", dockerfile, flags=re.MULTILINE)).split()
    needed = {name for name in copied if not name.startswith("--")} - {"."}
    needed |= set(re.findall(r"type=bind,source=([^,]+)", dockerfile))
    assert {"rules", "requirements.lock"} <= needed <= given
    assert all((ROOT / name).exists() for name in given)
    # what the wheel is built of
    assert {"pyproject.toml", "sepi", PROJECT["readme"], *PROJECT["license-files"]} <= given
