"""Faults that a user would notice, put into a copy of the project one at a time: the tests named beside each must fail.

    .venv/bin/python -m tests.mutants [WORD]...

Those of ``mutants.yaml`` whose file or words hold each WORD, or all of them: minutes to an hour. It ends with 1 where
one lives, is no longer found in its file, or its tests fail without it.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import yaml

ROOT = Path(__file__).parents[2]
# a loop that does not end is seen, too
_MOST_SECONDS = 600


class Mutant(NamedTuple):
    """A fault: ``new`` in place of ``old`` in ``file``, what a user has of it, and the tests that see it."""

    file: str
    old: str
    new: str
    breaks: str
    tests: tuple[str, ...]

    def text(self, tree: Path) -> str | None:
        """The file with the fault; None where what it replaces is not there exactly once."""
        text = (tree / self.file).read_text(encoding="utf-8")
        return text.replace(self.old, self.new) if text.count(self.old) == 1 else None


def mutants(words: list[str]) -> Iterator[Mutant]:
    """Those whose file or description holds all words."""
    for group in yaml.safe_load(Path(__file__).with_name("mutants.yaml").read_text(encoding="utf-8")):
        for values in group["mutants"]:
            mutant = Mutant(**values, tests=tuple(group["tests"].split()))
            if all(word in f"{mutant.file} {mutant.breaks}" for word in words):
                yield mutant


def copy_to(tree: Path) -> None:
    """Copy what git knows or would, and the built kernels."""
    words = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    names = subprocess.run(words, cwd=ROOT, stdout=subprocess.PIPE, check=True).stdout.decode().split("\0")[:-1]
    built = [*ROOT.glob("sepi/kernels/*/*.so"), ROOT / "sepi/kernels/built_from"]
    kernels = [str(path.relative_to(ROOT)) for path in built]
    for name in filter(lambda name: (ROOT / name).is_file(), names + kernels):
        (tree / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy2(ROOT / name, tree / name)


def build(tree: Path) -> None:
    """Build the kernels of a tree from its own sources: seconds, after the first time."""
    subprocess.run([sys.executable, "sepi/kernels/checkout.py", "build"], cwd=tree, check=True)


def failing(tree: Path, tests: tuple[str, ...]) -> bool:
    """Whether one of these tests fails in a tree."""
    # processes that tests start import the copy, too
    environment = {**os.environ, "PYTHONPATH": str(tree)}
    command = [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider", *tests]
    try:
        done = subprocess.run(command, cwd=tree, env=environment, capture_output=True, text=True, timeout=_MOST_SECONDS)
    except subprocess.TimeoutExpired:
        return True
    if done.returncode not in (0, 1, 2):
        raise SystemExit(f"{' '.join(command)}\n{done.stdout}{done.stderr}")
    return done.returncode != 0


def main(words: list[str]) -> int:
    """Tell of each mutant whether its tests see it; 1 where one of them does not, else 0."""
    chosen = list(mutants(words))
    missed = 0
    sound: set[tuple[str, ...]] = set()
    with tempfile.TemporaryDirectory(prefix="sepi-mutants-") as folder:
        tree = Path(folder).resolve() / "sepi"
        copy_to(tree)
        for mutant in chosen:
            if mutant.tests not in sound and failing(tree, mutant.tests):
                raise SystemExit(f"{' '.join(mutant.tests)}: fails without any fault")
            sound.add(mutant.tests)
            text = mutant.text(tree)
            if text is None:
                state = "absent"
            else:
                compiled = mutant.file.endswith(("cpp", "hpp"))
                (tree / mutant.file).write_text(text, encoding="utf-8")
                if compiled:
                    build(tree)
                state = "caught" if failing(tree, mutant.tests) else "lives"
                (tree / mutant.file).write_text((ROOT / mutant.file).read_text(encoding="utf-8"), encoding="utf-8")
                if compiled:
                    build(tree)
            missed += state != "caught"
            print(f"{state}: {mutant.file}: {mutant.breaks}", flush=True)
    print(f"{len(chosen) - missed} of {len(chosen)} caught")
    return min(missed, 1)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
