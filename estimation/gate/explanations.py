"""What each finding on a log means: its code, a log that causes it, and what to do."""

from __future__ import annotations

from robots.common.errors import ERRORS, Explanation, InputError

EXPLANATIONS: tuple[Explanation, ...] = (
    Explanation(
        number=1,
        name="absurd_value",
        meaning="A number that no robot reaches, such as 1e30, stands in the log.",
        example="One value of tau2 is 1e30: the logger wrote memory that it had not set.",
        remedy="Repair or remove these rows.",
    ),
    Explanation(
        number=2,
        name="badly_excited",
        meaning="A joint moves so little or so slowly that its parameters do not explain its torque on held-out data.",
        example="Joint 6 turns by a few degrees in the whole log.",
        remedy="Record faster motions of this joint with larger torques.",
    ),
    Explanation(
        number=3,
        name="beyond_limits",
        meaning="Positions are outside the limits that the robot's description states.",
        example="q3 is logged with another zero than the description has.",
        remedy="Check zero, sign and unit of the position, and that the log belongs to this robot.",
    ),
    Explanation(
        number=4,
        name="clipped",
        meaning="A torque or current stays at one extreme value in many rows: the signal is saturated.",
        example="tau2 is cut at 80 % of its largest value.",
        remedy="Remove these rows, or record a slower motion.",
    ),
    Explanation(
        number=5,
        name="clock_step",
        meaning="The clock was set while the log was written.",
        example="From row 1000 on, 30 s are added to t.",
        remedy="The log is split there. Do not set the clock while logging.",
    ),
    Explanation(
        number=6,
        name="columns_in_turns",
        meaning="Columns have their numbers in different rows, as of several messages in one file.",
        example="Odd rows have q only, even rows tau only.",
        remedy="They are interpolated to common times. Log one message per row if the controller can.",
    ),
    Explanation(
        number=7,
        name="columns_not_read",
        meaning="The file has columns whose meaning is not known.",
        example='A column named "speed_mode".',
        remedy="State them in a mapping (--mapping) if they are needed.",
    ),
    Explanation(
        number=8,
        name="constant_torque",
        meaning="A torque has one value in all rows while the joint moves.",
        example="tau1 is 3.2 in each row.",
        remedy="Record the torque of the moving arm, and check the meaning of the column.",
    ),
    Explanation(
        number=9,
        name="coupled_axes",
        meaning="A position seems to be that of a motor that moves with another joint, as of a parallelogram or wrist.",
        example="q3 is logged as q3 + q2.",
        remedy="State the coupling in a mapping (--mapping).",
    ),
    Explanation(
        number=10,
        name="delay",
        meaning="The torque lags or leads the position.",
        example="tau is shifted by three rows.",
        remedy="Log position and torque on one clock, or shift the torque.",
    ),
    Explanation(
        number=11,
        name="gap",
        meaning="Rows are missing in time.",
        example="Rows 200 to 260 are deleted.",
        remedy="The log is split there. Let the logger write each message.",
    ),
    Explanation(
        number=12,
        name="gravity_direction",
        meaning="The base seems to stand otherwise than the robot's description says.",
        example="The robot hangs from a ceiling, and is described on a floor.",
        remedy="State the direction with --gravity.",
    ),
    Explanation(
        number=13,
        name="hardly_moves",
        meaning="A joint moves by a small part of its range.",
        example="Joint 4 is held.",
        remedy="Move the joint further: this log does not determine its inertia and friction.",
    ),
    Explanation(
        number=14,
        name="held_torque",
        meaning="The torque changes in every k-th row only, as one that is logged more slowly than the position.",
        example="tau has the value of the last tenth row.",
        remedy="It is interpolated. Log it as often as the positions if the controller can.",
    ),
    Explanation(
        number=15,
        name="incomplete_rows",
        meaning="Rows lack some numbers.",
        example="Some cells of q2 are empty.",
        remedy="They are left out. Let the logger write whole rows.",
    ),
    Explanation(
        number=16,
        name="jitter",
        meaning="The time steps vary.",
        example="Random shifts of 0.3 ms are added to t.",
        remedy="Positions are resampled to a uniform grid. Nothing to do if the time stamps are right.",
    ),
    Explanation(
        number=17,
        name="joint_numbers",
        meaning="Joints of the file are numbered otherwise than from 1.",
        example="The columns are q0 to q5.",
        remedy="All findings and results count joints from 1. Name the columns in a mapping if the order is wrong.",
    ),
    Explanation(
        number=18,
        name="jump",
        meaning="A position jumps in one sample by more than the joint can move.",
        example="From row 500 on, 0.5 rad are added to q1.",
        remedy="Cut the log there, and check the encoder and the logger.",
    ),
    Explanation(
        number=19,
        name="late_rows",
        meaning="The logger stopped for a while, and then wrote the delayed rows at once.",
        example="Forty rows have nearly the same time.",
        remedy="Their times are spread. Let the controller write the time stamps.",
    ),
    Explanation(
        number=20,
        name="moved_by_others",
        meaning="A torque balances gravity but does not accelerate the joint: somebody else moves the arm.",
        example="The arm is guided by hand.",
        remedy="Record a motion made by the drives.",
    ),
    Explanation(
        number=21,
        name="negative_friction",
        meaning="Friction delivers power in place of consuming it.",
        example="The rows are in reverse order.",
        remedy="Check the order of the rows and the meaning of the torque column.",
    ),
    Explanation(
        number=22,
        name="no_motion",
        meaning="No joint moves.",
        example="The arm stands still in the whole log.",
        remedy="Record a log in which the arm moves.",
    ),
    Explanation(
        number=23,
        name="no_torque",
        meaning="The log has neither torques nor currents, so that only its motion can be used.",
        example="The columns are t and q1 to q6.",
        remedy="Log tau or i to identify the robot.",
    ),
    Explanation(
        number=24,
        name="nominal_error",
        meaning="The torques by the robot's description are far from the measured ones, although a fit is good.",
        example="tau is logged in per cent of the rated torque.",
        remedy="Check meaning and unit of the torque columns, and the robot's description.",
    ),
    Explanation(
        number=25,
        name="other_robot",
        meaning="The log does not fit the robot's description in any order, sign, unit or direction of gravity.",
        example="A log of a UR10 is checked as one of an ER3A.",
        remedy="Check --robot, and axes and zeros of the joints in its description.",
    ),
    Explanation(
        number=26,
        name="poorly_explained",
        meaning="Rigid body and friction leave much of a torque unexplained on held-out data.",
        example="A spring acts on joint 2 that the model lacks.",
        remedy="Run oed diagnose. Check order, sign and zero of the joint.",
    ),
    Explanation(
        number=27,
        name="position_sign",
        meaning="A joint seems to turn opposite to the robot's description.",
        example="q2 is logged as -q2.",
        remedy="State `sign: [1, -1, ...]` for the position, a sign for each joint, in a mapping (--mapping), or "
        "correct the description.",
    ),
    Explanation(
        number=28,
        name="quantised_position",
        meaning="Positions are logged in coarse steps.",
        example="q1 is rounded to 0.01 rad.",
        remedy="Log positions with more digits.",
    ),
    Explanation(
        number=29,
        name="quantised_torque",
        meaning="Torques are logged in coarse steps.",
        example="tau1 is rounded to 1 N m.",
        remedy="Log torques with more digits.",
    ),
    Explanation(
        number=30,
        name="rate",
        meaning="The samples are too far apart to compute accelerations.",
        example="Five rows a second.",
        remedy="Record at 50 Hz or more.",
    ),
    Explanation(
        number=31,
        name="repeated_rows",
        meaning="Rows repeat the row before while the arm moves.",
        example="Each row stands twice.",
        remedy="They are ignored. Make the logger write each message once.",
    ),
    Explanation(
        number=32,
        name="rounded_times",
        meaning="The time is logged with few digits, so that steps seem uneven.",
        example="t is rounded to 10 ms at 250 Hz.",
        remedy="Rows are moved to uniform times. Log the time with more digits.",
    ),
    Explanation(
        number=33,
        name="row_counter",
        meaning="The time column counts rows.",
        example="t is 0, 1, 2, 3.",
        remedy="State the rate of the logger with --rate, or log the time.",
    ),
    Explanation(
        number=34,
        name="rows_without_time",
        meaning="Rows have no time, or the time 0 among others.",
        example="Some cells of t are empty.",
        remedy="They are left out. Let the logger write the time in each row.",
    ),
    Explanation(
        number=35,
        name="same_column",
        meaning="Two columns are identical.",
        example="tau3 is a copy of tau2.",
        remedy="Correct the logger: the parameters of both joints are unreliable.",
    ),
    Explanation(
        number=36,
        name="same_rows",
        meaning="Two logs share rows.",
        example="One recording is given twice, under two names.",
        remedy="Give each recording once: standard errors count these rows twice.",
    ),
    Explanation(
        number=37,
        name="serial_days",
        meaning="The time is a date in days, as spreadsheets write it.",
        example="t is 45000.5, 45000.500001.",
        remedy="It is converted to seconds. Check the digits: a day in 15 digits has a resolution of microseconds.",
    ),
    Explanation(
        number=38,
        name="short",
        meaning="The log has too few rows, or too little motion.",
        example="A log of 20 rows.",
        remedy="Record a longer log.",
    ),
    Explanation(
        number=39,
        name="spikes",
        meaning="Single values are far from their neighbours.",
        example="One value in a thousand of q1 is 3 rad off.",
        remedy="They are ignored if they are few. Repair the logger if they are many.",
    ),
    Explanation(
        number=40,
        name="stated_rate",
        meaning="The times were made from a stated rate.",
        example="A CSV without t, read with --rate 250.",
        remedy="State no rate if the file has a column of time that is right.",
    ),
    Explanation(
        number=41,
        name="static_poses",
        meaning="The arm rests in each pose that was logged.",
        example="A calibration of gravity: one row per pose.",
        remedy="Log the motions as well, at 50 Hz or more.",
    ),
    Explanation(
        number=42,
        name="stuck",
        meaning="A column keeps one value for a while, and then jumps.",
        example="q2 is constant in rows 300 to 340 while the arm moves.",
        remedy="The log is split there. Repair the logger.",
    ),
    Explanation(
        number=43,
        name="swapped_columns",
        meaning="Columns seem to be in another order.",
        example="The columns of tau1 and tau2 are exchanged.",
        remedy="State the order in a mapping (--mapping), or correct the logger.",
    ),
    Explanation(
        number=44,
        name="too_fast",
        meaning="A joint is faster than its limit.",
        example="t is in units of 10 ms.",
        remedy="Check the units of t and q, and that the log belongs to this robot.",
    ),
    Explanation(
        number=45,
        name="torque_meaning",
        meaning="The torques seem to be without gravity, of the side of the motor, or currents.",
        example="tau is what a controller adds to its compensation of gravity.",
        remedy="State the meaning with --torque-is.",
    ),
    Explanation(
        number=46,
        name="torque_sign",
        meaning="A torque has the wrong sign: inertia and friction of the joint would be negative.",
        example="tau1 is logged as -tau1.",
        remedy="State `sign: [1, -1, ...]` for the torque, a sign for each joint, in a mapping (--mapping).",
    ),
    Explanation(
        number=47,
        name="torque_source",
        meaning="The format of a recorder was recognised. The finding says what is taken as the torque.",
        example="A recording of UR RTDE.",
        remedy="To use other columns, name them in a mapping (--mapping).",
    ),
    Explanation(
        number=48,
        name="undetermined",
        meaning="The log does not determine the inertia of some joints.",
        example="All motions are slow.",
        remedy="Add a log of faster motions.",
    ),
    Explanation(
        number=49,
        name="unit_for_all",
        meaning="One unit is stated for all joints, and does not suit some of them.",
        example='The head says "deg" for all of q.',
        remedy="State one unit per joint.",
    ),
    Explanation(
        number=50,
        name="unit_of_position",
        meaning="Positions seem to be in another unit, such as degrees.",
        example="q is in degrees.",
        remedy="State `position: {unit: deg}`, or the right unit, in a mapping (--mapping).",
    ),
    Explanation(
        number=51,
        name="unit_of_time",
        meaning="The time seems to be in another unit, such as milliseconds.",
        example="t is in ms.",
        remedy="State `time: {unit: ms}`, or the right unit, in a mapping (--mapping).",
    ),
    Explanation(
        number=52,
        name="unit_of_torque",
        meaning="The torques of the joints do not fit one robot in the same unit.",
        example="tau4 to tau6 are in mN m.",
        remedy="Set the unit of tau in a mapping (--mapping).",
    ),
    Explanation(
        number=53,
        name="unloaded_rest",
        meaning="The torque is zero while the arm stands against gravity: a brake holds it.",
        example="The brakes close at the end of the motion.",
        remedy="These rows are left out. Nothing to do.",
    ),
    Explanation(
        number=54,
        name="unreadable_column",
        meaning="A column holds text, or nothing that is a number.",
        example='The cells of tau3 are "n/a".',
        remedy="Repair the column if it is needed.",
    ),
    Explanation(
        number=55,
        name="velocity_column",
        meaning="Velocities do not fit the positions: another unit, or of another joint.",
        example="dq is in degrees per second, q in rad.",
        remedy="They are computed from the positions. Set the unit of dq.",
    ),
    Explanation(
        number=56,
        name="wrapped_angle",
        meaning="Angles are wrapped to one turn.",
        example="q6 jumps from pi to -pi.",
        remedy="Unwrap them in the logger if the joint has limits.",
    ),
    Explanation(
        number=57,
        name="zero_torque",
        meaning="The torque is zero for a while: the drive is off.",
        example="tau is 0 in the first 200 rows.",
        remedy="Remove the rows in which the drive is off.",
    ),
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
