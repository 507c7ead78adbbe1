"""What strangers judge our datasets by: lerobot-doctor fails nothing, lerobot-lint finds no defect.

Datasets that people drive are judged where they are recorded: `test_recording.py` of the local operators, and
`test_page_episodes.py` of the cockpit.
"""

import pytest
from canned import canned
from command_helpers import ran
from judges import doctor_fails, lint_defects

from handrail.datasets.reading.reader import read_info

SHORT = "--task reach --dataset.num_episodes"
DATASETS = {
    "several modes among movers": tuple(
        f"{SHORT} {words} --moving_obstacles 2" for words in ("2", "1 --mode switching --resume")
    ),
    "cameras": (f"{SHORT} 1 --cameras wrist,scene --image_size 32",),
}


def recorded(root, name):
    for words in DATASETS[name]:
        ran(*words.split(), "--dataset.root", root)


@pytest.fixture(
    scope="module",
    params=[
        pytest.param(name, marks=[pytest.mark.needs_gl] if name == "cameras" else []) for name in DATASETS
    ],
)
def root(request):
    return canned(recorded, request.param)


@pytest.fixture(scope="module")
def edited(root):
    """The same, trimmed, relabelled, renamed, and merged with its own last episode."""
    new, last = root.with_name("edited"), read_info(root).episodes - 1
    lines = (
        f"trim {root} --output {new}_1",
        f"relabel {new}_1 --episodes 0 --label failure --reason slipped --in_place",
        f"rename {new}_1 --task touch --in_place",
        f"keep {root} --episodes {last} --output {new}_2",
        f"merge {new}_1 {new}_2 --output {new}",
    )
    for line in lines:
        ran(*line.split(), name="edit")
    return new


@pytest.mark.parametrize("judge", [doctor_fails, lint_defects])
def test_recorded_datasets_pass(root, judge):
    assert not judge(root)


@pytest.mark.parametrize("judge", [doctor_fails, lint_defects])
def test_edited_and_merged_datasets_pass(edited, judge):
    assert not judge(edited)
