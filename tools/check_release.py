"""Install what was built as a user would, and use it as the README says.

``python tools/check_release.py dist`` takes the one wheel and the one source archive in a folder; ``make release``
builds and calls it. For every Python found that the package allows: a fresh environment with the wheel alone, in
which the README's first commands and its example in Python must run, far from the checkout. Then the workflow,
unpacked from the source archive, makes a map by the newest of these. Needs ``uv`` beside the interpreter.
"""

from __future__ import annotations

import argparse
import os
import re
import shlex
import shutil
import subprocess
import sys
import tarfile
import time
import tomllib
from collections.abc import Sequence
from pathlib import Path

from packaging.specifiers import SpecifierSet

ROOT = Path(__file__).parents[1]
WORK = ROOT / "build" / "release"
# a small map from the unpacked archive
WORKFLOW = ("snakemake", "--cores", "1", "--", "results/builtin/dots/fast/disparity.pfm")


class CheckError(Exception):
    """What is wrong with the release, in words for who makes it; any function here may raise it."""


def project() -> dict[str, str]:
    """The table ``project`` of pyproject.toml."""
    table: dict[str, str] = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    return table


def check_tag(tag: str, version: str, changelog: str) -> None:
    """Refuse (`CheckError`) a tag that is not this version's, and a version that the changelog calls unreleased."""
    if tag != f"v{version}":
        raise CheckError(f"tag {tag}: pyproject.toml says version {version}; its tag would be v{version}")
    if not re.search(rf"^## {re.escape(version)} \(\d{{4}}-\d\d-\d\d\)$", changelog, flags=re.MULTILINE):
        raise CheckError(f"CHANGELOG.md: no heading '## {version} (YYYY-MM-DD)', the day of the release")


def readme_commands(readme: str) -> list[list[str]]:
    """The commands of the README's first block that calls ``sepi`` alone, without their comments."""
    found = re.search(r"(?:^    sepi .*\n)+", readme, flags=re.MULTILINE)
    if found is None:
        raise CheckError("README.md: no indented block of commands that begin with `sepi`")
    return [shlex.split(line, comments=True) for line in found[0].splitlines()]


def readme_example(readme: str) -> str:
    """The README's example in Python."""
    found = re.search(r"```python\n(.*?)```", readme, flags=re.DOTALL)
    if found is None:
        raise CheckError("README.md: no block of Python")
    return found[1]


def version_of(python: Path) -> str | None:
    """Version of an interpreter, ``"3.12.1"``; None if it does not run, as those that stand for others may not."""
    told = [str(python), "-c", "import platform; print(platform.python_version())"]
    try:
        return subprocess.check_output(told, stderr=subprocess.DEVNULL, text=True, timeout=60).strip()
    except (OSError, subprocess.SubprocessError):
        return None


def find_pythons(allowed: SpecifierSet) -> dict[str, Path]:
    """The first interpreter found of each allowed Python, oldest first: on the path, and those of pyenv.

    Parameters
    ----------
    allowed : SpecifierSet
        What ``requires-python`` says.

    Returns
    -------
    dict of str to Path
        ``{"3.11": Path("/usr/bin/python3.11")}``
    """
    folders = [Path(folder) for folder in os.get_exec_path()]
    pyenv = Path(os.environ.get("PYENV_ROOT", Path.home() / ".pyenv"))
    folders += sorted(pyenv.glob("versions/*/bin"))
    found: dict[str, Path] = {}
    for python in (path for folder in folders for path in sorted(folder.glob("python3.*"))):
        name = python.name.removeprefix("python")
        if re.fullmatch(r"3\.\d+", name) and name not in found:
            version = version_of(python)
            if version is not None and allowed.contains(version):
                found[name] = python
    return dict(sorted(found.items(), key=lambda item: int(item[0].split(".")[1])))


