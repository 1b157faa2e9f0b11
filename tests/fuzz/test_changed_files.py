"""Every reader of what a user hands in, with files changed at random: a value or one clear line, and nothing else."""

import ctypes
import faulthandler
import os
import re
import resource
import time
import warnings
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st
from targets import TARGETS, Target

from sepi.errors import SepiError, SepiWarning

# changed files of each target; `make faults` asks for more
EXECUTIONS = 4 * int(os.environ["SEPI_FAULTS"]) if "SEPI_FAULTS" in os.environ else 30
# of one execution: seconds; bytes of memory, more than any header of so small a file is due; warnings
SECONDS, MEMORY, WARNINGS = 10.0, 2**30, 10
MOST_BYTES = 2**16
DIGITS = re.compile(rb"[-+]?[0-9.]+(?:e[-+]?[0-9]+)?")

# what a reader may take for a size, a place or a count
NUMBERS = [0, 1, -1, 2, 127, 255, 256, 32767, 65535, 2**16, 2**31 - 1, 2**32 - 1, 2**32, 2**63 - 1]
TEXTS = [b"1e308", b"1e999", b"-0.0", b"nan", b"inf", b"", b"null", b"true", b"[", b"\n", *(b"%d" % n for n in NUMBERS)]
WORDS = st.builds(
    lambda number, size, order: (number % 2 ** (8 * size)).to_bytes(size, order),
    st.sampled_from(NUMBERS),
    st.sampled_from([1, 2, 4, 8]),
    st.sampled_from(["little", "big"]),
)
# the likeliest to get past a first look are numbers
PUT_IN = st.one_of(WORDS, WORDS, st.sampled_from(TEXTS), st.binary(max_size=64), st.integers(0, 64).map(bytes))
# where, as a share of the file, what is put in, and what it takes the place of: as many bytes, as in a header, the next
# number in digits (-1), or another number of bytes; of all to the end, the file is cut off
REPLACED = st.sampled_from([None, None, None, -1, -1, 0, 1, 4, 64, MOST_BYTES])
CHANGES = st.lists(st.tuples(st.floats(0, 1), PUT_IN, REPLACED), min_size=1, max_size=4)


Changes = list[tuple[float, bytes, int | None]]


def changed(data: bytes, changes: Changes) -> bytes:
    """A file with some of its bytes replaced; early ones are the likelier, since that is where headers are."""
    for where, new, length in changes:
        start = int(len(data) * where**3)
        start -= start % len(new) if len(new) in (2, 4, 8) else 0
        end = start + (len(new) if length is None else length)
        if length == -1:
            start, end = digits.span() if (digits := DIGITS.search(data, start)) else (start, start)
        data = data[:start] + new + data[end:]
    return data[:MOST_BYTES]


def memory(key: str) -> int:
    """Bytes that the system states of this process; 0 where it does not."""
    try:
        lines = Path("/proc/self/status").read_text(encoding="ascii").splitlines()
    except OSError:
        return 0
    return next(int(line.split()[1]) for line in lines if line.startswith(f"{key}:")) * 1024


def refusal(target: Target, folder: Path, data: bytes) -> str:
    """The line with which a reader refused a file, empty where it took it; an AssertionError for all else."""
    path = folder / target.file
    path.write_bytes(data)
    if held := memory("VmSize"):
        resource.setrlimit(resource.RLIMIT_AS, (held + MEMORY, resource.getrlimit(resource.RLIMIT_AS)[1]))
        # what was the most until now is forgotten
        Path("/proc/self/clear_refs").write_text("5")
    before, began = memory("VmRSS"), time.monotonic()
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            target.read(path)
            line = ""
        except SepiError as error:
            line = str(error)
            below: BaseException | None = error
            while below is not None:
                assert not isinstance(below, MemoryError), f"memory taken on a header's word: {line}"
                below = below.__cause__
            assert line.isprintable()
            assert line.startswith(str(folder)) or not target.names_path, line
    assert time.monotonic() - began < SECONDS
    assert memory("VmHWM") - before < MEMORY
    assert all(issubclass(one.category, SepiWarning) and str(one.message).isprintable() for one in caught), caught
    assert len(caught) <= WARNINGS
    return line


@pytest.fixture
def limited(here: Path, capfd: pytest.CaptureFixture[str]) -> Iterator[None]:
    """An empty current folder, and limits: a traceback where a test hangs, be it inside a library in C; memory."""
    # readers that are not told of the folder look into the working one
    with capfd.disabled():
        # the terminal, which pytest takes away during tests
        terminal = os.dup(2)
    faulthandler.dump_traceback_later(6 * SECONDS + EXECUTIONS, exit=True, file=terminal)
    limits = resource.getrlimit(resource.RLIMIT_AS)
    yield
    resource.setrlimit(resource.RLIMIT_AS, limits)
    faulthandler.cancel_dump_traceback_later()
    os.close(terminal)


@pytest.mark.parametrize("name", TARGETS)
@pytest.mark.usefixtures("limited")
def test_a_value_or_one_clear_line(tmp_path: Path, capfd: pytest.CaptureFixture[str], name: str) -> None:
    """A file that was cut off, or made to harm, must not end in a traceback, a crash, or all memory taken."""
    target = TARGETS[name]
    (tmp_path / "made").mkdir()
    seeds = list(target.seeds(tmp_path / "made"))
    target.around(tmp_path)
    # what is refused from the start is not tried inside
    refused = [line for line in (refusal(target, tmp_path, target.close(seed)) for seed in seeds) if line]
    assert target.partly or not refused

    @settings(
        max_examples=EXECUTIONS,
        deadline=None,
        # the files are small as they are: to look for smaller ones takes minutes
        phases=[Phase.generate],
        database=None,
        # others at each run where many are asked for
        derandomize="SEPI_FAULTS" not in os.environ,
        suppress_health_check=list(HealthCheck),
    )
    @given(st.sampled_from(seeds), CHANGES)
    def read_changed(seed: bytes, changes: Changes) -> None:
        refusal(target, tmp_path, target.close(changed(seed, changes)))
        # libraries in C print, too
        ctypes.CDLL(None).fflush(None)
        assert capfd.readouterr() == ("", "")

    read_changed()
