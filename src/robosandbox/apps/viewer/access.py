"""Access to the viewer: programs on this machine, and pages that the viewer itself has served."""

from __future__ import annotations

import re

from websockets.datastructures import Headers

# The names of this machine's loopback interface. The port is free, because a tunnel may have another one at its end.
_LOOPBACK = re.compile(r"(127\.0\.0\.1|localhost|\[::1\])(:\d{1,5})?", re.IGNORECASE)


def refusal(headers: Headers) -> str | None:
    """Return why a request is turned away; None lets it in.

    The Host header names what the browser believes it talks to: a name that an attacker's name server has pointed at this
    machine (DNS rebinding) is not one of the loopback's. The Origin header names the page that asks: browsers send it with
    every websocket, and only pages from the same host and port are the viewer's own. Programs send none.

    Args:
        headers: Of an HTTP request or of a websocket's opening handshake.
    """
    hosts = headers.get_all("Host")
    if len(hosts) != 1 or not _LOOPBACK.fullmatch(hosts[0]):
        return f"Host {', '.join(hosts) or 'missing'}: the viewer answers to 127.0.0.1 and localhost only\n"
    origins = headers.get_all("Origin")
    if origins and [origin.lower() for origin in origins] != [f"http://{hosts[0].lower()}"]:
        return f"Origin {', '.join(origins)}: pages of other sites may not steer the robot\n"
    return None
