"""The finite elements alone, against MuJoCo's flex and felupe.

One tissue, grasped and pulled up by 50 mm at 20 mm/s in ticks of 20 ms, on meshes of growing size:
by FRAS with each of its linear solvers, by MuJoCo's flex and by felupe, one after the other in the
same run, each in a process of its own on two cores, of which each uses what it can. How the peers
are set up and what they leave out is written in `benchmarks/peers_*.py`; one that is not installed
is named and left out. A peer that is slow stops when its budget is spent: it is held against the
same ticks of FRAS. All times are wall time, but for `cpu`: that of all cores together.
"""

import argparse
import importlib
import importlib.util
import json
import multiprocessing
import os
import time
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import numpy as np
from benchmarks.fe_figure import draw
from benchmarks.machine import processor
from benchmarks.memory import memory_mib

DEFAULT_MESHES = ("11x13x2", "21x25x2", "21x25x3", "41x49x3")
FRAS = ("auto", "scipy", "mkl")
PEERS = {"MuJoCo flex": ("mujoco", "benchmarks.peers_mujoco")}
PEERS["felupe"] = ("felupe", "benchmarks.peers_felupe")
# Real-time factors and ratios to reach (design, section 6).
TARGETS = {"11x13x2": 10, "21x25x2": 4, "21x25x3": 2, "41x49x3": 1}
RATIOS = {"MuJoCo flex": 1.5, "felupe": 15.0}
OUT = Path("runs/bench")
BUDGET_S = 15.0
TICK_MS = 20.0
GIVE_UP_S = 120.0
Raw = dict[str, Any]
LIBRARIES = ("OMP", "OPENBLAS", "MKL", "NUMBA")
THREADS = 2


def measure_in_process(method: str, counts: tuple[int, int, int], budget_s: float) -> Raw | str:
    """Return the figures of one method on one mesh, or why there are none, as a string."""
    context = multiprocessing.get_context("spawn")
    receiver, sender = context.Pipe(duplex=False)
    process = context.Process(target=_measure, args=(method, counts, budget_s, sender))
    process.start()
    sender.close()
    answer: Raw | str = f"took more than {GIVE_UP_S:.0f} s"
    if receiver.poll(GIVE_UP_S):
        try:
            answer = receiver.recv()
        except EOFError:
            answer = "its process died"
    else:
        process.terminate()
    process.join()
    return answer


def _measure(
    method: str, counts: tuple[int, int, int], budget_s: float, sender: Connection
) -> None:
    # Only now: what is imported here counts as this process's memory.
    from benchmarks.fe_task import make_task, measure_fras

    from fras_sim.fem import compile_kernels

    try:
        task = make_task(counts)
        if method in PEERS:
            measure = importlib.import_module(PEERS[method][1]).measure
            before_mib = memory_mib("VmHWM")
            measured = measure(task, budget_s)
        else:
            compile_kernels()
            before_mib = memory_mib("VmHWM")
            measured = measure_fras(task, method, budget_s)
    except Exception as error:  # noqa: BLE001 - a peer that fails is a line in the table
        sender.send(f"{type(error).__name__}: {error}")
        return
    sender.send(
        {
            "tick_ms": measured.tick_ms,
            "cpu_ms": measured.cpu_ms,
            "phase_ms": measured.phase_ms,
            "notes": measured.notes,
            "memory_mib": memory_mib("VmHWM") - before_mib,
            "process_mib": memory_mib("VmHWM"),
        }
    )


def _mean_ms(raw: Raw, ticks: int | None = None) -> float:
    times: list[float] = raw["tick_ms"][:ticks]
    return float(np.mean(times))


def figures(raw: Raw, reference: Raw) -> dict[str, Any]:
    """Return the summary of one measurement, held against FRAS over the same ticks."""
    ticks: list[float] = raw["tick_ms"]
    of_all_cores: list[float] = raw["cpu_ms"]
    mean_ms = _mean_ms(raw)
    p50_ms, p99_ms = (float(np.percentile(ticks, share)) for share in (50, 99))
    return {
        "ticks": len(ticks),
        "ms": round(mean_ms, 3),
        "cpu_ms": round(float(np.mean(of_all_cores)), 3),
        "p50_ms": round(p50_ms, 3),
        "p99_ms": round(p99_ms, 3),
        "steps_per_s": round(1e3 / mean_ms, 1),
        "real_time_factor": round(TICK_MS / mean_ms, 2),
        "times_fras": round(mean_ms / _mean_ms(reference, len(ticks)), 2),
        "memory_mib": round(raw["memory_mib"], 1),
        "process_mib": round(raw["process_mib"], 1),
        "phase_ms": {name: round(value, 3) for name, value in raw["phase_ms"].items()},
        **raw["notes"],
    }


