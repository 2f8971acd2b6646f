"""Connections that open and never say what they want are let go, or enough of them would leave no room for anybody."""

from functools import cache

PATIENCE = 10.0  # seconds that a request may take to come whole


@cache
def protocol() -> type:
    """The HTTP of uvicorn, which hangs up on who keeps it waiting; a socket, once it is one, is left alone."""
    from asyncio import Transport

    from uvicorn.protocols.http.h11_impl import H11Protocol

    class Impatient(H11Protocol):
        def connection_made(self, transport: Transport) -> None:
            super().connection_made(transport)
            self.loop.call_later(PATIENCE, self._look_at_the_clock)

        def _look_at_the_clock(self) -> None:
            if self.transport.is_closing() or self.transport.get_protocol() is not self:
                return
            if self.cycle is None or self.cycle.response_complete:
                self.transport.close()
            else:
                self.loop.call_later(PATIENCE, self._look_at_the_clock)

    return Impatient
