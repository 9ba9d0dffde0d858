"""Processors that a container allows, and runs that had to share theirs."""

import os

import pytest

from weftform.errors import StudyError
from weftform.processors import crowding, threads_for, usable_processors


@pytest.mark.parametrize(
    ("text", "most"), [("100000 100000", 1), ("150000 100000", 2), ("max 100000", 10**6), ("", 10**6)]
)
def test_the_quota_of_a_container_counts(tmp_path, text, most):
    (tmp_path / "cpu.max").write_text(text)
    bound = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    assert usable_processors(tmp_path) == min(bound, most)


def test_without_control_groups_the_processors_count(tmp_path):
    assert usable_processors(tmp_path / "none") >= 1


def test_more_threads_than_processors_are_told():
    (note,) = crowding(4, 2, processor_s=8.0, wall_s=4.0)
    assert "4 threads share 2 processors" in note


def test_time_that_others_took_is_told():
    (note,) = crowding(2, 2, processor_s=4.0, wall_s=4.0)
    assert "50 %" in note
    assert crowding(2, 2, processor_s=7.8, wall_s=4.0) == []
    assert crowding(1, 2, processor_s=0.1, wall_s=0.4) == [], "too short to tell"


def test_threads_are_chosen_by_the_size_of_the_blank():
    assert threads_for(100, None) == 1
    assert threads_for(100, 1) == 1
    with pytest.raises(StudyError):
        threads_for(100, 10**6)
