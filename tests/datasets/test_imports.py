"""Recording must start at once, and say nothing."""

import subprocess
import sys

from places import ROOT

HEAVY = "{'torch', 'lerobot', 'datasets', 'pandas', 'scipy', 'casadi', 'pinocchio', 'mujoco'}"


def test_recording_and_reading_import_nothing_heavy_and_say_nothing(tmp_path):
    code = f"""
import sys; sys.path.insert(0, 'tests/helpers')
from datasets_helpers import *
import handrail.datasets.recording.repair
from handrail.datasets.quality.summary import summarize
root = Path({str(tmp_path)!r}) / 'set'
record(root, 1, cameras=True); resume(root, cameras=True).close(); summarize(root)
print({HEAVY} & set(sys.modules))"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT)
    assert (done.stdout.strip(), done.stderr) == ("set()", "")
