"""The entry point before the command line is there."""

import sys
from types import ModuleType

import pytest

from weftform.__main__ import main


class Interrupted(ModuleType):
    def __getattr__(self, name):
        raise KeyboardInterrupt


def test_an_interrupt_while_loading_ends_without_a_traceback(monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "weftform.cli", Interrupted("weftform.cli"))
    with pytest.raises(SystemExit) as caught:
        main()
    assert caught.value.code == 130
    assert capsys.readouterr().err == "interrupted\n"
