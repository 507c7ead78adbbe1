"""Recording must start at once, and `datasets` must stay Hugging Face's."""

import subprocess
import sys

import pytest
from places import ROOT

HEAVY = "{'torch', 'lerobot', 'datasets', 'pandas', 'scipy', 'casadi', 'pinocchio', 'mujoco'}"


def _run(code: str) -> str:
    command = [sys.executable, "-c", code]
    return subprocess.run(command, capture_output=True, text=True, check=True, cwd=ROOT).stdout.strip()


@pytest.mark.parametrize(
    "module", ["recording.writer", "recording.repair", "reading.reader", "quality.summary"]
)
def test_nothing_heavy_is_imported(module):
    assert _run(f"import sys, handrail.datasets.{module}; print({HEAVY} & set(sys.modules))") == "set()"


def test_nothing_heavy_is_imported_while_recording_and_reading(tmp_path):
    code = f"""
import sys; sys.path.insert(0, 'tests/helpers')
from datasets_helpers import *
from handrail.datasets.quality.summary import summarize
root = Path({str(tmp_path)!r}) / 'set'
record(root, 1, cameras=True); resume(root, cameras=True).close(); summarize(root)
print({HEAVY} & set(sys.modules))"""
    assert _run(code) == "set()"


def test_datasets_is_hugging_face_s():
    assert "site-packages" in _run("import datasets; print(datasets.__file__)")
    assert not (ROOT / "datasets" / "__init__.py").exists()


def test_the_encoder_is_silent(tmp_path):
    code = "import sys; sys.path.insert(0, 'tests/helpers'); from datasets_helpers import *; "
    code += "record(Path(sys.argv[1]), 1, cameras=True)"
    command = [sys.executable, "-c", code, str(tmp_path / "set")]
    done = subprocess.run(command, capture_output=True, text=True, check=True, cwd=ROOT)
    assert (done.stdout, done.stderr) == ("", "")
