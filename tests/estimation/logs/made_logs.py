"""Small logs as columns, text and files."""

import numpy as np
import pytest

from estimation.logs import read_log
from robots.common.errors import InputError


def columns(rows=4, joints=2, **changes):
    """A smallest log, as columns; None leaves a column out."""
    made = {"t": 0.5 * np.arange(rows)}
    for offset, prefix in ((0.0, "q"), (10.0, "tau")):
        made |= {f"{prefix}{joint}": offset + joint + 0.1 * np.arange(rows) for joint in range(1, joints + 1)}
    made |= changes
    return {name: values for name, values in made.items() if values is not None}


def text(data, block=""):
    """The same as CSV."""
    rows = zip(*data.values(), strict=True)
    return block + "\n".join([",".join(data), *(",".join(str(cell) for cell in row) for row in rows)]) + "\n"


def csv(tmp_path, content, name="log.csv"):
    """Writes a file; returns its path."""
    path = tmp_path / name
    path.write_text(content)
    return path


def refused(path, n=None):
    """Reads a log that must be refused; returns the error."""
    with pytest.raises(InputError) as caught:
        read_log(path, n)
    assert caught.value.file == str(path)
    return caught.value
