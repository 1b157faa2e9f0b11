"""Look for files that readers stumble over, led by which code each file reaches: ``python tests/fuzz/guided.py``.

Each target runs in a process of its own, which may hang or crash: libFuzzer keeps the file, and is started again for
the time that is left. Files that reached something new are kept in ``build/fuzz/corpus``, for the next run to
begin with; what readers must not do, with the file that made them do so, in ``build/fuzz/findings``.
"""

import argparse
import importlib
import importlib.util
import json
import os
import random
import re
import shutil
import subprocess
import sys
import time
from dataclasses import dataclass, field
from hashlib import sha256
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]

# what is seen of the package from the beginning, and libraries in Python that parse
_SEEN = ("sepi.io", "sepi.inspection", "sepi.cli", "sepi.workflow", "sepi.reading")
_PARSERS = ("PIL.PngImagePlugin", "PIL.JpegImagePlugin", "PIL.BmpImagePlugin", "tifffile")
# part of the new files that libFuzzer makes by its own changes
_ITS_OWN = 0.5
# MB that the process of a target may hold: what it begins with, and what an execution may take
_MEMORY_MB = 3000
# seconds that a target's process takes to begin, and to end after its time
_GRACE = 60
# executions that end a process: each of them costs its start
_MOST_ENDS = 40


@dataclass
class Tally:
    """What came of a target."""

    executions: int = 0
    seconds: float = 0.0
    findings: dict[str, str] = field(default_factory=dict)


def main() -> int:
    """Run the targets one after the other, and print a table; the exit code is 1 where there is a finding."""
    parser = argparse.ArgumentParser(description="Look for files that readers stumble over.")
    parser.add_argument("targets", nargs="*", help="which of the targets; all unless given")
    parser.add_argument("--seconds", type=float, default=3600, help="for all of them together")
    parser.add_argument("--folder", type=Path, default=ROOT / "build" / "fuzz", help="of corpora and findings")
    parser.add_argument("--child", action="store_true", help=argparse.SUPPRESS)
    chosen = parser.parse_args()
    if importlib.util.find_spec("atheris") is None:
        sys.exit("guided.py: Atheris is not installed; pip install -e '.[fuzz]' (Python 3.11 to 3.13, Linux or macOS)")
    if chosen.child:
        _fuzz(chosen.targets[0], chosen.folder, chosen.seconds)
        return 0
    # known before Atheris has seen the package being imported: the names alone are used here
    from targets import TARGETS

    unknown = [name for name in chosen.targets if name not in TARGETS]
    if unknown:
        sys.exit(f"guided.py: no target '{unknown[0]}'; known: {', '.join(TARGETS)}")
    names = chosen.targets or list(TARGETS)
    tallies = {}
    for name in names:
        tallies[name] = _run(name, TARGETS[name].file, chosen.folder, chosen.seconds / len(names))
        print(_line(name, tallies[name]), flush=True)
    print("\n" + _table(tallies))
    return int(any(tally.findings for tally in tallies.values()))


def _run(name: str, file: str, folder: Path, seconds: float) -> Tally:
    """Let a target that reads ``file`` run, again and again where one ends its process."""
    tally, began = Tally(), time.monotonic()
    for _ in range(_MOST_ENDS):
        left = seconds - (time.monotonic() - began)
        if left < 1 and tally.executions:
            break
        flags = ["--child", f"--seconds={max(left, 1):.0f}", f"--folder={folder}"]
        before = set((folder / "findings").glob(f"{name}-*"))
        try:
            ended = subprocess.run(
                [sys.executable, __file__, *flags, name],
                capture_output=True,
                text=True,
                errors="replace",
                timeout=max(left, 1) + _GRACE,
                check=False,
            )
        except subprocess.TimeoutExpired:
            # not even by libFuzzer's own clock
            _add(tally, folder, name)
            kept = shutil.copy(_room(folder, name) / file, folder / "findings" / f"{name}-hang")
            tally.findings[str(kept)] = f"did not end {_stack(folder / f'{name}.stack')}"
            continue
        _add(tally, folder, name)
        if ended.returncode:
            if not tally.executions:
                sys.exit(f"guided.py: {name} does not begin: {ended.stderr[-2000:]}")
            where = _stack(folder / f"{name}.stack")
            for path in sorted(set((folder / "findings").glob(f"{name}-*")) - before):
                tally.findings.setdefault(str(path), f"ended the process {where}")
    tally.seconds = time.monotonic() - began
    return tally


def _room(folder: Path, name: str) -> Path:
    """Where a target reads its files: after a process was killed, the one that it hung on is there."""
    return folder / "rooms" / name


