"""docs/performance.md, from what was measured."""

from __future__ import annotations

from typing import Any

from weftform.benchmark.bench import Bench
from weftform.benchmark.measure import LAP_STEPS, LAP_SURVEYS

TARGETS = (
    (56, True, 1, 1.1),
    (200, True, 1, 1.1),
    (200, True, 2, 0.6),
    (700, True, 2, 0.6),
    (56, False, 1, 1.1),
    (200, False, 1, 1.1),
)
"""Cells along a side, contact, threads, and the largest ratio to the C reference on one thread."""


def page(bench: Bench, peers: list[dict[str, Any]] | None = None) -> str:
    """Markdown of the performance page."""
    machine, cases = bench.machine, bench.cases
    out = [
        "# Performance",
        "",
        "Made by `weftform bench --markdown`; do not edit. Nanoseconds per cell per step (one cell, two connectors, one",
        "crossing) of the shipped hemisphere on a whole blank when 60 % of the time of its stroke has passed, double precision.",
        f"A figure is the least over laps of {LAP_STEPS} steps with {LAP_SURVEYS} surveys, and the share of a lap in entries of",
        "the energy ledger and rows of the history; *loop* is the same without the rows. The yardstick is the C program",
        "`benchmarks/reference/sheet.c` on one thread: the same physics by hand, steps and surveys only. The laps of all cases",
        "take turns, so ratios mean more than times.",
        "",
        "## Machine",
        "",
        f"{machine['processor']} (LLVM: {machine['llvm_target']}), {machine['processors']} processors, {machine['system']}, "
        f"Python {machine['python']}, Numba {machine['numba']}, weftform {machine['weftform']}.",
        "",
        "| threads | multiply-add peak, Gflop/s | stream, GB/s |",
        "|---|---|---|",
        *(
            f"| {n} | {machine['peak_gflops'][n]:.0f} | {machine['stream_gb_per_s'][n]:.1f} |"
            for n in machine["peak_gflops"]
        ),
        "",
        *(f"- {note}" for note in machine["notes"]),
        "",
        "## Time per cell and step",
        "",
        "| program | cells | contact | threads | device | ns | loop, ns | median, ns | ratio to C | loop / C | state, bytes |",
        "|---|---|---|---|---|---|---|---|---|---|---|",
        *(_case(case) for case in cases),
        "",
        "## Targets",
        "",
        "| case | at most | measured | loop | |",
        "|---|---|---|---|---|",
        *_targets(cases),
        "",
    ]
    if "start_up" in machine:
        out += _start_up(machine)
    if peers:
        out += _peers(peers)
    out += _roofline(machine, cases)
    return "\n".join(out) + "\n"


def _case(case: dict[str, Any]) -> str:
    def number(name: str) -> str:
        return f"{case[name]:.2f}" if name in case else ""

    return (
        f"| {case['program']} | {case['cells']} | {'yes' if case['contact'] else 'no'} | {case['threads']} | {case['device']} | "
        f"{case['ns_per_cell_step']:.1f} | {case['loop_ns_per_cell_step']:.1f} | {case['median_ns_per_cell_step']:.1f} | "
        f"{number('ratio_to_c')} | {number('loop_ratio_to_c')} | {case['state_bytes_per_cell']:.0f} |"
    )


def _targets(cases: list[dict[str, Any]]) -> list[str]:
    lines = []
    for side, contact, threads, limit in TARGETS:
        for case in cases:
            same = (case["cells"], case["contact"], case["threads"]) == (side**2, contact, threads)
            if same and case["program"] == "weftform" and "ratio_to_c" in case:
                on = "1 thread" if threads == 1 else f"{threads} threads"
                lines.append(
                    f"| {side} x {side}, {'contact' if contact else 'no contact'}, {on} | {limit} x C | "
                    f"{case['ratio_to_c']:.2f} | {case['loop_ratio_to_c']:.2f} | {_verdict(case['ratio_to_c'], limit)} |"
                )
    return lines


def _verdict(measured: float, most: float) -> str:
    return "met" if measured <= most else "missed"


def _start_up(machine: dict[str, Any]) -> list[str]:
    first, bare, drawn = machine["start_up"], machine["whole_run_no_figures"], machine["whole_run_figures"]
    rows = (
        ("process start to first step, kernels cached", first["warm_s"], 1.0),
        ("the same with an empty cache", first["cold_s"], None),
        ("time loop", bare["loop_s"], 0.8),
        ("whole process less time loop, `--no-figures`", bare["rest_s"], 1.2),
        ("whole process less time loop, with figures", drawn["rest_s"], 5.0),
    )
    return [
        "## Start and whole runs of `hemisphere-0-90`",
        "",
        "| | seconds | target | |",
        "|---|---|---|---|",
        *(
            f"| {what} | {seconds:.2f} | " + (f"{most:g} | {_verdict(seconds, most)} |" if most else "| |")
            for what, seconds, most in rows
        ),
        "",
    ]


def _peers(peers: list[dict[str, Any]]) -> list[str]:
    return [
        "## Peers",
        "",
        "The same sheet, 56 x 56 cells, one thread, in the same session (`python benchmarks/peers/run.py`).",
        "",
        "| program | physics | contact | ns per cell per step | times weftform |",
        "|---|---|---|---|---|",
        *(
            f"| {peer['program']} | {peer['physics']} | {'yes' if peer['contact'] else 'no'} | "
            f"{peer['ns_per_cell_step']:.0f} | {peer['ratio_to_weftform']:.1f} |"
            for peer in peers
        ),
        "",
    ]


def _roofline(machine: dict[str, Any], cases: list[dict[str, Any]]) -> list[str]:
    flops, bandwidth = machine["peak_gflops"].get("1"), machine["stream_gb_per_s"].get("1")
    if not flops:
        return []
    lines = [
        "## Roofline",
        "",
        "Operations are counted by hand in the formulas (a multiply-add is two), bytes as if nothing stayed in a cache. A bound is",
        "operations over peak, or bytes over stream bandwidth, one thread. No program reaches it: roots, divisions and",
        "comparisons take vector slots and are not multiply-adds.",
        "",
        "| program | cells | contact | operations | bytes | operations / peak, ns | bytes / stream, ns | measured, ns |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for case in cases:
        if case["threads"] == 1 and case["device"] == "cpu":
            ops, moved = case["flops_per_cell_step"], case["bytes_per_cell_step"]
            lines.append(
                f"| {case['program']} | {case['cells']} | {'yes' if case['contact'] else 'no'} | {ops:.0f} | {moved:.0f} | "
                f"{ops / flops:.1f} | {moved / bandwidth:.1f} | {case['loop_ns_per_cell_step']:.1f} |"
            )
    return lines
