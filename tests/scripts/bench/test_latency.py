"""The bench of latencies drives a recording of its own, and takes times that make sense."""

import json

import pytest
from command_helpers import ran


@pytest.mark.slow
def test_a_short_run_takes_every_time(tmp_path):
    file = tmp_path / "latency.json"
    shown = ran("--seconds", 5, "--no_overload", "--image_size", 0, "--json", file, name="bench latency")
    assert "key to commanded velocity" in shown
    (case,) = json.loads(file.read_text())["cases"].values()
    typical = {name: each["p50"] for name, each in case["latencies_ms"].items()}
    assert typical["round trip"] > 0.0
    assert 0.0 < typical["key to command"] < typical["key to page"]
    assert 0.0 < typical["release to brake"] < typical["release to rest"]
    assert 0 < case["frames"] == case["jitter_ms"]["n"] + 1
