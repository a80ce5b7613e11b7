"""The page of external forces and contacts."""

from __future__ import annotations

import numpy as np

from estimation.external_forces import ForceEstimate
from oed.reports.pictures.force_pictures import external_torque_picture, load_picture, statistic_picture
from oed.reports.rendering.page import Fact, Page, Section, Table, page_of, table_of
from oed.reports.rendering.provenance import Recording
from robots.common.plain import finite


def force_page(forces: ForceEstimate, kinds: tuple[str, ...], logs: tuple[Recording, ...] = ()) -> Page:
    """Builds the page: contacts, statistic, force at the tool, and joint torques.

    Args:
        forces: the result.
        kinds: "revolute" or "prismatic" of each joint (n,).
        logs: the recording.
    """
    threshold, count = forces.calibration.threshold, len(forces.contacts)
    windows = [(contact.start, contact.end) for contact in forces.contacts]
    deviation = forces.force_deviation
    known = deviation[np.isfinite(deviation).all(axis=1)]
    level = f"{np.median(np.linalg.norm(known, axis=1)):.2g} N" if len(known) else "unknown"
    return page_of(
        forces,
        title="External forces",
        robot=forces.robot,
        logs=logs,
        facts=(
            Fact(label="Contacts", value=count),
            Fact(label="Duration", value=f"{forces.duration:.4g} s"),
            Fact(label="False alarms per hour", value=f"{threshold.rate:g}", note=_verdict(forces)),
            Fact(label="Standard deviation of the force", value=level, note="median"),
        ),
        sections=(
            Section(
                title="Contacts",
                paragraphs=(
                    f"The threshold is for {threshold.rate:g} false alarms per hour. It follows from {threshold.peaks} "
                    f"independent peaks of the residual in {threshold.seconds:.3g} s of different motion of a healthy "
                    "robot.",
                    *(f"{line[0].upper()}{line[1:]}." for line in forces.reliability.splitlines()),
                ),
                pictures=(statistic_picture(forces.t, forces.statistic, windows),),
                tables=(_contacts(forces),) if count else (),
            ),
            Section(
                title="Force at the tool",
                pictures=(load_picture(forces.t, forces.force, forces.force_deviation, windows),),
            ),
            Section(
                title="Joint torques",
                pictures=(
                    external_torque_picture(
                        forces.t,
                        forces.torque,
                        forces.direct,
                        forces.deviation,
                        windows,
                        joint_names=forces.joint_names,
                        kinds=kinds,
                    ),
                ),
            ),
        ),
    )


def _verdict(forces: ForceEstimate) -> str:
    """Whether healthy logs confirm the rate, in a word or two."""
    check = forces.calibration.check
    if check is None:
        return "not tested"
    return "confirmed" if check.confirmed else "contradicted" if check.contradicted else "not confirmed"


def _contacts(forces: ForceEstimate) -> Table:
    return table_of(
        forces.contacts,
        {
            "start [s]": lambda contact: contact.start,
            "duration [s]": lambda contact: contact.end - contact.start,
            "force [N]": lambda contact: contact.magnitude,
            "95 % from [N]": lambda contact: finite(contact.magnitude_interval[0]),
            "95 % to [N]": lambda contact: finite(contact.magnitude_interval[1]),
            "x [N]": lambda contact: contact.force[0],
            "y [N]": lambda contact: contact.force[1],
            "z [N]": lambda contact: contact.force[2],
            "joints that react": lambda contact: ", ".join(map(str, contact.place.reacting)) or None,
            "where": lambda contact: contact.place.text(forces.joint_names),
            "extrapolates": lambda contact: contact.extrapolates,
        },
        caption="Mean force at the tool along the axes of the base, as if no moment acts. The 95 % interval of its "
        "size holds noise and the model's error.",
    )
