"""Laws: who knows the token comes in, from the page's own address, with a few tries a minute; nobody else."""

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from handrail.collect.cockpit.guard import Guard, cookie_name
from handrail.collect.cockpit.lease import Lease

HOST = "192.168.1.20:8765"
HERE = {"host": HOST, "origin": f"https://{HOST}"}
COOKIE = cookie_name(HERE)


class Clock:
    now = 1000.0

    def __call__(self):
        return self.now


@pytest.fixture
def clock():
    return Clock()


@pytest.fixture
def guard(clock):
    return Guard(False, "https", "secret", clock)


def test_the_token_opens_a_session_for_one_address(guard, clock):
    session = guard.log_in(guard.token, "10.0.0.1")
    assert guard.admits(HERE, {COOKIE: session}, "10.0.0.1")
    assert not guard.admits(HERE, {COOKIE: session}, "10.0.0.2")
    assert not guard.admits(HERE, {COOKIE: session[:-1]}, "10.0.0.1")
    assert not guard.admits(HERE, {COOKIE: "é"}, "10.0.0.1")
    assert not guard.admits(HERE, {}, "10.0.0.1")
    clock.now += 13 * 3600.0
    assert not guard.admits(HERE, {COOKIE: session}, "10.0.0.1")


def test_a_session_outlives_a_server_that_is_started_again(guard, clock):
    session = guard.log_in(guard.token, "10.0.0.1")
    again = Guard(False, "https", "secret", clock)
    assert again.token == guard.token
    assert again.admits(HERE, {COOKIE: session}, "10.0.0.1")
    assert not Guard(False, "https", "another", clock).admits(HERE, {COOKIE: session}, "10.0.0.1")


@pytest.mark.parametrize("host", ["127.0.0.1:{}", "localhost:{}", "[::1]:{}", "10.0.0.1"])
def test_each_server_of_a_computer_has_a_session_of_its_own(host):
    """A browser sends the cookies of a computer to the servers of all its ports."""
    names = {cookie_name({"host": host.format(port)}) for port in (8765, 8766)}
    assert len(names) == 1 + ("{}" in host)
    assert all(re.fullmatch(r"[\w.]+", name) for name in names)


@given(st.text(max_size=90))
def test_no_made_up_session_comes_in(made_up):
    guard = Guard(False, "https", "secret")
    assert not guard.admits(HERE, {COOKIE: made_up}, "10.0.0.1")


def test_a_session_cannot_be_made_to_last_longer(guard):
    end, _, rest = guard.log_in(guard.token, "10.0.0.1").partition(".")
    assert not guard.admits(HERE, {COOKIE: f"{int(end) + 9}.{rest}"}, "10.0.0.1")


def test_guessing_tokens_waits_and_keeps_nobody_out(guard, clock):
    assert not any(guard.log_in(f"wrong {n}", "10.0.0.1") for n in range(5))
    assert guard.guesses("10.0.0.1")
    assert not guard.guesses("10.0.0.2")
    assert guard.log_in(guard.token, "10.0.0.1")
    clock.now += 61.0
    assert not guard.guesses("10.0.0.1")


@pytest.mark.parametrize(
    ("host", "origin", "fine"),
    [
        (HOST, f"https://{HOST}", True),
        (HOST, "https://evil.example", False),
        (HOST, f"http://{HOST}", False),
        (HOST, None, False),
        ("evil.example:8765", "https://evil.example:8765", False),  # a name made to point here
        ("", "", False),
        ("localhost:1", "https://localhost:1", True),
        ("[::1]:8765", "https://[::1]:8765", True),
    ],
)
def test_a_socket_comes_from_the_cockpits_own_page(guard, host, origin, fine):
    headers = {"host": host} | ({} if origin is None else {"origin": origin})
    assert guard.is_ours(headers, origin=True) is fine


def test_nobody_needs_the_token_on_this_computer(clock):
    guard = Guard(True, "http", "secret", clock)
    assert guard.admits({"host": "127.0.0.1:8765"}, {}, "127.0.0.1")
    assert not guard.admits({"host": "evil.example"}, {}, "127.0.0.1")


def test_one_page_drives_and_a_reload_keeps_its_place(clock):
    lease = Lease(clock)
    lease.take("first")
    lease.take("second")
    assert lease.drives("first")
    assert not lease.drives("second")
    lease.leave("first")
    lease.take("third")
    assert not lease.drives("third")
    assert not lease.drives("first")
    lease.take("first")
    assert lease.drives("first")
    lease.leave("first")
    clock.now += 6.0
    lease.take("second")
    assert lease.drives("second")
    assert not lease.drives("first")


def test_a_page_that_asked_while_another_was_expected_back_drives_when_it_is_not(clock):
    lease = Lease(clock)
    lease.take("first")
    lease.leave("first")
    lease.take("second")
    assert not lease.drives("second")
    lease.settle()
    assert not lease.drives("second")
    clock.now += 6.0
    lease.settle()
    assert lease.drives("second")
    assert not lease.asking


def test_the_driver_gives_the_lease_to_who_asks(clock):
    lease = Lease(clock)
    lease.take("first")
    lease.take("second")
    lease.give("second")
    assert lease.drives("first")
    lease.give("first")
    assert lease.drives("second")
    assert not lease.asking
    lease.give("second")
    lease.take("third")
    assert lease.drives("third")
