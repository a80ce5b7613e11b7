"""Memory is given back."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from robots.common.workers import give_back


def _resident() -> int:
    return int(Path("/proc/self/statm").read_text().split()[1])


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="reads /proc")
def test_what_was_freed_between_what_is_kept_goes_back():
    """Small arrays freed between others that are kept leave holes, which stay until they are given back."""
    arrays = [np.ones(12_000) for _ in range(2000)]  # 96 kB each: below what the allocator maps by itself
    kept = arrays[::50]
    del arrays
    before = _resident()
    give_back()
    assert _resident() <= before
    assert all(array.sum() == 12_000 for array in kept)
