"""Settings of all tests."""

from __future__ import annotations

import os
import signal

# Tests run in several processes: a linear algebra library that starts a thread a core in each of them only waits.
for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

# A shell ignores Ctrl-C for what it starts in the background, and so would the tests of Ctrl-C.
signal.signal(signal.SIGINT, signal.default_int_handler)