def _add(tally: Tally, folder: Path, name: str) -> None:
    """Take over what a process noted."""
    notes = folder / f"{name}.json"
    if notes.is_file():
        noted = json.loads(notes.read_text(encoding="utf-8"))
        tally.executions += noted["executions"]
        tally.findings |= noted["findings"]
        notes.unlink()


def _stack(path: Path) -> str:
    """The innermost lines of Python at which a process ended."""
    lines = re.findall(r'File "([^"]+)", line (\d+)', path.read_text(errors="replace")) if path.is_file() else []
    return "at " + " < ".join(f"{Path(file).name}:{line}" for file, line in lines[:4]) if lines else ""


def _fuzz(name: str, folder: Path, seconds: float) -> None:
    """Run one target until its time is over, or a file ends this process."""
    import faulthandler

    import atheris

    modules = [_module(path) for path in ROOT.glob("sepi/**/*.py")]
    with atheris.instrument_imports(include=["sepi", *_PARSERS]):
        # what would be imported when it is called for
        for module in (*(module for module in modules if module.startswith(_SEEN)), *_PARSERS):
            importlib.import_module(module)
        from executions import MOST_BYTES, SECONDS, FindingError, Trial
        from mutations import mutated
        from targets import TARGETS

    target = TARGETS[name]
    corpus, findings = folder / "corpus" / name, folder / "findings"
    for path in (corpus, findings):
        path.mkdir(parents=True, exist_ok=True)
    first = target.first()
    for seed in first:
        (corpus / sha256(seed).hexdigest()[:16]).write_bytes(seed)
    room = _room(folder, name)
    shutil.rmtree(room, ignore_errors=True)
    room.mkdir(parents=True)
    with (folder / f"{name}.stack").open("w") as stack:
        trial = Trial(target, room)
        tally, noted = Tally(), time.monotonic()

        def note() -> None:
            values = {"executions": tally.executions, "findings": tally.findings}
            (folder / f"{name}.json").write_text(json.dumps(values), encoding="utf-8")

        def execute(data: bytes) -> None:
            nonlocal noted
            if tally.executions == 0 or time.monotonic() - noted > 1:
                note()
                noted = time.monotonic()
            tally.executions += 1
            # a little before libFuzzer ends the process: where it hangs
            faulthandler.dump_traceback_later(SECONDS, file=stack)
            try:
                trial.run(data)
            except FindingError as finding:
                key = re.sub(r"\W+", "-", finding.key)
                path = findings / f"{name}-{key}"
                if str(path) not in tally.findings:
                    path.write_bytes(data)
                    tally.findings[str(path)] = str(finding)[:300]
                    note()
            faulthandler.cancel_dump_traceback_later()

        def change(data: bytes, most: int, seed: int) -> bytes:
            rng = random.Random(seed)
            if rng.random() < _ITS_OWN:
                return bytes(atheris.Mutate(data, most))
            return mutated(data, first, rng, target.wrappings)[:most]

        flags = [
            f"-max_total_time={seconds:.0f}",
            f"-max_len={MOST_BYTES}",
            f"-timeout={SECONDS + 5:.0f}",
            f"-rss_limit_mb={_MEMORY_MB}",
            f"-artifact_prefix={findings}/{name}-",
            "-verbosity=0",
            "-print_final_stats=0",
        ]
        atheris.Setup([sys.argv[0], *flags, str(corpus)], execute, custom_mutator=change)
        # libFuzzer ends the process itself
        import atexit

        atexit.register(note)
        atheris.Fuzz()


def _module(path: Path) -> str:
    return ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")


def _line(name: str, tally: Tally) -> str:
    return f"{name:17}{tally.executions:>10} executions in {tally.seconds:6.0f} s, {len(tally.findings)} findings"


def _table(tallies: dict[str, Tally]) -> str:
    lines = ["| target | executions | seconds | findings |", "|---|---:|---:|---:|"]
    for name, tally in tallies.items():
        lines.append(f"| {name} | {tally.executions} | {tally.seconds:.0f} | {len(tally.findings)} |")
    total = sum(tally.executions for tally in tallies.values()), sum(tally.seconds for tally in tallies.values())
    lines.append(f"| all | {total[0]} | {total[1]:.0f} | {sum(len(tally.findings) for tally in tallies.values())} |")
    lines += [f"- {path}: {what}" for tally in tallies.values() for path, what in tally.findings.items()]
    return "\n".join(lines)


if __name__ == "__main__":
    os.environ.setdefault("PYTHONPATH", str(ROOT))
    sys.path.insert(0, str(ROOT))
    sys.exit(main())
