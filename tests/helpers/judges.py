"""What strangers judge our datasets by, and which of their findings are more than a rule for other robots."""

import warnings

import numpy as np

from handrail.controllers.robot.model import load_model
from handrail.datasets.reading.reader import read_frames, read_info

WIDER = ("ACTION_STATE_DIVERGENCE_CRASHED", "ACTION_RANGE_MISMATCH_CRASHED")
HARMLESS = ("SATURATED_JOINT", "LOW_DIVERSITY")  # warnings: a joint that rests, few episodes
ROUNDING = 1e-5  # of a gripper that is open, in single precision and under gravity


def doctor_fails(root):
    """Return what lerobot-doctor calls a failure."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        from lerobot_doctor.dataset_loader import load_dataset
        from lerobot_doctor.runner import Severity, run_checks

        report = run_checks(load_dataset(str(root)))
    assert len(report.results) >= 11
    assert report.total_episodes == read_info(root).episodes
    return [
        said.message
        for result in report.results
        for said in result.messages
        if said.severity is Severity.FAIL
    ]


def lint_defects(root):
    """Return what lerobot-lint finds that is a defect."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        from lerobot_lint.config import load_profile
        from lerobot_lint.engine import check_dataset

        findings = check_dataset(str(root), load_profile("default"))
    assert findings
    return [
        finding.message for finding in findings if finding.severity != "info" and is_defect(root, finding)
    ]


def is_defect(root, finding):
    """Return whether a finding is more than a rule for arms whose state and action are the same joints."""
    if finding.check in WIDER:  # it reads the state's entries in the action, which has fewer
        width = len(read_info(root).features["action"].names)
        return f"index {width} is out of bounds for axis 1 with size {width}" not in finding.message
    if finding.check == "DEAD_JOINT":
        return not does_as_told(root, finding)
    if finding.check == "DISCONTINUITY":
        return not is_motion(root, finding)
    return finding.check not in HARMLESS


def does_as_told(root, finding):
    """Return whether what hardly moves was hardly told to: the joint, the gripper, or what moves the tool."""
    joint, _, kind = state_name(root, finding).partition(".")
    frames, info = read_frames(root, finding.episode, ["observation.state", "action"]), read_info(root)
    if joint == "gripper":
        return not frames["action"][:, -1].any()
    if joint == "tool":
        return kind != "x"  # the tool may keep its height and its turn, but a reaching hand goes somewhere
    state, action = info.features["observation.state"].names, info.features["action"].names
    moved = frames["observation.state"][1:, state.index(f"{joint}.vel")]
    return np.abs(moved - frames["action"][:-1, action.index(f"v_{joint}")]).max() < 0.1


def is_motion(root, finding):
    """Return whether a jump is rounding, or motion as fast as the robot may move; joints move the tool."""
    joint, _, kind = state_name(root, finding).partition(".")
    info, model = read_info(root), load_model(read_info(root).robot_type)
    limits, jump = model.description.limits, abs(finding.data["delta"])
    if joint == "tool":
        moved = np.abs(np.diff(read_frames(root, finding.episode)["observation.state"], axis=0))
        return bool(np.all(moved[:, : model.size] <= 1.1 * limits.velocity / info.fps))
    if kind == "vel":
        return jump < 1.5 * limits.acceleration[model.joints.index(joint)] / info.fps
    return jump < ROUNDING


def state_name(root, finding):
    return read_info(root).features["observation.state"].names[int(finding.joint)]
