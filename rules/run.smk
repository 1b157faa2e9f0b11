# Messages at the end of a run: warnings of its jobs, and the files that it wrote.

import shutil
import time
from contextlib import suppress

from sepi.io.files import is_temporary, remove_temporary

STARTED = time.time()
DAY = 24 * 60 * 60
# of those without a map of an external method
SCENES_NAMED = 3


def is_new(file):
    """Whether this run wrote a file."""
    return os.path.exists(file) and os.path.getmtime(file) >= STARTED


def print_warnings():
    """Show the warnings that reading light fields, ground truth and external maps gave in this run, from the logs."""
    shown, without_map = set(), {}
    for dataset, scene in SETTINGS.scenes:
        for kind in ("ingest", "truth", "external"):
            log = Path(placed(f"logs/{dataset}/{scene}/{kind}.log"))
            for line in log.read_text().splitlines() if is_new(log) else ():
                if line.startswith("sepi: warning:") and line not in shown:
                    shown.add(line)
                    method, scene_named, reason = line.partition(f", scene {dataset}/{scene}: ")
                    if scene_named and reason.endswith(": no such file"):
                        without_map.setdefault(method, []).append(f"{dataset}/{scene}")
                    else:
                        print(line, flush=True)
    # methods often lack maps of some scenes: one line for each method
    for method, scenes in without_map.items():
        more = f" and {len(scenes) - SCENES_NAMED} more" if len(scenes) > SCENES_NAMED else ""
        print(f"{method}: no map of {', '.join(scenes[:SCENES_NAMED])}{more}", flush=True)


def print_written():
    """Print the tables, figures and folders of final maps that this run wrote."""
    tables = filter(is_new, map(placed, every_file()))
    maps = (f"{os.path.dirname(file)}/" for file in map(placed, result_files(SETTINGS.variants)) if is_new(file))
    for title, files in {"Tables and figures": tables, "Maps": maps}.items():
        found = list(dict.fromkeys(files))
        if found:
            print(f"{title} written:", *found, sep="\n  ", flush=True)


def remove_leftovers():
    """Remove temporary files of jobs that were killed in an earlier run.

    None that is younger than a day: a run of other targets in this folder, which Snakemake allows, may be writing it.
    """
    for folder in (RESULTS, "reports"):
        for path in filter(is_temporary, list(Path(placed(folder)).rglob(".*"))):
            # its temporary folder may be gone by now
            with suppress(OSError):
                if path.stat().st_mtime < STARTED - DAY:
                    remove_temporary(path)


def run_ended_well():
    """Print warnings and the files that were made."""
    remove_leftovers()
    print_warnings()
    if SETTINGS.report.page is None and not SETTINGS.has_page:
        print(f"sepi: no page of {len(PLAN.pairs)} scenes; report.page: true asks for one", flush=True)
    if REPORTS[""].missing:
        print(f"sepi: the tables are without {', '.join(REPORTS[''].missing)}, not computed yet", flush=True)
    print_written()


def run_failed():
    """Report an almost full disk: a job that failed of it may have had no room for its message."""
    free = shutil.disk_usage(".").free
    if free < 100_000_000:
        print(f"sepi: {os.getcwd()}: only {free / 1e6:.0f} MB are free on this disk", file=sys.stderr, flush=True)
    remove_leftovers()
