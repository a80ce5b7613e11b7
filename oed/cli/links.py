"""Options of the way to a controller, shared by the commands that use it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from oed.controllers import ControllerOptions, Endpoint, StreamOptions
    from oed.exports.simple_message import WireFormat

HostOption = Annotated[
    str, typer.Option("--host", help="Name or IP address of the robot controller.", show_default=False)
]
DriverOption = Annotated[
    str | None,
    typer.Option(
        "--driver",
        help="Program on the controller: efort, fanuc, motoman, abb, egm, ur or generic. Sets what is not stated.",
        show_default=False,
    ),
]
ExternalAxesOption = Annotated[
    bool,
    typer.Option(
        "--external-axes", help="The controller has axes behind those of the robot: they stay where they are."
    ),
]
TransportOption = Annotated[str, typer.Option("--transport", help="udp or tcp.")]
MotionPortOption = Annotated[int, typer.Option("--motion-port", help="Port that takes points.")]
StatePortOption = Annotated[int, typer.Option("--state-port", help="Port that gives feedback.")]
ByteOrderOption = Annotated[str, typer.Option("--byte-order", help="Byte order of the controller: little or big.")]
RealBytesOption = Annotated[int, typer.Option("--real-bytes", help="Bytes of a real number: 4 or 8.")]
HandshakeOption = Annotated[
    str, typer.Option("--handshake", help="Byte that opens a link by UDP; 0xFF for old controllers.")
]
PatienceOption = Annotated[
    float, typer.Option("--patience", help="Longest silence of the controller before giving up [s].")
]
PointsOption = Annotated[str, typer.Option("--points", help="full: JOINT_TRAJ_PT_FULL, short: JOINT_TRAJ_PT.")]
DownloadOption = Annotated[
    bool, typer.Option("--download", help="Send all points at once, without replies; the robot starts afterwards.")
]
WindowOption = Annotated[
    int, typer.Option("--window", help="Points on their way at once, if the controller's replies repeat the point.")
]
StartToleranceOption = Annotated[
    float, typer.Option("--start-tolerance", help="Farthest pose from the first point [rad or m].")
]
ToleranceOption = Annotated[
    str | None,
    typer.Option(
        "--tolerance",
        help="Farthest feedback from the plan [rad or m], for all joints or each, or inf. Default: 0.05 rad, 0.02 m.",
        show_default=False,
    ),
]
PingOption = Annotated[
    bool,
    typer.Option(
        "--ping/--no-ping", help="Ping the motion port. Some drivers, as Fanuc's, read pings as points and move."
    ),
]
SpeedOption = Annotated[
    float, typer.Option("--speed", help="How many times faster than real time the controller to test against plays.")
]
LINK_OPTIONS = (
    *("driver", "transport", "motion_port", "state_port", "byte_order", "real_bytes", "handshake"),
    *("points", "download", "window", "patience", "start_tolerance", "tolerance", "ping", "speed"),
)
"""Parameters that concern the way to a controller."""


def wire_format(byte_order: str, real_bytes: int) -> WireFormat:
    """Makes the format of messages.

    Raises:
        InputError: another byte order or size.
    """
    from oed.exports.simple_message import WireFormat

    return WireFormat(byte_order=byte_order, real_bytes=real_bytes)  # type: ignore[arg-type]


def one_byte(text: str) -> int:
    """Reads one byte, decimal or as 0x8E.

    Raises:
        InputError: the text is no number.
    """
    from robots.common.errors import InputError

    try:
        return int(text, 0)
    except ValueError:
        raise InputError(f"--handshake {text}", allowed="one byte, such as 0x8E or 0xFF") from None


def endpoint(context: typer.Context, host: str) -> Endpoint:
    """Makes the endpoint that the options of a command name.

    Raises:
        InputError: an option out of range.
    """
    from oed.controllers import Endpoint
    from oed.controllers.drivers import driver_of

    name = context.params["driver"]
    settings = link_settings(context)
    return Endpoint(host=host, **settings) if name is None else Endpoint.of(driver_of(name), host, **settings)


def link_settings(context: typer.Context) -> dict[str, Any]:
    """Gives the settings of a link that the options name: all of them, or with a driver those that are stated."""
    found: dict[str, Any] = stated(context, "transport", "motion_port", "state_port")
    driver = context.params["driver"]
    if driver is None or stated(context, "byte_order", "real_bytes"):
        found["form"] = wire_format(context.params["byte_order"], context.params["real_bytes"])
    if stated(context, "handshake"):
        found["handshake"] = one_byte(context.params["handshake"])
    return found


def stream_options(context: typer.Context, **settings: Any) -> StreamOptions:
    """Makes the settings of a stream that the options of a command name.

    Args:
        context: of the command.
        settings: those that only this command has.

    Raises:
        InputError: an option out of range, or one that a driver misreads.
    """
    from oed.controllers import StreamOptions
    from oed.controllers.drivers import driver_of

    shared = ("window", "patience", "start_tolerance", "ping")
    settings |= {name: context.params[name] for name in shared} | stated(context, "points", "download")
    settings["tolerance"] = path_tolerance(context.params["tolerance"])
    name = context.params["driver"]
    return StreamOptions(**settings) if name is None else StreamOptions.of(driver_of(name), **settings)


def controller_options(context: typer.Context, **settings: Any) -> ControllerOptions:
    """Makes the settings of the test controller that the options name.

    Args:
        context: of the command.
        settings: those that no driver sets.

    Raises:
        InputError: an option out of range.
    """
    from oed.controllers import ControllerOptions
    from oed.controllers.drivers import driver_of

    settings |= link_settings(context) | stated(context, "capacity", "feedback", "feedback_period", "replies")
    name = context.params["driver"]
    return ControllerOptions(**settings) if name is None else ControllerOptions.of(driver_of(name), **settings)


def stated(context: typer.Context, *names: str) -> dict[str, Any]:
    """Gives the options that count: all where no driver is named, otherwise those that are not left to it."""
    every = context.params["driver"] is None
    sources = {name: context.get_parameter_source(name) for name in names if name in context.params}
    return {
        name: context.params[name]
        for name, source in sources.items()
        if every or (source is not None and source.name != "DEFAULT")
    }


def refuse_without_host(context: typer.Context, host: str) -> None:
    """Refuses options of the way to a controller where none is played on.

    Args:
        context: of the command.
        host: the option that names the controller.

    Raises:
        InputError: naming the options.
    """
    from robots.common.errors import InputError

    given = [f"--{name.replace('_', '-')}" for name in LINK_OPTIONS if is_given(context, name)]
    if given:
        verb = "does" if len(given) == 1 else "do"
        raise InputError(f"{', '.join(given)} {verb} not apply without {host}", remedy=f"add {host} HOST")


def path_tolerance(text: str | None) -> tuple[float, ...] | None:
    """Reads ``--tolerance``; one number counts for all joints.

    Raises:
        InputError: the text is no list of numbers.
    """
    from oed.cli.options import numbers

    return None if text is None else tuple(numbers("--tolerance", text) or ())


def is_given(context: typer.Context, name: str) -> bool:
    """Whether an option stands on the command line."""
    source = context.get_parameter_source(name)
    return source is not None and source.name == "COMMANDLINE"
