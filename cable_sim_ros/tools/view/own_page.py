"""Who may speak to the page: the page itself, under a name of its own.

A browser opens a websocket of any site to any address. Its Origin says of which site it is, its Host by which name it
came here: a foreign site has another Origin, and one that turned its own name to this address (DNS rebinding) a Host
that is no name of this machine.
"""

from __future__ import annotations

import ipaddress
import socket
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import lru_cache
from http import HTTPStatus
from typing import Any
from urllib.parse import urlsplit

LOOPBACK = ("127.0.0.1", "localhost", "::1")
ALL = ("0.0.0.0", "::", "")  # hosts that are every address of the machine
REFUSED = "This is not the address of this page, or another site asks for it.\n"


def own(headers: Any, host: str) -> bool:
    """Is a request of the page that is served at host, by its headers (websockets.Headers)?

    Host: once, and a name of it with any port, as ssh -L has another. Origin: the same place; a websocket has one.
    """
    hosts, origins = headers.get_all("Host"), headers.get_all("Origin")
    if len(hosts) != 1 or not _named(hosts[0], host):
        return False
    if not origins and "Upgrade" not in headers:
        return True  # a page that is typed in
    return len(origins) == 1 and origins[0].lower() in (f"http://{hosts[0]}".lower(), f"https://{hosts[0]}".lower())


def _named(asked: str, host: str) -> bool:
    """Is what Host says a name of the page?"""
    try:
        parts = urlsplit(f"//{asked}")
        name, _ = (parts.hostname or "").rstrip("."), parts.port
    except ValueError:  # a port that is none, an address that is not closed
        return False
    if parts.netloc != asked or "@" in asked:
        return False
    if name in (*LOOPBACK, host.lower()):
        return True
    if host in LOOPBACK:
        return False
    if host in ALL and _address(name):
        return True  # no name, so nobody can have turned it here
    return name in _machine()


@lru_cache(maxsize=1)
def _machine() -> set[str]:
    """Names of this machine; the longest may have to be asked for in the network."""
    short = socket.gethostname().lower()
    return {short, f"{short}.local", socket.getfqdn().lower()}


def _address(name: str) -> bool:
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return True


@contextmanager
def guarded(host: str) -> Iterator[Callable[[], bool]]:
    """Servers of websockets that are started meanwhile answer 403 to what is not `own`; gives: was one started?"""
    import websockets.asyncio.server as server

    serve, started = server.serve, []

    def with_guard(*args: Any, process_request: Any = None, **options: Any) -> Any:
        started.append(True)

        def first(connection: Any, request: Any) -> Any:
            if not own(request.headers, host):
                return connection.respond(HTTPStatus.FORBIDDEN, REFUSED)
            return process_request(connection, request) if process_request is not None else None

        return serve(*args, process_request=first, **options)

    server.serve = with_guard  # type: ignore[misc,assignment]
    try:
        yield lambda: bool(started)
    finally:
        server.serve = serve  # type: ignore[misc]
