"""The closed-loop simulation of a diagnosis: what the loop had to add, and how far the motion was off."""

from __future__ import annotations

from collections.abc import Sequence

from estimation.diagnosis.simulations.simulation_result import Simulation
from oed.reports.rendering.joint_units import joint_titles, joint_units
from oed.reports.rendering.page import Cell, Section, Table
from oed.reports.rendering.picture import Line, Panel, Picture, Series


def simulation_section(simulation: Simulation, names: Sequence[str], kinds: Sequence[str]) -> Section:
    """Builds the section: a table of all joints, and the curves of the joint that changes most.

    Args:
        simulation: just made, or loaded without its curves.
        names: of the joints (n,).
        kinds: ``revolute`` or ``prismatic`` (n,).
    """
    count, loop = len(names), simulation.loop
    units = joint_units(kinds, count)
    rows: list[tuple[Cell, ...]] = []
    for j, title in enumerate(joint_titles(names, count)):
        torque = (f"{100 * float(part[j]):.3g}" for part in simulation.torque)
        motion = (f"{1e3 * float(part[j]):.3g}" for part in simulation.motion)
        rows.append((title, *torque, *motion, f"m{units[j].position}"))
    paragraphs = [
        (
            f"Forward simulation from {simulation.start:.1f} to {simulation.end:.1f} s, the part of the held-out data "
            f"in which the found effects act most. Inputs are the measured torque and the correction of a position "
            f"controller that follows the measured motion. The controller is assumed: proportional and derivative, "
            f"bandwidth {loop.bandwidth:g} Hz, damping ratio {loop.damping:g}. With a perfect model the correction is "
            f"zero."
        ),
    ]
    if simulation.note:
        paragraphs.append(simulation.note)
    table = Table(
        headings=("joint", "correction, base [%]", "extended [%]", "position error, base", "extended", "unit"),
        rows=tuple(rows),
        caption=(
            "Correction: RMS of the controller's torque divided by the torque RMS. Position error: RMS of simulated "
            "minus measured position."
        ),
        align=("left", "right", "right", "right", "right", "left"),
    )
    return Section(
        title="Simulated motion",
        paragraphs=tuple(paragraphs),
        tables=(table,),
        pictures=() if simulation.curves is None else (simulation_picture(simulation, names, kinds),),
    )


def simulation_picture(
    simulation: Simulation, names: Sequence[str], kinds: Sequence[str], *, name: str = "simulation"
) -> Picture:
    """Shows torque and position error of the base and the extended model, for the joint that changes most.

    Args:
        simulation: with its curves.
        names: of the joints (n,).
        kinds: ``revolute`` or ``prismatic`` (n,).
        name: the stem of the file name.

    Raises:
        ValueError: a simulation that was loaded from a file.
    """
    curves = simulation.curves
    if curves is None:
        raise ValueError("a simulation that was loaded from a file has no curves")
    j = simulation.telling
    unit, title = joint_units(kinds, len(names))[j], joint_titles(names, len(names))[j]
    roles = (("base model", "residual"), ("extended model", "good"))
    torque = [Series(x=curves.t, y=curves.measured[:, j], name="measured", role="measured")]
    torque += [
        Series(x=curves.t, y=part[:, j], name=label, role=role)
        for (label, role), part in zip(roles, curves.torque, strict=True)
    ]
    motion = [
        Series(x=curves.t, y=1e3 * part[:, j], name=label, role=role)
        for (label, role), part in zip(roles, curves.deviation, strict=True)
    ]
    return Picture(
        title=f"{title}, forward simulation with a position controller",
        name=name,
        panels=(
            Panel(title="Torque", x_label="time [s]", y_label=f"{unit.effort} [{unit.torque}]", series=tuple(torque)),
            Panel(
                title="Simulated minus measured position",
                x_label="time [s]",
                y_label=f"error [m{unit.position}]",
                series=tuple(motion),
                lines=(Line(value=0.0, role="neutral", dash="solid"),),
            ),
        ),
        caption="Shown is the joint whose controller correction changes most.",
    )
