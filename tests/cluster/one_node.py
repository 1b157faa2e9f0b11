"""A real Slurm of one node, all of it on the loopback address: its settings, its daemons, and their end.

The daemons run as root, from ``/etc/slurm/slurm.conf``, since the executor takes every variable of Slurm's away from
jobs, so that no other place could be named to them. A machine that has this file is somebody's cluster: nothing is
touched there.
"""

import os
import shutil
import signal
import socket
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import psutil

SETTINGS = Path("/etc/slurm/slurm.conf")
PROGRAMS = ("munged", "slurmctld", "slurmd", "sbatch", "squeue", "scancel", "sinfo")
PACKAGES = "slurm-wlm slurmctld slurmd munge"
# seconds for the node to be ready, and for a daemon to end
_PATIENCE = 60
_LAST_PATIENCE = 15


def why_not() -> str | None:
    """What a one-node Slurm lacks here; None if nothing."""
    missing = [name for name in PROGRAMS if shutil.which(name) is None]
    if missing:
        return f"no {missing[0]} (Debian: apt install {PACKAGES})"
    if os.geteuid() != 0:
        return "its daemons have to be started as root"
    if SETTINGS.exists():
        return f"{SETTINGS} exists: this machine belongs to a cluster"
    return None


@contextmanager
def one_node_slurm(folder: Path, cores: int) -> Iterator[None]:
    """A Slurm whose only node is this machine, with so many cores; ended, and its settings removed, on leaving."""
    folder.mkdir(parents=True)
    started: list[subprocess.Popen[bytes]] = []
    SETTINGS.parent.mkdir(exist_ok=True)
    try:
        SETTINGS.write_text(_settings(folder, cores))
        started.append(_started_munge(folder))
        for daemon in ("slurmctld", "slurmd"):
            started.append(_started(folder, daemon, "-D"))
        _wait_for_the_node(folder)
        yield
    finally:
        with suppress(subprocess.SubprocessError):
            subprocess.run(["scancel", "--user=root"], check=False, capture_output=True, timeout=_LAST_PATIENCE)
        for process in reversed(started):
            _end(process)
        SETTINGS.unlink(missing_ok=True)


def queue() -> list[str]:
    """Names of the jobs that wait or run."""
    found = subprocess.run(["squeue", "--noheader", "--format=%j"], check=True, capture_output=True, text=True)
    return found.stdout.split()


def _settings(folder: Path, cores: int) -> str:
    name = socket.gethostname().split(".")[0]
    memory = psutil.virtual_memory().total // 2**20 - 1000
    for part in ("state", "spool"):
        (folder / part).mkdir()
    ports = _free_ports(2)
    return "\n".join(
        [
            "ClusterName=one_node",
            f"SlurmctldHost={name}(127.0.0.1)",
            f"SlurmctldPort={ports[0]}",
            f"SlurmdPort={ports[1]}",
            "SlurmUser=root",
            "AuthType=auth/munge",
            f"AuthInfo=socket={folder}/munge.socket",
            f"StateSaveLocation={folder}/state",
            f"SlurmdSpoolDir={folder}/spool",
            f"SlurmctldPidFile={folder}/slurmctld.pid",
            f"SlurmdPidFile={folder}/slurmd.pid",
            f"SlurmctldLogFile={folder}/slurmctld.log",
            f"SlurmdLogFile={folder}/slurmd.log",
            # nothing listens on another address
            "CommunicationParameters=NoInAddrAny,NoCtldInAddrAny",
            # no systemd, no control groups, no accounting
            "ProctrackType=proctrack/linuxproc",
            "TaskPlugin=task/none",
            "JobAcctGatherType=jobacct_gather/none",
            "AccountingStorageType=accounting_storage/none",
            "MpiDefault=none",
            # ended jobs stay in the queue's memory, where the executor looks for them
            "MinJobAge=600",
            # what fits no node is refused at once
            "EnforcePartLimits=ALL",
            "SelectType=select/cons_tres",
            "SelectTypeParameters=CR_Core_Memory",
            # as soon as something ends, the next is begun
            "SchedulerParameters=sched_interval=2,batch_sched_delay=0",
            "ReturnToService=2",
            f"NodeName={name} NodeAddr=127.0.0.1 CPUs={cores} RealMemory={memory} State=UNKNOWN",
            "PartitionName=all Nodes=ALL Default=YES MaxTime=INFINITE State=UP",
            "",
        ]
    )


def _free_ports(number: int) -> list[int]:
    sockets = [socket.socket() for _ in range(number)]
    for one in sockets:
        one.bind(("127.0.0.1", 0))
    ports = [int(one.getsockname()[1]) for one in sockets]
    for one in sockets:
        one.close()
    return ports


def _started_munge(folder: Path) -> subprocess.Popen[bytes]:
    """The daemon that signs messages, with a key of its own; it wants its folders to be nobody else's."""
    key = folder / "munge.key"
    key.write_bytes(os.urandom(128))
    key.chmod(0o400)
    files = {"key-file": key, "socket": folder / "munge.socket", "pid-file": folder / "munge.pid"}
    files |= {"log-file": folder / "munge.log", "seed-file": folder / "munge.seed"}
    flags = [f"--{name}={path}" for name, path in files.items()]
    process = _started(folder, "munged", "--foreground", "--force", *flags)
    end = time.monotonic() + _PATIENCE
    while not files["socket"].exists():
        if process.poll() is not None or time.monotonic() > end:
            raise RuntimeError(f"munged does not run: {_told(folder)}")
        time.sleep(0.1)
    return process


def _started(folder: Path, program: str, *words: str) -> subprocess.Popen[bytes]:
    with (folder / f"{program}.out").open("wb") as out:
        return subprocess.Popen(
            [program, *words], stdin=subprocess.DEVNULL, stdout=out, stderr=out, start_new_session=True
        )


def _wait_for_the_node(folder: Path) -> None:
    end = time.monotonic() + _PATIENCE
    while time.monotonic() < end:
        with suppress(subprocess.SubprocessError):
            state = subprocess.run(
                ["sinfo", "--noheader", "--format=%T"], check=False, capture_output=True, text=True, timeout=10
            )
            if state.stdout.strip() == "idle":
                return
        time.sleep(0.2)
    raise RuntimeError(f"the node is not ready: {_told(folder)}")


def _told(folder: Path) -> str:
    """The last lines of every log."""
    logs = sorted([*folder.glob("*.log"), *folder.glob("*.out")])
    return "\n".join(f"{log.name}: {line}" for log in logs for line in log.read_text().splitlines()[-5:])


def _end(process: subprocess.Popen[bytes]) -> None:
    if process.poll() is None:
        process.send_signal(signal.SIGTERM)
        try:
            process.wait(_LAST_PATIENCE)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
