"""Every reader of what a user hands in, with its files changed at random: a value or one clear line, and nothing else.

``make fuzz`` looks further, led by which code is reached.
"""

import faulthandler
import os
import random
from collections.abc import Iterator
from pathlib import Path

import pytest
from executions import MOST_BYTES, SECONDS, FindingError, Trial
from mutations import mutated
from targets import TARGETS

# executions of each target; `make faults` asks for more
EXECUTIONS = 4 * int(os.environ["SEPI_FAULTS"]) if "SEPI_FAULTS" in os.environ else 30

# what of their seeds the targets refuse: those that are sound for one of several readers alone, or that are not read
PARTLY_REFUSED = ("tiff", "map-png", "json", "json-flags", "settings", "config")


@pytest.fixture
def watched(capfd: pytest.CaptureFixture[str]) -> Iterator[None]:
    """End the tests with a traceback where one hangs, be it inside a library in C."""
    with capfd.disabled():
        # the terminal, which pytest takes away during tests
        terminal = os.dup(2)
    faulthandler.dump_traceback_later(6 * SECONDS + EXECUTIONS, exit=True, file=terminal)
    yield
    faulthandler.cancel_dump_traceback_later()
    os.close(terminal)


@pytest.mark.parametrize("name", TARGETS)
@pytest.mark.usefixtures("watched")
def test_a_value_or_one_clear_line(tmp_path: Path, name: str) -> None:
    """A file that was cut off, or made to harm, must not end in a traceback, a crash, or all memory taken."""
    target = TARGETS[name]
    first = target.first()
    trial = Trial(target, tmp_path)
    refused = [line for line in map(trial.run, first) if line]
    # what is refused from the start is not tried inside
    assert not refused or name in PARTLY_REFUSED
    rng = random.Random(name)
    for number in range(EXECUTIONS):
        data = mutated(rng.choice(first), first, rng, target.wrappings)[:MOST_BYTES]
        try:
            trial.run(data)
        except FindingError as finding:
            raise AssertionError(f"{name}, change {number}: {finding}; the file: {data[:300]!r}") from finding
