"""What each finding on a log means: its code, a log that causes it, and what to do."""

from __future__ import annotations

from robots.common.errors import ERRORS, Explanation, InputError

# By the number of the code and the name: what a finding says of the log, a log that causes it, and what to do.
_TABLE: dict[tuple[int, str], tuple[str, str, str]] = {
    (1, "absurd_value"): (
        "A number that no robot reaches, such as 1e30, stands in the log.",
        "One value of tau2 is 1e30: the logger wrote memory that it had not set.",
        "Repair or remove these rows.",
    ),
    (2, "badly_excited"): (
        "A joint moves so little or so slowly that its parameters do not explain its torque on held-out data.",
        "Joint 6 turns by a few degrees in the whole log.",
        "Record faster motions of this joint with larger torques.",
    ),
    (3, "beyond_limits"): (
        "Positions are outside the limits that the robot's description states.",
        "q3 is logged with another zero than the description has.",
        "Check zero, sign and unit of the position, and that the log belongs to this robot.",
    ),
    (4, "clipped"): (
        "A torque or current stays at one extreme value in many rows: the signal is saturated.",
        "tau2 is cut at 80 % of its largest value.",
        "Remove these rows, or record a slower motion.",
    ),
    (5, "clock_step"): (
        "The clock was set while the log was written.",
        "From row 1000 on, 30 s are added to t.",
        "The log is split there. Do not set the clock while logging.",
    ),
    (6, "columns_in_turns"): (
        "Columns have their numbers in different rows, as of several messages in one file.",
        "Odd rows have q only, even rows tau only.",
        "They are interpolated to common times. Log one message per row if the controller can.",
    ),
    (7, "columns_not_read"): (
        "The file has columns whose meaning is not known.",
        'A column named "speed_mode".',
        "State them in a mapping (--mapping) if they are needed.",
    ),
    (8, "constant_torque"): (
        "A torque has one value in all rows while the joint moves.",
        "tau1 is 3.2 in each row.",
        "Record the torque of the moving arm, and check the meaning of the column.",
    ),
    (9, "coupled_axes"): (
        "A position seems to be that of a motor that moves with another joint, as of a parallelogram or wrist.",
        "q3 is logged as q3 + q2.",
        "State the coupling in a mapping (--mapping).",
    ),
    (10, "delay"): (
        "The torque lags or leads the position.",
        "tau is shifted by three rows.",
        "Log position and torque on one clock, or shift the torque.",
    ),
    (11, "gap"): (
        "Rows are missing in time.",
        "Rows 200 to 260 are deleted.",
        "The log is split there. Let the logger write each message.",
    ),
    (12, "gravity_direction"): (
        "The base seems to stand otherwise than the robot's description says.",
        "The robot hangs from a ceiling, and is described on a floor.",
        "State the direction with --gravity.",
    ),
    (13, "hardly_moves"): (
        "A joint moves by a small part of its range.",
        "Joint 4 is held.",
        "Move the joint further: this log does not determine its inertia and friction.",
    ),
    (14, "held_torque"): (
        "The torque changes in every k-th row only, as one that is logged more slowly than the position.",
        "tau has the value of the last tenth row.",
        "It is interpolated. Log it as often as the positions if the controller can.",
    ),
    (15, "incomplete_rows"): (
        "Rows lack some numbers.",
        "Some cells of q2 are empty.",
        "They are left out. Let the logger write whole rows.",
    ),
    (16, "jitter"): (
        "The time steps vary.",
        "Random shifts of 0.3 ms are added to t.",
        "Positions are resampled to a uniform grid. Nothing to do if the time stamps are right.",
    ),
    (17, "joint_numbers"): (
        "Joints of the file are numbered otherwise than from 1.",
        "The columns are q0 to q5.",
        "All findings and results count joints from 1. Name the columns in a mapping if the order is wrong.",
    ),
    (18, "jump"): (
        "A position jumps in one sample by more than the joint can move.",
        "From row 500 on, 0.5 rad are added to q1.",
        "Cut the log there, and check the encoder and the logger.",
    ),
    (19, "late_rows"): (
        "The logger stopped for a while, and then wrote the delayed rows at once.",
        "Forty rows have nearly the same time.",
        "Their times are spread. Let the controller write the time stamps.",
    ),
    (20, "moved_by_others"): (
        "A torque balances gravity but does not accelerate the joint: somebody else moves the arm.",
        "The arm is guided by hand.",
        "Record a motion made by the drives.",
    ),
    (21, "negative_friction"): (
        "Friction delivers power in place of consuming it.",
        "The rows are in reverse order.",
        "Check the order of the rows and the meaning of the torque column.",
    ),
    (22, "no_motion"): (
        "No joint moves.",
        "The arm stands still in the whole log.",
        "Record a log in which the arm moves.",
    ),
    (23, "no_torque"): (
        "The log has neither torques nor currents, so that only its motion can be used.",
        "The columns are t and q1 to q6.",
        "Log tau or i to identify the robot.",
    ),
    (24, "nominal_error"): (
        "The torques by the robot's description are far from the measured ones, although a fit is good.",
        "tau is logged in per cent of the rated torque.",
        "Check meaning and unit of the torque columns, and the robot's description.",
    ),
    (25, "other_robot"): (
        "The log does not fit the robot's description in any order, sign, unit or direction of gravity.",
        "A log of a UR10 is checked as one of an ER3A.",
        "Check --robot, and axes and zeros of the joints in its description.",
    ),
    (26, "poorly_explained"): (
        "Rigid body and friction leave much of a torque unexplained on held-out data.",
        "A spring acts on joint 2 that the model lacks.",
        "Run oed diagnose. Check order, sign and zero of the joint.",
    ),
    (27, "position_sign"): (
        "A joint seems to turn opposite to the robot's description.",
        "q2 is logged as -q2.",
        "State `sign: [1, -1, ...]` for the position, a sign for each joint, in a mapping (--mapping), or "
        "correct the description.",
    ),
    (28, "quantised_position"): (
        "Positions are logged in coarse steps.",
        "q1 is rounded to 0.01 rad.",
        "Log positions with more digits.",
    ),
    (29, "quantised_torque"): (
        "Torques are logged in coarse steps.",
        "tau1 is rounded to 1 N m.",
        "Log torques with more digits.",
    ),
    (30, "rate"): (
        "The samples are too far apart to compute accelerations.",
        "Five rows a second.",
        "Record at 50 Hz or more.",
    ),
    (31, "repeated_rows"): (
        "Rows repeat the row before while the arm moves.",
        "Each row stands twice.",
        "They are ignored. Make the logger write each message once.",
    ),
    (32, "rounded_times"): (
        "The time is logged with few digits, so that steps seem uneven.",
        "t is rounded to 10 ms at 250 Hz.",
        "Rows are moved to uniform times. Log the time with more digits.",
    ),
    (33, "row_counter"): (
        "The time column counts rows.",
        "t is 0, 1, 2, 3.",
        "State the rate of the logger with --rate, or log the time.",
    ),
    (34, "rows_without_time"): (
        "Rows have no time, or the time 0 among others.",
        "Some cells of t are empty.",
        "They are left out. Let the logger write the time in each row.",
    ),
    (35, "same_column"): (
        "Two columns are identical.",
        "tau3 is a copy of tau2.",
        "Correct the logger: the parameters of both joints are unreliable.",
    ),
    (36, "same_rows"): (
        "Two logs share rows.",
        "One recording is given twice, under two names.",
        "Give each recording once: standard errors count these rows twice.",
    ),
    (37, "serial_days"): (
        "The time is a date in days, as spreadsheets write it.",
        "t is 45000.5, 45000.500001.",
        "It is converted to seconds. Check the digits: a day in 15 digits has a resolution of microseconds.",
    ),
    (38, "short"): (
        "The log has too few rows, or too little motion.",
        "A log of 20 rows.",
        "Record a longer log.",
    ),
    (39, "spikes"): (
        "Single values are far from their neighbours.",
        "One value in a thousand of q1 is 3 rad off.",
        "They are ignored if they are few. Repair the logger if they are many.",
    ),
    (40, "stated_rate"): (
        "The times were made from a stated rate.",
        "A CSV without t, read with --rate 250.",
        "State no rate if the file has a column of time that is right.",
    ),
    (41, "static_poses"): (
        "The arm rests in each pose that was logged.",
        "A calibration of gravity: one row per pose.",
        "Log the motions as well, at 50 Hz or more.",
    ),
    (42, "stuck"): (
        "A column keeps one value for a while, and then jumps.",
        "q2 is constant in rows 300 to 340 while the arm moves.",
        "The log is split there. Repair the logger.",
    ),
    (43, "swapped_columns"): (
        "Columns seem to be in another order.",
        "The columns of tau1 and tau2 are exchanged.",
        "State the order in a mapping (--mapping), or correct the logger.",
    ),
    (44, "too_fast"): (
        "A joint is faster than its limit.",
        "t is in units of 10 ms.",
        "Check the units of t and q, and that the log belongs to this robot.",
    ),
    (45, "torque_meaning"): (
        "The torques seem to be without gravity, of the side of the motor, currents, or in another unit.",
        "tau is what a controller adds to its compensation of gravity.",
        "State the meaning with --torque-is, or the unit with `torque: {scale: ...}` in a mapping (--mapping).",
    ),
    (46, "torque_sign"): (
        "A torque has the wrong sign: inertia and friction of the joint would be negative.",
        "tau1 is logged as -tau1.",
        "State `sign: [1, -1, ...]` for the torque, a sign for each joint, in a mapping (--mapping).",
    ),
    (47, "torque_source"): (
        "The format of a recorder was recognised. The finding says what is taken as the torque.",
        "A recording of UR RTDE.",
        "To use other columns, name them in a mapping (--mapping).",
    ),
    (48, "undetermined"): (
        "The log does not determine the inertia of some joints.",
        "All motions are slow.",
        "Add a log of faster motions.",
    ),
    (49, "unit_for_all"): (
        "One unit is stated for all joints, and does not suit some of them.",
        'The head says "deg" for all of q.',
        "State one unit per joint.",
    ),
    (50, "unit_of_position"): (
        "Positions seem to be in another unit, such as degrees.",
        "q is in degrees.",
        "State `position: {unit: deg}`, or the right unit, in a mapping (--mapping).",
    ),
    (51, "unit_of_time"): (
        "The time seems to be in another unit, such as milliseconds.",
        "t is in ms.",
        "State `time: {unit: ms}`, or the right unit, in a mapping (--mapping).",
    ),
    (52, "unit_of_torque"): (
        "The torques of the joints do not fit one robot in the same unit.",
        "tau4 to tau6 are in mN m.",
        "Set the unit of tau in a mapping (--mapping).",
    ),
    (53, "unloaded_rest"): (
        "The torque is zero while the arm stands against gravity: a brake holds it.",
        "The brakes close at the end of the motion.",
        "These rows are left out. Nothing to do.",
    ),
    (54, "unreadable_column"): (
        "A column holds text, or nothing that is a number.",
        'The cells of tau3 are "n/a".',
        "Repair the column if it is needed.",
    ),
    (55, "velocity_column"): (
        "Velocities do not fit the positions: another unit, or of another joint.",
        "dq is in degrees per second, q in rad.",
        "They are computed from the positions. Set the unit of dq.",
    ),
    (56, "wrapped_angle"): (
        "Angles are wrapped to one turn.",
        "q6 jumps from pi to -pi.",
        "Unwrap them in the logger if the joint has limits.",
    ),
    (57, "zero_torque"): (
        "The torque is zero for a while: the drive is off.",
        "tau is 0 in the first 200 rows.",
        "Remove the rows in which the drive is off.",
    ),
}

EXPLANATIONS: tuple[Explanation, ...] = tuple(
    Explanation(number=number, name=name, meaning=meaning, example=example, remedy=remedy)
    for (number, name), (meaning, example, remedy) in _TABLE.items()
)
"""All kinds of findings on logs. New ones come last: codes stay."""

CODES = {item.name: item.code for item in EXPLANATIONS}
"""Code of each finding, by its name."""


def explain(code: str) -> Explanation:
    """Finds an explanation.

    Args:
        code: a code such as OED-L014, or the name of a finding or an error.

    Raises:
        InputError: an unknown code.
    """
    wanted = code.strip()
    for item in (*EXPLANATIONS, *ERRORS):
        if wanted.upper() in (item.code, item.code.removeprefix("OED-")) or wanted == item.name:
            return item
    known = f"{EXPLANATIONS[0].code} to {EXPLANATIONS[-1].code}, codes of errors, or a name"
    raise InputError(f"no message has the code {wanted!r}", allowed=known, remedy="`oed explain` lists all codes")
