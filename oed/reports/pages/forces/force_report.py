"""The page of external forces and contacts."""

from __future__ import annotations

import numpy as np

from estimation.external_forces import ForceEstimate
from oed.reports.pictures.force_pictures import external_torque_picture, load_picture, statistic_picture
from oed.reports.rendering.page import Cell, Fact, Page, Section, Table
from oed.reports.rendering.saving import footer, save_page
from robots.common.files import ResultFolder
from robots.common.plain import finite


def save_force_report(
    forces: ForceEstimate, folder: ResultFolder, *, kinds: tuple[str, ...], png: bool = False
) -> None:
    """Writes the page of external forces, and its pictures as PNG on request.

    Args:
        forces: the result.
        folder: for the files.
        kinds: "revolute" or "prismatic" of each joint (n,).
        png: whether to write the pictures as PNG too.
    """
    save_page(force_page(forces, kinds), folder, png=png)


def force_page(forces: ForceEstimate, kinds: tuple[str, ...]) -> Page:
    """Builds the page: contacts, statistic, force at the tool, and joint torques.

    Args:
        forces: the result.
        kinds: "revolute" or "prismatic" of each joint (n,).
    """
    threshold, count = forces.calibration.threshold, len(forces.contacts)
    windows = [(contact.start, contact.end) for contact in forces.contacts]
    largest = max(forces.contacts, key=lambda contact: contact.magnitude, default=None)
    verdict = "No contact." if largest is None else "One contact" if count == 1 else f"{count} contacts"
    if largest is not None:
        verdict += f", at {largest.start:.4g} s" if count == 1 else f", the largest at {largest.start:.4g} s"
        verdict += f" with {largest.magnitude:.3g} N at the tool."
    deviation = forces.force_deviation
    known = deviation[np.isfinite(deviation).all(axis=1)]
    level = f"{np.median(np.linalg.norm(known, axis=1)):.2g} N" if len(known) else "unknown"
    return Page(
        title=f"External forces on {forces.robot}",
        verdict=verdict,
        status="warning" if count else "good",
        facts=(
            Fact(label="contacts", value=count),
            Fact(label="duration", value=f"{forces.duration:.4g} s"),
            Fact(label="false alarms per hour", value=f"{threshold.rate:g}"),
            Fact(label="standard deviation of the force", value=level, note="median"),
        ),
        warnings=forces.warnings,
        sections=(
            Section(
                title="Contacts",
                paragraphs=(
                    f"The threshold is passed {threshold.rate:g} times per hour without a contact. It follows from "
                    f"{threshold.peaks} independent peaks of the residual in {threshold.seconds:.3g} s of a healthy "
                    "robot.",
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
        footer=footer(),
    )


def _contacts(forces: ForceEstimate) -> Table:
    rows: list[tuple[Cell, ...]] = [
        (
            contact.start,
            contact.end - contact.start,
            contact.magnitude,
            finite(contact.magnitude_deviation),
            *contact.force.tolist(),
            ", ".join(map(str, contact.place.reacting)) or None,
            contact.place.text(forces.joint_names),
            contact.extrapolates,
        )
        for contact in forces.contacts
    ]
    return Table(
        headings=(
            *("start [s]", "duration [s]", "force [N]", "standard deviation [N]", "x [N]", "y [N]", "z [N]"),
            *("joints that react", "where", "extrapolates"),
        ),
        rows=tuple(rows),
        caption="Mean force at the tool along the axes of the base, as if no moment acts.",
    )
