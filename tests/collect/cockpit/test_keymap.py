"""Laws of the page's keys: each joint of the robot has one."""

from page_script import printed

WORDS = """
const { defaultKeys } = await import(process.argv[1]);
const joints = ["x", "y", "theta", "a1", "a2", "a3", "a4", "a5", "pan", "tilt"];
const stage = { joints, base: 3, hands: [{ name: "", joints: [0, 1, 2, 3, 4, 5, 6, 7] }] };
console.log(JSON.stringify(defaultKeys(stage)));
"""


def test_the_head_of_a_robot_with_one_hand_has_keys():
    assert {"joint.a1", "joint.pan", "joint.tilt"} <= {axis for _, axis, _ in printed(WORDS, "keymap.js")}
