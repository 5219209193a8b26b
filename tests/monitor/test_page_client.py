"""viser's client, taken apart: what a browser gets is what viser ships."""

import re

from hypothesis import given
from hypothesis import strategies as st

from fras_monitor.page.client import read_client, take_apart, to_bytes, to_text


@given(st.binary(max_size=64))
def test_text_and_bytes_are_inverses(data: bytes):
    assert to_bytes(to_text(data)) == data


def test_the_page_announces_a_program_that_it_no_longer_contains():
    client = read_client()
    assert client.program is not None
    assert b"createRoot" in client.program.plain
    page = client.page.plain.decode()
    assert f'<link rel="modulepreload" href="../{client.name}">' in page.partition("<script ")[0]
    assert len(page) < len(client.program.plain) / 20


def test_what_viser_unpacks_is_the_style_and_a_call_of_the_program():
    client = read_client()
    again = take_apart(client.page.plain.decode())
    # Taken apart once more, its program is the one line that calls the first.
    assert again.program is not None
    assert again.program.plain == f'import("../{client.name}")'.encode()
    assert re.fullmatch(r"client-[0-9a-f]{16}\.js", client.name)


def test_a_page_packed_otherwise_is_served_whole():
    client = take_apart("<html><head></head><body><script>run()</script></body></html>")
    assert client.program is None
    assert b"run()" in client.page.plain
    assert b"[data-floating-window]" in client.page.plain
