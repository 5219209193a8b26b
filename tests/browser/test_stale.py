"""What is not now looks so: frozen services, a dead server, nothing there yet."""

import signal
from collections.abc import Callable

from benchmarks.surgeon import Served, SurgeonsPage, served
from benchmarks.theatre import Theatre

OpenPage = Callable[..., SurgeonsPage]


def test_a_page_opened_before_the_system_says_so(theatre: Theatre, open_page: OpenPage) -> None:
    with served(theatre.link, cell="not-started") as early:
        page = open_page(early.address, scene=False)
        page.is_old()
        page.reads("cover", "Waiting for the system to start.")


def test_a_frozen_service_makes_the_page_old_until_it_speaks_again(
    theatre: Theatre, server: Served, open_page: OpenPage
) -> None:
    page = open_page(server.address, scene=False)
    page.is_live()
    watch = theatre.process("sa")
    watch.send_signal(signal.SIGSTOP)
    try:
        page.is_old()
        page.reads("cover", "Not live: the force and visibility watch has been silent for")
        page.reads("services", "force and visibility watch: silent")
    finally:
        watch.send_signal(signal.SIGCONT)
    page.is_live()


def test_a_killed_service_is_shown_as_gone_until_it_is_back(
    theatre: Theatre, server: Served, open_page: OpenPage
) -> None:
    page = open_page(server.address, scene=False)
    page.is_live()
    theatre.process("sim").kill()
    page.is_old()
    page.reads("cover", "Not live: the tissue model has been gone for")
    page.is_live()


def test_a_page_whose_server_died_says_so_and_comes_back_by_itself(
    theatre: Theatre, open_page: OpenPage
) -> None:
    with served(theatre.link) as own:
        page = open_page(own.address, scene=False)
        page.is_live()
        port = own.port
        own.kill()
        page.is_old()
        page.reads("cover", "Not live: this page has lost its connection.")
        page.stop()
        page.reads("stopped", "STOP NOT SENT")
        own.start(port)
        page.is_live()
        page.reads("stopped", "")
    page.errors[:] = [one for one in page.errors if "ERR_CONNECTION_REFUSED" not in one]
