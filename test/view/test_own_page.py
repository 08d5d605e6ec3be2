"""The page hears itself alone: no other site, no other name, on a real server."""

import socket
from contextlib import nullcontext
from string import ascii_lowercase

import pytest
from hypothesis import given
from hypothesis import strategies as st

pytest.importorskip("viser")

from websockets.datastructures import Headers

from cable_sim_ros.tools.view import page
from cable_sim_ros.tools.view.page import _machine, own

SOCKET = {"Upgrade": "websocket", "Connection": "Upgrade", "Sec-WebSocket-Version": "13",
          "Sec-WebSocket-Key": "AAAAAAAAAAAAAAAAAAAAAA=="}  # fmt: skip


def asked(host, origin=None, at="127.0.0.1", upgrade=True):
    fields = {"Host": host, "Origin": origin, "Upgrade": "websocket" if upgrade else None}
    return own(Headers({name: text for name, text in fields.items() if text is not None}), at)


@pytest.mark.parametrize("name", ["127.0.0.1:8080", "localhost:8080", "LOCALHOST:9000", "localhost", "[::1]:8080"])
def test_this_machine_is_its_own_also_at_the_port_of_a_tunnel(name):
    assert asked(name, f"http://{name}") and asked(name, upgrade=False)
    assert not asked(name), "a websocket of a browser says whence it is"
    assert not asked(name, "http://localhost:3000") and not asked(name, "null") and not asked(name, f"ftp://{name}")


words = st.text(ascii_lowercase + "0123456789-", min_size=1, max_size=12)


@given(st.lists(words, min_size=2, max_size=4).map(".".join), st.integers(1, 65535))
def test_a_name_turned_to_this_address_is_not(name, port):
    """DNS rebinding: Host and Origin agree, and the name is of somebody else."""
    if name not in _machine() and name != "127.0.0.1":
        for at in ("127.0.0.1", "localhost", "::1", "192.0.2.7", "tow.example"):
            assert asked(f"{name}:{port}", f"http://{name}:{port}", at) is (at == name)
        assert not asked(f"127.0.0.1.{name}:{port}", f"http://127.0.0.1.{name}:{port}", "0.0.0.0")


@given(st.text(st.characters(min_codepoint=33, max_codepoint=126), max_size=20))
def test_what_is_no_host_is_not(text):
    assert not asked(f"a{text}@localhost", f"http://a{text}@localhost") and not asked(f"localhost:x{text}")


def test_a_page_for_all_has_addresses_and_names_of_the_machine():
    for name in ("192.0.2.7:8080", "[2001:db8::1]:8080", f"{socket.gethostname()}:8080"):
        assert asked(name, f"http://{name}", "0.0.0.0") and asked(name, f"http://{name}", "::")
    assert not asked("192.0.2.7:8080", "http://192.0.2.7:8080") and not asked("x:8080", "http://x:8080", "0.0.0.0")
    assert not own(Headers([("Host", "localhost"), ("Host", "evil.example")]), "127.0.0.1")


@pytest.fixture(scope="module")
def server():
    made = page.serve("127.0.0.1", 0, "a page")
    yield made.get_port()
    made.stop()


@pytest.mark.parametrize(
    "host, origin, answer",
    [
        ("127.0.0.1:{}", "http://127.0.0.1:{}", 101),
        ("localhost:9", "http://localhost:9", 101),
        ("127.0.0.1:{}", "http://evil.example", 403),
        ("evil.example:{}", "http://evil.example:{}", 403),
        ("127.0.0.1:{}", None, 403),
    ],
)
def test_the_server_asks(server, host, origin, answer):
    lines = ["GET / HTTP/1.1", f"Host: {host.format(server)}", *(f"{name}: {text}" for name, text in SOCKET.items())]
    lines += [f"Origin: {origin.format(server)}"] if origin else []
    with socket.create_connection(("127.0.0.1", server)) as one:
        one.sendall("\r\n".join([*lines, "", ""]).encode())
        assert one.recv(64).split()[1] == str(answer).encode()


def test_a_viser_that_serves_otherwise_is_refused(monkeypatch):
    monkeypatch.setattr("cable_sim_ros.tools.view.page.guarded", lambda host: nullcontext(lambda: False))
    with pytest.raises(page.PageError, match="serves its page in a way that is not known here"):
        page.serve("127.0.0.1", 0, "a page")