def measure_mesh(mesh: str, budget_s: float, repeats: int) -> dict[str, Any]:
    nx, ny, nz = map(int, mesh.split("x"))
    methods = [*FRAS, *(peer for peer in PEERS if importlib.util.find_spec(PEERS[peer][0]))]
    answers: dict[str, Raw | str] = {}
    for method in methods:
        tries = [measure_in_process(method, (nx, ny, nz), budget_s) for _ in range(repeats)]
        good = [answer for answer in tries if not isinstance(answer, str)]
        # Other work on the machine only ever adds: the least disturbed run counts.
        answers[method] = min(good, key=_mean_ms) if good else tries[0]
        print(f"  {mesh}: {method} done", flush=True)
    reference = answers[FRAS[0]]
    if isinstance(reference, str):
        raise SystemExit(f"FRAS failed at {mesh}: {reference}")
    return {
        method: {"failed": raw} if isinstance(raw, str) else figures(raw, reference)
        for method, raw in answers.items()
    }


def table(meshes: dict[str, dict[str, Any]]) -> str:
    head = f"{'mesh':9}{'method':13}{'ms':>8}{'cpu':>8}{'p50':>8}{'p99':>8}{'steps/s':>9}"
    head += f"{'real time':>10}{'x FRAS':>8}{'MiB':>7}{'ticks':>6}"
    lines = [head + "  to reach"]
    for mesh, methods in meshes.items():
        for method, row in methods.items():
            if "failed" in row:
                lines.append(f"{mesh:9}{method:13}{row['failed'].strip()}")
                continue
            goal = f">= {TARGETS[mesh]} x real time" if mesh in TARGETS and method in FRAS else ""
            goal = f">= {RATIOS[method]} x FRAS" if method in RATIOS else goal
            lines.append(
                f"{mesh:9}{method:13}{row['ms']:8.2f}{row['cpu_ms']:8.2f}{row['p50_ms']:8.2f}"
                f"{row['p99_ms']:8.2f}{row['steps_per_s']:9.1f}{row['real_time_factor']:10.2f}"
                f"{row['times_fras']:8.2f}"
                f"{row['memory_mib']:7.0f}{row['ticks']:6d}  {goal}"
            )
        phases = methods[FRAS[0]]["phase_ms"]
        lines.append(" " * 9 + ", ".join(f"{name} {value:.2f}" for name, value in phases.items()))
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(prog="fras bench fe", description=__doc__)
    parser.add_argument("--meshes", nargs="+", default=DEFAULT_MESHES, metavar="NXxNYxNZ")
    parser.add_argument("--budget", type=float, default=BUDGET_S, help="seconds a peer may step")
    parser.add_argument("--repeats", type=int, default=1, help="runs of each; the best counts")
    parser.add_argument(
        "--out", type=Path, default=OUT, help="folder for fe.json and fe.png (default: %(default)s)"
    )
    options = parser.parse_args()
    for library in LIBRARIES:
        os.environ[f"{library}_NUM_THREADS"] = str(THREADS)
    for peer, (module, _) in PEERS.items():
        if importlib.util.find_spec(module) is None:
            print(f"{peer} is not installed: pip install 'fras[bench]'")
    meshes = {mesh: measure_mesh(mesh, options.budget, options.repeats) for mesh in options.meshes}
    memory_gb_s = _memory_gb_s()
    result = {
        "machine": {
            "memory_gb_s": round(memory_gb_s, 1),
            "processor": processor(),
            "cores": os.cpu_count(),
            "threads_allowed": THREADS,
        },
        "task": {"lift_m": 0.05, "speed_m_s": 0.02, "dt_s": 0.02, "bed": True},
        "meshes": meshes,
    }
    print(table(meshes))
    print(f"memory: {memory_gb_s:.0f} GB/s read by one core, 100 MB of it")
    options.out.mkdir(parents=True, exist_ok=True)
    (options.out / "fe.json").write_text(json.dumps(result, indent=2) + "\n")
    draw(meshes, FRAS[0], options.out / "fe.png")
    print(f"written: {options.out / 'fe.json'}, {options.out / 'fe.png'}")


def _memory_gb_s() -> float:
    """Return how fast one core reads what no cache holds: the best of a few tries."""
    numbers = np.ones(25_000_000, dtype=np.float32)
    spent_s: list[float] = []
    for _ in range(5):
        began_s = time.perf_counter()
        numbers.sum()
        spent_s.append(time.perf_counter() - began_s)
    return numbers.nbytes / min(spent_s) / 1e9


if __name__ == "__main__":
    main()
