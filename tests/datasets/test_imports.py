"""Recording must start at once, and say nothing."""

import subprocess
import sys

from places import ROOT

HEAVY = "{'torch', 'lerobot', 'datasets', 'pandas', 'scipy', 'casadi', 'pinocchio', 'mujoco'}"


def _run(code: str) -> str:
    command = [sys.executable, "-c", code]
    return subprocess.run(command, capture_output=True, text=True, check=True, cwd=ROOT).stdout.strip()


def test_nothing_heavy_is_imported_while_recording_and_reading(tmp_path):
    code = f"""
import sys; sys.path.insert(0, 'tests/helpers')
from datasets_helpers import *
import handrail.datasets.recording.repair
from handrail.datasets.quality.summary import summarize
root = Path({str(tmp_path)!r}) / 'set'
record(root, 1, cameras=True); resume(root, cameras=True).close(); summarize(root)
print({HEAVY} & set(sys.modules))"""
    assert _run(code) == "set()"


def test_the_encoder_is_silent(tmp_path):
    code = "import sys; sys.path.insert(0, 'tests/helpers'); from datasets_helpers import *; "
    code += "record(Path(sys.argv[1]), 1, cameras=True)"
    command = [sys.executable, "-c", code, str(tmp_path / "set")]
    done = subprocess.run(command, capture_output=True, text=True, check=True, cwd=ROOT)
    assert (done.stdout, done.stderr) == ("", "")
