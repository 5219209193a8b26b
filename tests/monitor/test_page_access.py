"""Who may open the page, and from where; what a button may send."""

import pytest

from fras_monitor.access import (
    BadToken,
    OpenToAll,
    Policy,
    comes_from_here,
    cookie_for,
    require_closed,
    token_in_cookies,
    token_in_query,
)
from fras_monitor.commands import MAX_COMMAND_BYTES, BadCommand, Resume, Stop, parse

TOKEN, VIEW = "t" * 20, "v" * 20


@pytest.mark.parametrize(
    ("policy", "shown", "role"),
    [
        (Policy(), "", "surgeon"),
        (Policy(read_only=True), "", "viewer"),
        (Policy(TOKEN), "", None),
        (Policy(TOKEN), "wrong", None),
        (Policy(TOKEN), TOKEN, "surgeon"),
        (Policy(TOKEN), "é", None),
        (Policy(TOKEN, VIEW), VIEW, "viewer"),
        (Policy(TOKEN, VIEW), "", None),
        (Policy(TOKEN, VIEW, read_only=True), TOKEN, "viewer"),
    ],
)
def test_what_a_token_opens(policy: Policy, shown: str, role: str | None):
    assert policy.role_of(shown) == role


@pytest.mark.parametrize(
    ("token", "view"), [("short", ""), ("t" * 20 + ";", ""), ("", VIEW), (TOKEN, TOKEN)]
)
def test_tokens_that_protect_nothing_are_refused(token: str, view: str):
    with pytest.raises(BadToken):
        Policy(token, view)


@pytest.mark.parametrize("host", ["0.0.0.0", "::", "192.0.2.1", "theatre.example"])
def test_other_machines_are_let_in_with_a_token_only(host: str):
    with pytest.raises(OpenToAll, match="--token"):
        require_closed(host, Policy())
    require_closed(host, Policy(TOKEN))


@pytest.mark.parametrize("host", ["127.0.0.1", "localhost", "::1"])
def test_this_machine_is_let_in_without(host: str):
    require_closed(host, Policy())


@pytest.mark.parametrize(
    ("origin", "host", "policy", "ours"),
    [
        (None, "127.0.0.1:8080", Policy(), True),
        ("http://127.0.0.1:8080", "127.0.0.1:8080", Policy(), True),
        ("http://evil.example", "127.0.0.1:8080", Policy(), False),
        ("http://127.0.0.1:9999", "127.0.0.1:8080", Policy(), False),
        ("null", "127.0.0.1:8080", Policy(), False),
        # A name of another site that was made to lead here.
        ("http://evil.example:8080", "evil.example:8080", Policy(), False),
        ("https://theatre.example", "theatre.example", Policy(TOKEN), True),
        ("http://[::1]:8080", "[::1]:8080", Policy(), True),
        (None, "", Policy(), False),
    ],
)
def test_another_site_in_the_same_browser_can_do_nothing(
    origin: str | None, host: str, policy: Policy, ours: bool
):
    assert comes_from_here(origin, host, policy) == ours


def test_where_a_token_is_looked_for():
    assert token_in_query(f"/?token={TOKEN}") == TOKEN
    assert token_in_query("/") == ""
    assert token_in_cookies(f"a=b; fras_token_8080={TOKEN}", 8080) == TOKEN
    assert token_in_cookies("fras_token_8080", 8080) == ""


def test_pages_at_two_ports_of_a_host_keep_each_their_own_cookie():
    set_by = [cookie_for(token, port) for token, port in ((TOKEN, 8080), (VIEW, 8081))]
    # A browser sends the cookies of a host to all its ports.
    sent = "; ".join(one.partition(";")[0] for one in set_by)
    assert [token_in_cookies(sent, port) for port in (8080, 8081, 8082)] == [TOKEN, VIEW, ""]


def test_what_buttons_send_is_read():
    assert parse('{"do":"stop"}') == Stop()
    assert parse('{"do":"resume","holds":{"cli":"x"}}') == Resume(holds={"cli": "x"})


@pytest.mark.parametrize(
    "text",
    [
        "",
        "stop",
        '{"do":"shutdown"}',
        '{"do":"stop","more":1}',
        '{"do":"why_not","block":"b(1,1). #external"}',
        '{"do":"replay","command":"stop_it"}',
        '{"do":"colour","by":"red"}',
        '{"do":"look","page":"a1","place":"below"}',
        b"\xff",
        '{"do":"reject","plan":"c1","reason":"' + "x" * 401 + '"}',
        '{"do":"stop"}' + " " * MAX_COMMAND_BYTES,
    ],
)
def test_anything_else_is_refused(text: str | bytes):
    with pytest.raises(BadCommand):
        parse(text)
