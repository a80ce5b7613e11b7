"""Tables of a calibrated robot as text: Denavit-Hartenberg parameters, and joint zeros as controllers take them."""

from __future__ import annotations

from estimation.calibrations.result import Calibration
from robots.geometry.dh import Convention
from robots.geometry_errors.dh_extraction import TableRow, dh_table

COLUMNS = ("alpha", "a", "beta", "d", "offset")
FORMULA = {
    "modified": "Rx(alpha) Tx(a) Ry(beta) Rz(q + offset) Tz(d)",
    "standard": "Rz(q + offset) Tz(d) Tx(a) Rx(alpha) Ry(beta)",
}


def dh_text(calibration: Calibration, convention: Convention) -> str:
    """Writes the table before and after as CSV: lengths in m, angles in rad.

    Beta is Hayati's turn between axes that are nearly parallel. The poses of frame 0 and of the flange stand above.

    Args:
        calibration: of a robot.
        convention: "modified" or "standard".
    """
    before, after = dh_table(calibration.robot.chain, convention), dh_table(calibration.corrected.chain, convention)
    lines = [f"# {convention} Denavit-Hartenberg table of {calibration.robot.name}: {FORMULA[convention]}"]
    for title, pose in (("frame 0 in the base frame", after.base), ("flange in frame n", after.flange)):
        rows = "; ".join(" ".join(f"{value:.9g}" for value in row) for row in pose)
        lines.append(f"# {title}, calibrated [m]: {rows}")
    lines.append(",".join(["joint", "kind", *COLUMNS, *(f"nominal_{name}" for name in COLUMNS)]))
    for new, old in zip(after.rows, before.rows, strict=True):
        lines.append(",".join([new.name, new.kind, *_cells(new), *_cells(old)]))
    return "\n".join(lines) + "\n"


def zeros_text(calibration: Calibration) -> str:
    """Writes the joint zeros as YAML: what to add to the reading of each encoder [rad or m].

    Args:
        calibration: of a robot.
    """
    lines = [
        f"# Joint zeros of {calibration.robot.name}: position = reading + zero [rad; m for joints that slide].",
        "# The zero is 0 of a joint whose zero no pose distinguishes from the pose of the base or the tool.",
        "joint_zeros:",
    ]
    lines += [f"  {name}: {value:.9g}" for name, value in calibration.joint_zeros.items()]
    return "\n".join(lines) + "\n"


def _cells(row: TableRow) -> list[str]:
    return [f"{getattr(row, name):.9g}" for name in COLUMNS]
