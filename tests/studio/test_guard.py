"""Who may drive a studio: its own page, and with another host than this machine those who know the token."""

from __future__ import annotations

import http.client
from pathlib import Path

import pytest

from warpjld.page.guard import RequestGuard
from warpjld.studio.opening import opened_document
from warpjld.studio.room import Room

pytest.importorskip("viser", reason="viser is not installed")
sync = pytest.importorskip("websockets.sync.client")
exceptions = pytest.importorskip("websockets.exceptions")


def connect(room: Room, **options: object) -> None:
    port = room.server.get_port()
    import viser

    with sync.connect(f"ws://127.0.0.1:{port}/", subprotocols=[f"viser-v{viser.__version__}"], **options) as socket:
        assert socket.recv(timeout=10)


def status(room: Room, path: str = "/", headers: dict[str, str] | None = None) -> tuple[int, http.client.HTTPMessage]:
    connection = http.client.HTTPConnection("127.0.0.1", room.server.get_port(), timeout=10)
    connection.request("GET", path, headers=headers or {})
    answer = connection.getresponse()
    answer.read()
    return answer.status, answer.headers


def test_only_the_studios_own_page_connects(room: Room) -> None:
    here = room.address.rstrip("/")
    connect(room, origin=here)
    for origin in ("http://evil.example", "null", here.replace("127.0.0.1", "localhost"), None):
        with pytest.raises(exceptions.InvalidStatus) as caught:
            connect(room, origin=origin)
        assert caught.value.response.status_code == 403
    assert status(room)[0] == 200
    assert status(room, headers={"Host": "evil.example"})[0] == 403
    assert status(room, headers={"Origin": "http://evil.example"})[0] == 403
    assert status(room, "/../../etc/passwd")[0] == 404
    assert status(room, "/%2e%2e/%2e%2e/etc/passwd")[0] == 404


def test_on_the_network_only_those_with_the_token_connect(script: Path) -> None:
    room = Room(opened_document(script, script.parent / "out"), host="0.0.0.0", port=0)
    try:
        path = "/" + room.address.partition("//")[2].partition("/")[2]
        assert "?token=" in path
        assert status(room)[0] == 403
        assert status(room, "/?token=guess")[0] == 403
        code, headers = status(room, path)
        assert code == 200
        cookie = headers["Set-Cookie"]
        assert "HttpOnly" in cookie
        assert "SameSite=Strict" in cookie
        origin = f"http://127.0.0.1:{room.server.get_port()}"
        with pytest.raises(exceptions.InvalidStatus):
            connect(room, origin=origin)
        connect(room, origin=origin, additional_headers={"Cookie": cookie.partition(";")[0]})
    finally:
        room.stop()


@pytest.mark.parametrize("cookie", ["warpjld_studio=", "warpjld_studio=x; a", "=;;;", "é"])
def test_broken_cookies_are_no_token(cookie: str) -> None:
    guard = RequestGuard("10.0.0.5", "secret")
    assert guard.refuses("/", {"Host": "10.0.0.5:8080", "Cookie": cookie}) is not None
    assert guard.refuses("/?token=secret", {"Host": "10.0.0.5:8080"}) is None
    assert guard.refuses("/?token=secret", {"Host": "10.0.0.6:8080"}) is not None