def run(command: Sequence[str | Path], folder: Path, environment: Path | None = None) -> str:
    """Run a command of an environment in a folder, without anything of the caller's Python; what it printed.

    Raises
    ------
    CheckError
        If it fails, with all that it said.
    """
    around = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
    path = [folder / "bin" for folder in (environment, Path(sys.prefix)) if folder is not None]
    around |= {"PATH": os.pathsep.join([*map(str, path), around["PATH"]]), "PYTHONNOUSERSITE": "1"}
    words = [str(word) for word in command]
    program = shutil.which(words[0], path=around["PATH"])
    if program is None:
        raise CheckError(f"{words[0]}: no such command in {environment or 'the environment of this script'}")
    start = time.monotonic()
    done = subprocess.run(
        [program, *words[1:]], cwd=folder, env=around, text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT
    )
    shown = shlex.join(words).splitlines()[0]
    if done.returncode:
        raise CheckError(f"{shown}: exit code {done.returncode}\n{done.stdout}")
    print(f"  {time.monotonic() - start:6.1f} s  {shown}", flush=True)
    return done.stdout


def check_wheel(wheel: Path, python: Path, environment: Path) -> None:
    """Install a wheel in a fresh environment and do there what the README shows."""
    folder = environment.with_name(f"{environment.name}-use")
    folder.mkdir(parents=True)
    run(["uv", "venv", "--quiet", "--python", python, environment], folder)
    run(["uv", "pip", "install", "--quiet", "--python", environment, wheel], folder)
    run(["uv", "pip", "check", "--python", environment], folder)
    home = run(["python", "-c", "import sepi; print(sepi.__version__, sepi.__file__)"], folder, environment)
    version, _, file = home.strip().partition(" ")
    if version != project()["version"] or not Path(file).is_relative_to(environment):
        raise CheckError(f"{wheel.name}: {python} imports version {version} from {file}")
    readme = (ROOT / "README.md").read_text()
    for command in readme_commands(readme):
        run(command, folder, environment)
    print(run(["python", "-c", readme_example(readme)], folder, environment).strip())


def check_source(archive: Path, environment: Path) -> None:
    """Plan all, and make a map, by the workflow as the source archive holds it."""
    folder = WORK / "source"
    with tarfile.open(archive) as opened:
        opened.extractall(folder, filter="data")
    (tree,) = folder.iterdir()
    run(["snakemake", "--dry-run", "--quiet", "--", "all"], tree, environment)
    run(WORKFLOW, tree, environment)


def check_folder(folder: Path) -> list[str]:
    """Check the wheel and the source archive in a folder; the versions of Python on which that was done.

    Raises
    ------
    CheckError
        If something is wrong, or there is nothing to check or to check it with.
    """
    built = [path for ending in ("*.whl", "*.tar.gz") for path in folder.resolve().glob(ending)]
    if [path.suffix for path in built] != [".whl", ".gz"]:
        raise CheckError(f"{folder}: holds not one wheel and one source archive; `make dist` makes them")
    pythons = find_pythons(SpecifierSet(project()["requires-python"]))
    if not pythons:
        raise CheckError(f"no Python {project()['requires-python']} on the path, nor of pyenv")
    wheel, archive = built
    shutil.rmtree(WORK, ignore_errors=True)
    for name, python in pythons.items():
        print(f"{wheel.name} on Python {name}, {python}", flush=True)
        check_wheel(wheel, python, WORK / name)
    print(f"{archive.name} on Python {name}", flush=True)
    check_source(archive, WORK / name)
    return list(pythons)


def main() -> None:
    """Check what a folder holds, and end with a sentence for what is wrong."""
    parser = argparse.ArgumentParser(description="install what was built as a user would, and use it")
    parser.add_argument("folder", type=Path, help="folder of the wheel and the source archive")
    parser.add_argument("--tag", help="tag that is about to be published, such as v0.1.0")
    arguments = parser.parse_args()
    try:
        if arguments.tag:
            check_tag(arguments.tag, project()["version"], (ROOT / "CHANGELOG.md").read_text())
        pythons = check_folder(arguments.folder)
    except CheckError as error:
        sys.exit(f"check_release: {error}")
    print(f"sound on Python {', '.join(pythons)}")


if __name__ == "__main__":
    main()
