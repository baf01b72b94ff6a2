"""Addresses, ports, the browser, and which requests are answered."""

from __future__ import annotations

import socket
import webbrowser
from email.message import Message

import pytest
from hypothesis import given
from hypothesis import strategies as st

from shadowpuppet import network
from shadowpuppet.errors import SettingsError
from shadowpuppet.network import (
    Connections,
    are_origins_allowed,
    has_screen,
    host_and_port,
    is_loopback,
    is_own_host,
    is_same_origin,
    known_host,
    open_browser,
    open_page,
    shown_host,
)

ADDRESSES = st.ip_addresses()


def request(*headers: tuple[str, str]) -> Message:
    """A request's headers, any of them repeatedly."""
    message = Message()
    for name, value in headers:
        message[name] = value
    return message


# Addresses


@given(host=st.one_of(ADDRESSES.map(str), st.just("studio")), port=st.integers(0, 65535))
def test_a_host_and_a_port_are_read_as_written(host, port):
    written = f"[{host}]" if ":" in host else host
    assert host_and_port(f"{written}:{port}", "osc") == (host, port)
    assert host_and_port(str(port), "osc") == ("127.0.0.1", port)


@pytest.mark.parametrize("text", ["65536", "studio:65536", "39539x", "::1", "::1:80", "[::1:80", "::1]:80", "[studio]:80", ":39539",
                                  "", "studio", "-1", "\u0663"])
def test_what_is_no_host_and_port_is_refused(text):
    with pytest.raises(SettingsError, match=r"osc: found .*, expected a port, or host:port, such as"):
        host_and_port(text, "osc")


@pytest.mark.parametrize(("address", "alone"), [("127.0.0.1", True), ("::1", True), ("localhost", True), ("0.0.0.0", False), ("::", False),
                                                ("192.168.0.2", False), ("my.host", False)])
def test_what_only_this_machine_reaches(address, alone):
    assert is_loopback(address) == alone


@given(ADDRESSES)
def test_the_address_shown_leads_to_where_it_listens(address):
    shown = socket.gethostname() if address.is_unspecified else str(address)
    assert network.host_of(f"http://{shown_host(str(address))}:80/") == shown.lower()
    assert (network.address_family(str(address)) == socket.AF_INET6) == (address.version == 6)


# Ports


def test_a_page_has_its_usual_port_or_else_a_free_one_and_a_port_that_is_asked_for_alone():
    tried, taken = [], {8600, 8700}

    def open_at(port: int) -> int:
        tried.append(port)
        if port in taken:
            raise OSError(98, "Address already in use")
        return port

    assert [open_page(open_at, "127.0.0.1", port, 8600) for port in (None, 8601)] == [0, 8601]
    assert tried == [8600, 0, 8601]
    with pytest.raises(SettingsError, match=r"^listen: 127\.0\.0\.1, port: 8700: the page cannot be served there \(address already"):
        open_page(open_at, "127.0.0.1", 8700, 8600)
    assert tried[3:] == [8700]
    taken.add(0)
    with pytest.raises(SettingsError, match=r"^listen: 127\.0\.0\.1: the page cannot be served there"):
        open_page(open_at, "127.0.0.1", None, 8600)


# The browser


@pytest.mark.parametrize(("platform", "variables", "screen"), [
    ("linux", {}, False), ("linux", {"DISPLAY": ""}, False), ("linux", {"DISPLAY": ":0"}, True),
    ("linux", {"WAYLAND_DISPLAY": "wayland-0"}, True), ("linux", {"DISPLAY": "localhost:10.0", "SSH_CONNECTION": "1"}, True),
    *((platform, variables, not variables) for platform in ("win32", "darwin") for variables in ({}, {"SSH_CONNECTION": "1"})),
])  # fmt: skip
def test_a_page_is_opened_where_there_is_a_screen(platform, variables, screen, monkeypatch):
    opened = []
    monkeypatch.setattr(network.sys, "platform", platform)
    monkeypatch.setattr("webbrowser.open", opened.append)
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "SSH_CONNECTION"):
        monkeypatch.delenv(name, raising=False)
    for name, value in variables.items():
        monkeypatch.setenv(name, value)
    assert has_screen() is screen
    open_browser("http://127.0.0.1/")
    assert opened == ["http://127.0.0.1/"] * screen


def test_a_browser_that_cannot_be_begun_is_no_error(monkeypatch):
    def fails(_: str) -> bool:
        raise webbrowser.Error("no browser")

    monkeypatch.setattr(network, "has_screen", lambda: True)
    monkeypatch.setattr("webbrowser.open", fails)
    open_browser("http://127.0.0.1/")


# Requests


@pytest.mark.parametrize(("host", "loopback", "good"), [
    ("127.0.0.1:8600", True, True), ("localhost:8600", True, True), ("LOCALHOST", True, True), ("[::1]:8600", True, True),
    ("192.168.1.5:8600", True, False), ("192.168.1.5:8600", False, True), ("evil.example", False, False), ("", True, False),
    ("localhost.evil.example", True, False), ("127.0.0.1.evil.example", False, False), ("[::1", True, False),
])  # fmt: skip
def test_hosts_that_are_known(host, loopback, good):
    assert known_host(host, loopback) == good
    assert is_own_host(request(("Host", host)), loopback) == good
    assert not is_own_host(request(("Host", host), ("Host", host)), loopback)
    assert not is_own_host(request(), loopback)


@given(ADDRESSES, st.integers(1, 65535))
def test_addresses_are_known_but_to_this_machine_alone_only_its_own(address, port):
    host = f"[{address}]" if address.version == 6 else str(address)
    assert known_host(f"{host}:{port}", loopback=False)
    assert known_host(f"{host}:{port}", loopback=True) == address.is_loopback


def test_this_machine_s_name_is_known_where_others_may_look():
    assert known_host(f"{socket.gethostname()}:80", loopback=False)
    assert known_host(socket.gethostname(), loopback=True) == (socket.gethostname().lower() == "localhost")


@pytest.mark.parametrize(("origins", "same"), [
    ([], True), (["http://box:80"], True), (["https://BOX:80"], True), (["http://box"], False), (["http://box:81"], False),
    (["null"], False), (["http://evil.example"], False), (["http://box:80", "http://evil.example"], False), (["box:80"], False),
])  # fmt: skip
def test_a_page_of_the_same_server_is_one_of_the_same_host_and_port(origins, same):
    assert is_same_origin(request(("Host", "Box:80"), *(("Origin", origin) for origin in origins))) == same


@pytest.mark.parametrize(("origins", "allowed", "good"), [
    ([], (), True), (["http://a"], (), False), (["http://a"], ("http://a", "http://b"), True), (["http://a"], ("http://b",), False),
    (["http://a"], ("*",), True), (["http://a", "http://c"], ("http://a",), False),
])  # fmt: skip
def test_origins_are_allowed_by_name(origins, allowed, good):
    assert are_origins_allowed(request(*(("Origin", origin) for origin in origins)), frozenset(allowed)) == good


@given(st.lists(st.sampled_from("abc")), st.integers(0, 5), st.integers(0, 3))
def test_connections_are_counted_in_all_and_of_each_address(asking, most, most_of_address):
    found, kept = Connections(most, most_of_address), []
    for address in asking:
        there_is = len(kept) < most and kept.count(address) < most_of_address
        assert found.has_room(address) == found.enter(address) == there_is
        kept += [address] * there_is
        assert len(found) == len(kept)
    for address in kept:
        found.leave(address)
    assert (len(found), len(found._of)) == (0, 0)
