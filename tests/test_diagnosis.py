"""``weftform doctor`` finds nothing wrong where nothing is."""

import pytest

from weftform import diagnosis
from weftform.solver import kernel_cache


def test_nothing_is_wrong_here():
    findings = {finding.what: finding for finding in diagnosis.diagnose(quick=True)}
    assert [f for f in findings.values() if not f.ok] == []
    assert findings["packages"].advice == ""


def test_the_tiny_run_meets_its_stored_value():
    finding = diagnosis._tiny_run()
    assert finding.ok, finding.found


def test_a_cache_folder_below_the_temporary_one_is_as_good_as_any(monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    if tmp_path not in kernel_cache.user_folder().parents:
        pytest.skip("this system keeps caches elsewhere")
    assert diagnosis._kernel_folder().ok


def test_a_cache_folder_that_cannot_be_written_is_said(monkeypatch, tmp_path):
    (tmp_path / "file").write_text("no folder")
    monkeypatch.setattr(kernel_cache, "user_folder", lambda: tmp_path / "file" / "weftform")
    finding = diagnosis._kernel_folder()
    assert not finding.ok
    assert "cannot be written" in finding.advice
