"""Access control of the studio's server: only its own pages may connect, and over the network only with its token.

A browser lets any page open a WebSocket to any address, including this machine's, and sends the page's origin along. A
request is therefore accepted only if its ``Origin`` is the host it is made to, and if that host is the server's address
(otherwise a foreign host name that resolves to this machine would pass: DNS rebinding).
"""

from __future__ import annotations

import hmac
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from http.cookies import CookieError, SimpleCookie
from typing import Any
from urllib.parse import parse_qs, urlsplit

from warpjld.page.software_drawing import add_to_page

__all__ = ["RequestGuard", "guarding"]

_COOKIE = "warpjld_studio"
_HERE = ("127.0.0.1", "localhost", "::1")


@dataclass(frozen=True)
class RequestGuard:
    """Decides which requests are answered.

    Attributes:
        host: The address that the server listens on.
        token: Token that pages must send, in the address or as the cookie they then get; None: no token needed.
        framed: Whether pages of this machine, such as notebooks, may embed it in a frame.
    """

    host: str
    token: str | None = None
    framed: bool = False

    def refuses(self, path: str, headers: Mapping[str, str]) -> str | None:
        """Reason to refuse a request for this path with these headers; None to accept it."""
        host = headers.get("Host", "")
        if not self._is_mine(host):
            return "the host name in the request is not that of this server"
        origin = headers.get("Origin")
        upgrades = headers.get("Upgrade", "").lower() == "websocket"
        if upgrades and origin is None:
            return "a WebSocket connection needs an Origin header"
        if origin is not None and urlsplit(origin).netloc.lower() != host.lower():
            return "only the studio's own page may connect"
        if self.token is not None and not self._knows(path, headers):
            return "the address lacks its token: take the whole address that the studio printed"
        return None

    def cookie(self, path: str) -> str | None:
        """Value of the cookie header for a page with the token in its address; None for other pages."""
        if self.token is None or not _same(_token_in(path), self.token):
            return None
        return f"{_COOKIE}={self.token}; HttpOnly; SameSite=Strict; Path=/"

    @property
    def ancestors(self) -> str:
        """Value of the CSP directive ``frame-ancestors``: pages that may embed the server's pages."""
        return "frame-ancestors 'self'" + (" http://localhost:* http://127.0.0.1:*" if self.framed else "")

    def _is_mine(self, host: str) -> bool:
        try:
            name = urlsplit(f"//{host}").hostname or ""
        except ValueError:
            return False
        if self.host in _HERE:
            return name in _HERE
        # listening on all interfaces, the machine has names it does not know: the token decides
        return self.host in ("0.0.0.0", "::") or name == self.host.lower()

    def _knows(self, path: str, headers: Mapping[str, str]) -> bool:
        cookies: SimpleCookie = SimpleCookie()
        try:
            cookies.load(headers.get("Cookie", ""))
        except CookieError:
            return False
        kept = cookies[_COOKIE].value if _COOKIE in cookies else ""
        assert self.token is not None
        return _same(_token_in(path), self.token) or _same(kept, self.token)


def _token_in(path: str) -> str:
    return parse_qs(urlsplit(path).query).get("token", [""])[0]


def _same(given: str, token: str) -> bool:
    return hmac.compare_digest(given.encode(), token.encode())


@contextmanager
def guarding(guard: RequestGuard) -> Iterator[None]:
    """Context in which a viser server that is created asks this guard first.

    viser has no hook for this, so the handler that it passes to ``websockets`` is wrapped.
    """
    import websockets.asyncio.server as websockets_server

    original = websockets_server.serve

    def serve(handler: Any, host: str, port: int, **options: Any) -> Any:
        options["process_request"] = _first(guard, options["process_request"])
        return original(handler, host, port, **options)

    websockets_server.serve = serve
    try:
        yield
    finally:
        websockets_server.serve = original


def _first(guard: RequestGuard, answer: Callable[[Any, Any], Any]) -> Callable[[Any, Any], Any]:
    """Request handler that asks the guard before ``answer``."""
    changed: dict[bytes, bytes] = {}

    def process(connection: Any, request: Any) -> Any:
        reason = guard.refuses(request.path, request.headers)
        if reason is not None:
            return connection.respond(403, reason + "\n")
        response = answer(connection, request)
        cookie = guard.cookie(request.path)
        if response is not None:
            add_to_page(response, changed)
            response.headers["Content-Security-Policy"] = guard.ancestors
            response.headers["Referrer-Policy"] = "no-referrer"
            if cookie is not None:
                response.headers["Set-Cookie"] = cookie
        return response

    return process
