"""The surgeon's page: `fras bench page [--stops N] [--pairs N] [--opens N] ...`.

How long after the server's receipt of a click the arms are at rest, at pace 1; what an open page
costs a tick, as trials in turn with and without a client that takes everything and draws nothing,
at pace 1 (from the arms' state to the verdict on it) and as fast as possible (from tick to tick);
how soon after a page is opened tissue is drawn, by a headless browser without a graphics processor.
"""

import argparse
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from benchmarks.browser import Fence, chromium
from benchmarks.machine import processor
from benchmarks.page_jobs import (
    Floats,
    loop_ms,
    measure_first_picture,
    measure_stops,
    tick_ms,
    watched,
)
from benchmarks.surgeon import SurgeonsPage, served
from benchmarks.telling import tell_figures
from benchmarks.theatre import Theatre

from fras_cli.stack import UsedStack, own_stack
from fras_common.threads import one_thread


def spread(values: Floats, digits: int = 1) -> dict[str, float]:
    p50, p99 = np.percentile(values, [50, 99])
    worst = float(values.max())
    return {
        name: round(float(value), digits)
        for name, value in (("p50", p50), ("p99", p99), ("most", worst))
    }


def measure_overhead(
    stack: UsedStack,
    theatre: Theatre,
    what: str,
    measure: Callable[[Theatre, int], Floats],
    pairs: int,
) -> dict[str, Any]:
    """Run scenes without and with a page, whichever first in turn: the machine has its moods."""
    alone: list[Floats] = []
    seen: list[Floats] = []

    def with_page(seed: int) -> None:
        with served(stack.link) as page, watched(page.address):
            seen.append(measure(theatre, seed))

    for seed in range(1, pairs + 1):
        if seed % 2 == 0:
            with_page(seed)
        alone.append(measure(theatre, seed))
        if seed % 2 == 1:
            with_page(seed)
        print(f"pair {seed} of {pairs}", flush=True)
    one, other = np.concatenate(alone), np.concatenate(seen)
    return {
        f"{what}_alone_ms": spread(one, 2),
        f"{what}_with_page_ms": spread(other, 2),
        f"{what}_ratio_of_medians": round(float(np.median(other) / np.median(one)), 3),
    }


def measure_page(
    folder: Path, *, stops: int, pairs: int, paced_pairs: int, opens: int, scene: bool
) -> dict[str, Any]:
    figures: dict[str, Any] = {"processor": processor(), "stops": stops, "pairs": pairs}
    fence = Fence()
    with own_stack("bench-page", None, folder / "logs") as stack:
        theatre = Theatre(stack, folder)
        if pairs:
            figures |= measure_overhead(stack, theatre, "tick", tick_ms, pairs)
        if paced_pairs:
            figures |= measure_overhead(stack, theatre, "loop", loop_ms, paced_pairs)
        with served(stack.link) as page, chromium(fence) as browser:
            if opens:
                tick_ms(theatre, 1)  # so that there is tissue to draw
                figures["first_picture_s"] = spread(
                    measure_first_picture(browser, page.address, opens), 2
                )
            if stops:
                surgeon = SurgeonsPage(browser, page.address, scene=scene)
                surgeon.is_live()
                acknowledged, at_rest = measure_stops(
                    theatre, surgeon, stops, 1, lambda n: print(f"stop {n} of {stops}", flush=True)
                )
                figures["acknowledged_ms"] = spread(acknowledged)
                figures["at_rest_ms"] = spread(at_rest)
                surgeon.close()
    fence.close()
    return figures


def main() -> None:
    one_thread()
    parser = argparse.ArgumentParser(prog="fras bench page", description=__doc__)
    parser.add_argument("--stops", type=int, default=200)
    parser.add_argument(
        "--pairs", type=int, default=20, help="trials as fast as possible without and with a page"
    )
    parser.add_argument("--paced-pairs", type=int, default=6, help="the same at pace 1")
    parser.add_argument("--opens", type=int, default=10)
    parser.add_argument("--scene", action="store_true", help="draw the scene during the stops, too")
    parser.add_argument("--json", type=Path, help="also write the figures there")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        figures = measure_page(
            Path(name),
            stops=options.stops,
            pairs=options.pairs,
            paced_pairs=options.paced_pairs,
            opens=options.opens,
            scene=options.scene,
        )
    tell_figures(figures, options.json)


if __name__ == "__main__":
    main()
