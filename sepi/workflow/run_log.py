"""Log of a workflow run: a progress bar on a terminal, one line for each job elsewhere.

Snakemake's own handler prints three lines and more for each job. :func:`show_progress` puts one in its place that
listens to the same events; what went wrong is shown as Snakemake shows it, in full.
"""

from __future__ import annotations

import difflib
import logging
import re
import sys
from collections.abc import Callable, Iterable
from typing import Any, TextIO

from snakemake_interface_logger_plugins.common import LogEvent
from tqdm import tqdm

from sepi.errors import one_line

# what Snakemake says of its own doings
_CHATTER = re.compile(
    r"Building DAG|Using shell|Provided cores|Rules claiming|Select jobs|Execute \d|Assuming unrestricted|Complete log"
)
# of a target, with the name of the exception before it
_NO_RULE = re.compile(r"No rule to produce (.+?) \(if you use input functions", re.DOTALL)
# said by this handler in fewer words, or by no one
_SILENT = {LogEvent.JOB_STARTED, LogEvent.JOB_FINISHED, LogEvent.RESOURCES_INFO, LogEvent.WORKFLOW_STARTED}


class RunLog(logging.Handler):
    """Shows the progress of a run.

    Parameters
    ----------
    usual : logging.Handler
        Snakemake's own, for what is shown as ever; the progress goes where it writes, as a bar if that is a terminal.
    """

    def __init__(self, usual: logging.Handler) -> None:
        super().__init__()
        self._usual = usual
        self._stream: TextIO = getattr(usual, "stream", sys.stderr)
        self._bar: tqdm[Any] | None = None
        self._total = self._begun = 0
        self._failed = False
        self._running: dict[int, str] = {}

    def emit(self, record: logging.LogRecord) -> None:
        """Show what a record tells of the run, if anything."""
        event = getattr(record, "event", None)
        if event in (LogEvent.JOB_FINISHED, LogEvent.JOB_ERROR):
            # one of them spells it otherwise
            self._running.pop(getattr(record, "job_id", getattr(record, "jobid", -1)), None)
        self._failed |= record.levelno >= logging.ERROR
        # what --quiet leaves out
        if not self._usual.filter(record):
            return
        if event == LogEvent.RUN_INFO:
            self._start(int(record.stats["total"]))  # type: ignore[attr-defined]
        elif event == LogEvent.JOB_INFO:
            self._begin(record.jobid, record.rule_msg or record.rule_name)  # type: ignore[attr-defined]
        elif event == LogEvent.PROGRESS:
            self._advance(record.done, record.total)  # type: ignore[attr-defined]
        elif event not in _SILENT and (event is not None or self._failed or not _CHATTER.match(record.getMessage())):
            with tqdm.external_write_mode(self._stream):
                self._usual.emit(record)

    def close(self) -> None:
        """End the bar, so that what is printed next stands below it."""
        if self._bar is not None:
            self._bar.close()
            self._bar = None
        super().close()

    def _start(self, total: int) -> None:
        self._total = total
        if self._stream.isatty():
            layout = "{n_fmt} of {total_fmt} |{bar:30}| {elapsed}  {desc}"
            self._bar = tqdm(total=total, bar_format=layout, file=self._stream, dynamic_ncols=True, mininterval=0)
        else:
            print(f"{total} jobs", file=self._stream, flush=True)

    def _begin(self, job: int, message: str) -> None:
        self._begun += 1
        self._running[job] = message
        if self._bar is None:
            print(f"{self._begun:{len(str(self._total))}} of {self._total}  {message}", file=self._stream, flush=True)
        else:
            self._bar.set_description_str("; ".join(self._running.values()))

    def _advance(self, done: int, total: int) -> None:
        if self._bar is not None:
            self._bar.total = total
            self._bar.set_description_str("; ".join(self._running.values()), refresh=False)
            self._bar.update(done - self._bar.n)
            if done == total:
                self.close()


class _NearestNames(logging.Filter):
    """Makes one line of what Snakemake says of a target that no rule makes, with the names that are nearest to it."""

    def __init__(self, known: Callable[[str], Iterable[str]]) -> None:
        super().__init__()
        self._known = known

    def filter(self, record: logging.LogRecord) -> bool:
        found = _NO_RULE.search(record.getMessage())
        if found:
            near = difflib.get_close_matches(found[1], self._known(found[1]), n=3)
            hint = f"did you mean {' or '.join(near)}?" if near else "docs/reproduce/workflow.md lists what there is"
            record.msg, record.args = f"sepi: {one_line(found[1])}: nothing makes this; {hint}", ()
        return True


def tell_nearest(logger: logging.Logger, known: Callable[[str], Iterable[str]]) -> None:
    """Report a wrong target in one line.

    Parameters
    ----------
    logger : logging.Logger
        Snakemake's.
    known : callable
        From a wrong target to names of rules and files that may be meant by it.
    """
    for before in [one for one in logger.filters if isinstance(one, _NearestNames)]:
        logger.removeFilter(before)
    logger.addFilter(_NearestNames(known))


def show_progress(logger: logging.Logger) -> RunLog | None:
    """Let a :class:`RunLog` show what Snakemake's own handler would; nothing where the user chose another handler.

    Parameters
    ----------
    logger : logging.Logger
        Snakemake's.
    """
    usual = next((handler for handler in logger.handlers if type(handler).__name__ == "ColorizingTextHandler"), None)
    if usual is None:
        return None
    logger.removeHandler(usual)
    shown = RunLog(usual)
    logger.addHandler(shown)
    return shown
