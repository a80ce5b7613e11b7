"""What every talk over a motion port needs: frames out and in, and pings where they are asked for."""

from __future__ import annotations

import time

from oed.controllers.clients.traffic import Traffic
from oed.controllers.errors import ControllerError, LinkError, ProtocolError
from oed.controllers.links import Link
from oed.controllers.options import StreamOptions
from oed.exports.simple_message import Comm, Frame, Kind, MessageError, Ping, Reply, WireFormat


class Channel:
    """Sends frames over one link and decodes what comes back.

    Args:
        link: to the motion port.
        form: of the messages.
        options: of the stream.
        traffic: what happens is counted there.
    """

    def __init__(self, link: Link, form: WireFormat, options: StreamOptions, traffic: Traffic | None = None) -> None:
        self.link = link
        self.traffic = traffic or Traffic()
        self._form = form
        self._options = options
        self._last_sent = 0.0
        self._last_data = b""

    def ping(self, patience: float | None = None) -> float:
        """Pings until an answer comes, and returns its round trip [s].

        Raises:
            ProtocolError: no ping was ever answered.
            LinkError: no more answers.
        """
        data = self._form.encode(Frame(Ping(), Comm.REQUEST))
        end = time.monotonic() + (self._options.patience if patience is None else patience)
        wrong: str | None = None
        while time.monotonic() < end:
            start = time.monotonic()
            self._put(data)
            until = min(end, start + (self._options.patience if self.link.reliable else self._options.reply_time))
            while (left := until - time.monotonic()) > 0:
                try:
                    frame = self._received(left, strict=True)
                except MessageError as error:
                    wrong = str(error)
                    continue
                if frame is not None and frame.comm == Comm.REPLY and frame.message.kind == Kind.PING:
                    if frame.reply != Reply.SUCCESS:
                        raise ControllerError(f"{self.link.place} refuses a ping")
                    self.traffic.pings.append(time.monotonic() - start)
                    self._last_sent = start
                    return self.traffic.pings[-1]
        if wrong is not None:
            raise ProtocolError(f"{self.link.place} speaks another protocol or format: {wrong}")
        raise (LinkError if self.traffic.pings else ProtocolError)(
            f"{self.link.place} does not answer a ping",
            remedy="check host and motion port; a controller may know no pings: leave out --ping",
        )

    def keep_alive(self) -> None:
        """Pings if nothing was sent for half a second, without waiting long."""
        if self._options.ping and time.monotonic() - self._last_sent > 0.5:
            self.ping()

    def _put(self, data: bytes) -> None:
        self._last_data = data
        self.link.send(data)

    def _received(self, timeout: float, *, strict: bool = False) -> Frame | None:
        """Waits for a message; a datagram that is none counts as unexpected."""
        try:
            data = self.link.receive(timeout)
            if data is None:
                return None
            if data == self._last_data:
                raise ProtocolError(f"{self.link.place} sends back what it is sent: it is no simple_message controller")
            return self._form.decode(data)
        except MessageError as error:
            self.traffic.unexpected += 1
            if self.link.reliable:
                raise ProtocolError(f"{self.link.place} speaks another protocol: {error}") from error
            if strict:
                raise
            return None
