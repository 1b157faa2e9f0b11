# What a run as a whole does beside its jobs: it takes its folder over from one that was killed, shows how far it is, and says
# at its end what it wrote.

import time

from sepi.workflow.job_server import start_job_server
from sepi.workflow.run_folder import note_run, put_away, say_if_full, say_so, take_over
from sepi.workflow.run_log import show_progress, tell_nearest

STARTED = time.time()


def is_new(file):
    """Whether this run wrote a file."""
    return Path(file).exists() and Path(file).stat().st_mtime >= STARTED


def print_warnings():
    """Show what the readers of light fields and of external maps warned of in this run, from their logs."""
    missing = {}
    for dataset, scene in (*SETTINGS.scenes, *SETTINGS.rendered_scenes):
        for command in ("ingest", "truth", "external"):
            log = Path(placed(f"logs/{dataset}/{scene}/{command}.log"))
            for line in log.read_text().splitlines() if is_new(log) else ():
                absent = re.match(r"sepi: warning: external (.+), scene .+: no such file$", line)
                if absent:
                    missing.setdefault(absent[1], []).append(f"{dataset}/{scene}")
                elif line.startswith("sepi: warning:"):
                    print(line, flush=True)
    # a method rarely has maps of all scenes: one line for each method
    for method, scenes in missing.items():
        others = f" and {len(scenes) - 3} others" if len(scenes) > 4 else ""
        named = ", ".join(scenes[:3] if others else scenes)
        print(f"sepi: warning: external {method}: no map of {named}{others}", flush=True)


def print_written(tables, maps):
    """Name the tables and the folders of maps that this run wrote."""
    tables, maps = list(map(placed, tables)), list(map(placed, maps))
    new = [file for file in [*tables, *maps] if is_new(file)]
    groups = {
        "Tables and figures": [file for file in new if file in tables],
        "Maps": list(dict.fromkeys(f"{Path(file).parent}/" for file in new if file in maps)),
    }
    for title, files in groups.items():
        if files:
            print(f"{title} written:", *dict.fromkeys(files), sep="\n  ", flush=True)


def print_all_written():
    """Name whatever of the report and the final maps this run wrote."""
    print_written(every_file(), result_files(SETTINGS.variants))


def jobs_are_forks():
    """Whether jobs are left to a server: not on a cluster, which limits and ends its own processes, nor where Snakemake is to
    measure their memory, which it can of its own alone. The user's word is the variable, empty.
    """
    asked = workflow.output_settings.benchmark_extended or job_client.SERVER in os.environ
    return workflow.is_main_process and workflow.local_exec and not asked


def run_begins():
    """Note that what is made now is to be looked at, should the run be killed; have jobs be forks of a server."""
    note_run(well=False)
    server = start_job_server(PYTHON_PATH) if jobs_are_forks() else None
    if server is not None:
        os.environ[job_client.SERVER] = server.address
        atexit.register(server.end)


def run_ended_well():
    """Note that nothing is left to look at; tell of warnings, and what was made."""
    note_run(well=True)
    print_warnings()
    if SETTINGS.report.page is None and not SETTINGS.has_page:
        print(f"sepi: no page of {len(SETTINGS.scenes)} scenes; report.page: true asks for one", flush=True)
    if REPORTS[""].missing:
        print(f"sepi: the tables are without {', '.join(REPORTS[''].missing)}, not computed yet", flush=True)
    print_all_written()


def run_failed():
    """Put away what a job left: it may have been killed, the clock set back, the disk be full."""
    put_away(MADE)
    say_if_full(Path())


# where all that is made is
MADE = [Path(placed(RESULTS)), Path(placed("reports"))]

# a run that was killed does not stop the next one
if workflow.is_main_process and not workflow.output_settings.dryrun:
    if take_over(Path(workflow.overwrite_workdir or "."), MADE):
        say_so()
    if IS_MODULE:
        # not every version of Snakemake calls handlers of a module, and the workflow that has it may not either
        run_begins()


# ... and what cannot be made is told with its nearest names
if workflow.is_main_process and not IS_MODULE:
    tell_nearest(logger, names_like)

# a progress bar, or a line for each job; a dry run is as Snakemake shows it, and so is another workflow's run
if workflow.is_main_process and not (IS_MODULE or workflow.output_settings.dryrun or workflow.output_settings.verbose):
    show_progress(logger)
