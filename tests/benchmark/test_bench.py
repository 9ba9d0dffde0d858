"""The benchmark verb: schema, ratios, page."""

import json

import pytest

from weftform.benchmark import bench as whole
from weftform.benchmark import sheet
from weftform.benchmark.machine import peak_gflops
from weftform.benchmark.page import page
from weftform.errors import WeftformError

KEYS = {"cells", "threads", "contact", "precision", "device", "ns_per_cell_step"}


@pytest.fixture(scope="module")
def found():
    return whole.bench(sides=(12,), threads=(1,), seconds=0.0, fewest=2, source_cells=12, with_start_up=False)


@pytest.mark.slow
def test_json_has_machine_and_cases(found):
    read = json.loads(found.to_json())
    assert set(read) == {"machine", "cases"}
    assert all(set(case) >= KEYS for case in read["cases"])
    ours = [case for case in read["cases"] if case["program"] == "weftform"]
    assert {case["contact"] for case in ours} == {True, False}
    assert all(case["cells"] == 144 and case["threads"] == 1 and case["laps"] >= 2 for case in ours)


@pytest.mark.slow
def test_least_is_least_and_the_loop_is_part_of_the_whole(found):
    for case in found.cases:
        assert 0.0 < case["loop_ns_per_cell_step"] <= case["ns_per_cell_step"] <= case["median_ns_per_cell_step"]


@pytest.mark.slow
def test_ratios_are_to_the_reference_on_the_same_sheet(found):
    yardsticks = {case["contact"]: case["ns_per_cell_step"] for case in found.cases if case["program"] == "c-reference"}
    if not yardsticks:
        assert any("gcc" in note for note in found.machine["notes"])
        return
    for case in found.cases:
        assert case["ratio_to_c"] == pytest.approx(case["ns_per_cell_step"] / yardsticks[case["contact"]], abs=1e-3)


@pytest.mark.slow
def test_page_names_every_case(found):
    text = page(found)
    assert text.count("| weftform |") >= 2
    assert found.machine["processor"] in text


def test_contact_state_is_mixed():
    simulation = sheet.formed_sheet(12, True, source=sheet.formed_source(12))
    assert simulation.contact_forces.any()
    assert simulation.tool_position(0) == pytest.approx(18.0, abs=2.0)


def test_peak_is_more_than_a_chain_of_scalars():
    """One multiply-add per clock in sequence would be below this on any processor of the last ten years."""
    assert peak_gflops(1) > 4.0


def test_no_threads_are_refused_before_anything_is_timed():
    with pytest.raises(WeftformError, match="number of threads cannot be had"):
        whole.bench(sides=(12,), threads=(0,))
