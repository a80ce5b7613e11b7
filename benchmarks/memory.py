"""The largest memory that a process has held."""

import resource
from pathlib import Path


def peak_memory() -> float:
    """Peak resident memory of this process [GB].

    On Linux by /proc: what getrusage says of a process that another has started is at least what that one held.
    """
    status = Path("/proc/self/status")
    if status.exists():
        for line in status.read_text(encoding="utf-8").splitlines():
            if line.startswith("VmHWM:"):
                return float(line.split()[1]) * 1024 / 1e9
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
