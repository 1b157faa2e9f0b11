"""What a run of the workflow says: a bar on a terminal, a line for each job elsewhere, and what went wrong in full."""

import io
import logging
from typing import Any

import pytest
from snakemake_interface_logger_plugins.common import LogEvent

from sepi.workflow.run_log import RunLog, show_progress, tell_nearest


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


class ColorizingTextHandler(logging.Handler):
    """Stands for Snakemake's own handler, and keeps what it is given; it is known by its name."""

    def __init__(self, stream: io.StringIO) -> None:
        super().__init__()
        self.stream = stream
        self.shown: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        self.shown.append(record.getMessage())


def run_of_two_jobs(stream: io.StringIO) -> tuple[RunLog, ColorizingTextHandler]:
    """A logger that has told of a run of two jobs and of an error of the second."""
    logger = logging.Logger("snakemake")
    usual = ColorizingTextHandler(stream)
    logger.addHandler(usual)
    shown = show_progress(logger)
    assert shown is not None
    assert logger.handlers == [shown]

    def tell(message: str | None, event: LogEvent | None = None, level: int = logging.INFO, **more: Any) -> None:
        logger.log(level, message, extra={"event": event, **more} if event else None)

    tell("Building DAG of jobs...")
    tell("Job stats: ...", LogEvent.RUN_INFO, stats={"initial": 2, "total": 2})
    tell("Select jobs to execute...")
    tell("Execute 1 jobs...", LogEvent.JOB_STARTED, jobs=[1])
    tell("Rule: initial", LogEvent.JOB_INFO, jobid=1, rule_msg="builtin/dots: initial depth", rule_name="initial")
    tell("Finished jobid: 1", LogEvent.JOB_FINISHED, job_id=1)
    tell(None, LogEvent.PROGRESS, done=1, total=2)
    # a rule without a message has its name
    tell("Rule: scores", LogEvent.JOB_INFO, jobid=2, rule_msg=None, rule_name="scores")
    tell("Error in rule scores", LogEvent.JOB_ERROR, logging.ERROR)
    tell("Shutting down, this might take some time.")
    return shown, usual


def test_a_line_for_each_job_where_output_is_no_terminal() -> None:
    stream = io.StringIO()
    run_of_two_jobs(stream)
    assert stream.getvalue().splitlines() == ["2 jobs", "1 of 2  builtin/dots: initial depth", "2 of 2  scores"]


def test_a_bar_with_what_is_in_hand_on_a_terminal() -> None:
    stream = Terminal()
    shown, _ = run_of_two_jobs(stream)
    states = [state.strip() for state in stream.getvalue().split("\r")]
    assert any(state.startswith("0 of 2") and "builtin/dots: initial depth" in state for state in states)
    # what ended is no longer in hand
    assert any(state.startswith("1 of 2") and "dots" not in state for state in states)
    shown.close()
    assert stream.getvalue().endswith("\n"), "what is printed next stands below"


@pytest.mark.parametrize("stream", [io.StringIO(), Terminal()])
def test_what_went_wrong_is_shown_as_ever(stream: io.StringIO) -> None:
    """Snakemake's own words on an error name the file, the command and the log."""
    _, usual = run_of_two_jobs(stream)
    assert usual.shown == ["Error in rule scores", "Shutting down, this might take some time."]


def test_what_quiet_leaves_out_is_left_out() -> None:
    """``--quiet`` is a filter of Snakemake's own handler."""
    stream = io.StringIO()
    logger = logging.Logger("snakemake")
    usual = ColorizingTextHandler(stream)
    usual.addFilter(lambda record: record.levelno >= logging.ERROR)
    logger.addHandler(usual)
    show_progress(logger)
    logger.info("Job stats: ...", extra={"event": LogEvent.RUN_INFO, "stats": {"total": 2}})
    logger.info("Rule: a", extra={"event": LogEvent.JOB_INFO, "jobid": 1, "rule_msg": "a", "rule_name": "a"})
    logger.error("Error in rule a", extra={"event": LogEvent.JOB_ERROR, "jobid": 1})
    assert stream.getvalue() == ""
    assert usual.shown == ["Error in rule a"]


def test_a_job_that_failed_is_no_longer_in_hand_and_its_log_is_named() -> None:
    stream = Terminal()
    logger = logging.Logger("snakemake")
    usual = ColorizingTextHandler(stream)
    logger.addHandler(usual)
    show_progress(logger)
    logger.info("Job stats: ...", extra={"event": LogEvent.RUN_INFO, "stats": {"total": 3}})
    logger.info("Complete log(s): before")
    for number, name in enumerate(("bad", "good"), start=1):
        told = {"event": LogEvent.JOB_INFO, "jobid": number, "rule_msg": name, "rule_name": name}
        logger.info("Rule: job", extra=told)
    logger.error("Error in rule bad", extra={"event": LogEvent.JOB_ERROR, "jobid": 1})
    logger.info("Finished jobid: 2", extra={"event": LogEvent.JOB_FINISHED, "job_id": 2})
    logger.info("Rule: job", extra={"event": LogEvent.JOB_INFO, "jobid": 3, "rule_msg": "last", "rule_name": "last"})
    assert stream.getvalue().split("\r")[-1].strip().endswith("last")
    assert "bad" not in stream.getvalue().split("\r")[-1]
    logger.info("Complete log(s): here")
    assert usual.shown == ["Error in rule bad", "Complete log(s): here"]


def test_another_handler_of_the_users_stays() -> None:
    """``--logger`` names one: that is the user's word."""
    logger = logging.Logger("snakemake")
    other = logging.StreamHandler(io.StringIO())
    logger.addHandler(other)
    assert show_progress(logger) is None
    assert logger.handlers == [other]


def test_a_wrong_target_is_one_line_with_the_nearest() -> None:
    """Snakemake's own goes on about input functions."""
    logger = logging.Logger("snakemake")
    usual = ColorizingTextHandler(io.StringIO())
    logger.addHandler(usual)
    for known in (["another workflow's"], ["ablation", "all"]):
        tell_nearest(logger, lambda target, known=known: known)
    for target in ("al", "x\ny"):
        logger.error(f"MissingRuleException:\nNo rule to produce {target} (if you use input functions make sure ...).")
    logger.error("100 %s")
    assert usual.shown == [
        "sepi: al: nothing makes this; did you mean all?",
        "sepi: x y: nothing makes this; docs/reproduce/workflow.md lists what there is",
        "100 %s",
    ]
