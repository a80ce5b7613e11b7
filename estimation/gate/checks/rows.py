"""Rows that are too few, repeated, late or wrong, and what the reader did with rows."""

from __future__ import annotations

from estimation.gate.context import Context
from estimation.gate.finding import Finding
from estimation.gate.quick_fits.whole_fit import LIKE_A_CONSTANT
from estimation.recordings.rows.late_rows import Rounding, Stalls
from estimation.recordings.rows.motion import HARDLY, travel_shares
from estimation.recordings.rows.outliers import are_isolated
from estimation.recordings.rows.row_flags import flagged
from estimation.recordings.rows.timing import FEWEST
from robots.common.plain import several

# Parameters of a joint: ten of its link, and rotor inertia, Coulomb and viscous friction, and offset.
PER_JOINT = 14
# Rows per parameter below which standard errors are unreliable.
ROWS_PER_PARAMETER = 10
# Share of the log in which the arm moves, up to which it stands nearly always.
RESTING = 0.1


def too_few_rows(context: Context) -> list[Finding]:
    """Refuses a log with too few rows for derivatives."""
    rows = len(context.recorded.log)
    if rows >= FEWEST:
        return []
    return [
        Finding(
            name="short",
            severity="refuse",
            text=f"{rows} rows",
            action=f"record a longer log: at least {FEWEST} rows are needed",
            value=float(rows),
            unit="rows",
        )
    ]


def too_few_smoothed_rows(context: Context) -> list[Finding]:
    """Refuses a log with torque and motion whose smoothed parts are too short for a fit."""
    cleaned = context.cleaned
    can_be_fitted = context.smoothed.rows is not None
    if can_be_fitted or not (cleaned.columns.varies.any() and cleaned.columns.travel.any()):
        return []
    if (travel_shares(context.robot, cleaned.columns.extremes) < HARDLY).all():
        return [
            Finding(
                name="no_motion",
                severity="refuse",
                text=f"no joint moves by {100 * HARDLY:g} % of its range: nothing to fit a model to",
                action="record a log in which the arm moves",
                value=float(cleaned.columns.travel.max()),
                unit="rad or m",
            )
        ]
    longest = max(stop - first for first, stop in cleaned.timing.parts)
    return [
        Finding(
            name="short",
            severity="refuse",
            text=f"{len(cleaned.log)} rows, {longest} of them without a gap: too few to fit and validate a model",
            action="record a longer log, without gaps",
            value=float(longest),
            unit="rows",
        )
    ]


def little_motion(context: Context) -> list[Finding]:
    """Refuses a log in which the arm stands nearly always, and moves too little for a fit."""
    if (context.logged.unexplained < LIKE_A_CONSTANT).any():
        return []
    moves, duration = ~flagged(context.recorded, "at rest").all(axis=1), context.recorded.log.duration
    if moves.mean() > RESTING:
        return []
    moved = float(moves.mean()) * duration
    return [
        Finding(
            name="short",
            severity="refuse",
            text=f"the arm moves in {moved:.2g} s of {duration:.4g} s, and stands in the others: too little to fit and "
            "validate a model",
            action="record a longer motion; rows at rest hold no information",
            value=moved,
            unit="s",
        )
    ]


def few_rows_per_parameter(context: Context) -> list[Finding]:
    """Warns of a log with few rows for the number of parameters."""
    log = context.cleaned.log
    parameters = PER_JOINT * log.n
    if len(log) >= ROWS_PER_PARAMETER * parameters:
        return []
    return [
        Finding(
            name="short",
            severity="warning",
            text=f"{len(log)} rows ({log.duration:.3g} s) for some {parameters} parameters",
            action="record a longer log: standard errors from so few rows are unreliable",
            value=float(len(log)),
            unit="rows",
        )
    ]


# Share of the rows in motion that repeat the row before: above the first it is reported, above the second a warning.
REPORTED, REPEATED = 1e-3, 0.02


def repeated_rows(context: Context) -> list[Finding]:
    """Finds rows that repeat the row before in every column while the arm moves."""
    repeated = context.recorded.repeated
    share = repeated.share
    if not share > REPORTED:
        return []
    return [
        Finding(
            name="repeated_rows",
            severity="warning" if share > REPEATED else "info",
            text=f"{100 * share:.3g} % of the rows repeat the row before while the arm moves",
            action="these rows are ignored; make the logger write each message once"
            if len(repeated.copies)
            else "repeated positions are ignored in the smoothing; make the logger write each message once",
            value=100 * share,
            unit="%",
            row=int(repeated.rows[0]) + 1,
        )
    ]


# Share of rows that are late, above which it is a warning.
FEW = 1e-4


def late_rows(context: Context) -> list[Finding]:
    """Reports rows that were written late, and rounded times."""
    times = context.recorded.times
    if times.rounding is not None:
        return [_rounded(times.rounding)]
    if times.stalls is not None:
        return [_late(times.stalls, len(times.lost), len(times.t))]
    return []


def _rounded(rounding: Rounding) -> Finding:
    return Finding(
        name="rounded_times",
        severity="info",
        text=f"times are rounded to {1e3 * rounding.resolution:.3g} ms; the sample period is "
        f"{1e3 * rounding.period:.4g} ms",
        action="rows are moved to uniform times; log the time with more digits",
        value=1e3 * rounding.resolution,
        unit="ms",
        column="t",
    )


def _late(stalls: Stalls, lost: int, rows: int) -> Finding:
    done = [f"{stalls.moved} are moved to uniform times"] if stalls.moved else []
    done += [f"{lost} are ignored because others are missing"] if lost else []
    return Finding(
        name="late_rows",
        severity="warning" if stalls.moved + lost > FEW * rows else "info",
        text=f"the logger stopped {f'{stalls.count} times' if stalls.count > 1 else 'once'}, for up to "
        f"{stalls.longest:.3g} s, and then wrote the delayed rows with late time stamps",
        action=f"of these rows, {' and '.join(done)}; let the controller write the time stamps",
        value=float(stalls.moved + lost),
        unit="rows",
        column="t",
        row=stalls.first + 1,
    )


def spikes(context: Context) -> list[Finding]:
    """Finds outliers in positions, and in torques or currents."""
    columns, outliers = context.recorded.columns, context.recorded.outliers
    findings = []
    for prefix, joint, column in columns.named():
        rows = outliers.get((prefix, joint))
        if rows is None:
            continue
        many = not are_isolated(rows, len(column))
        before, value, after = (float(column[rows[0] + k]) for k in (-1, 0, 1))
        findings.append(
            Finding(
                name="spikes",
                severity="refuse" if many and prefix == "q" else "warning",
                text=f"{several(len(rows), 'outlier')}, the first with {value:.4g} between "
                f"{before:.4g} and {after:.4g}",
                action="too many to ignore: repair the logger" if many else "these rows are ignored",
                value=float(len(rows)),
                unit="rows",
                column=f"{prefix}{joint + 1}",
                joint=joint + 1,
                row=int(rows[0]) + 1,
            )
        )
    return findings


def reader_notes(context: Context) -> list[Finding]:
    """Reports what was changed when the file was read."""
    return [
        Finding(
            name=str(note["name"]),
            severity=note.get("severity", "info"),
            text=str(note["text"]),
            action=str(note["action"]),
            value=float(note["value"]),
            unit=str(note.get("unit", "rows")),
        )
        for note in context.recorded.log.metadata.get("repairs", ())
    ]
