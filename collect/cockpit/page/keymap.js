// What keys and sticks mean as long as nobody has changed it; the words for it.
export const AXES = {
  "base.vx": ["base backward", "base forward"],
  "base.vy": ["base right", "base left"],
  "base.wz": ["base turns right", "base turns left"],
  "ee.vx": ["hand backward", "hand forward"],
  "ee.vy": ["hand right", "hand left"],
  "ee.vz": ["hand down", "hand up"],
  "ee.wx": ["hand rolls left", "hand rolls right"],
  "ee.wy": ["hand tips up", "hand tips down"],
  "ee.wz": ["hand turns right", "hand turns left"],
};
// The same in a word, both ways.
export const SHORT = {
  "ee.vx": "forward", "ee.vy": "sideways", "ee.vz": "up", "ee.wx": "roll", "ee.wy": "tip", "ee.wz": "turn",
  "base.vx": "drive", "base.vy": "sideways", "base.wz": "turn",
};
const HAND = [
  ["KeyW", "ee.vx", 1], ["KeyS", "ee.vx", -1], ["KeyA", "ee.vy", 1], ["KeyD", "ee.vy", -1],
  ["KeyR", "ee.vz", 1], ["KeyF", "ee.vz", -1], ["KeyQ", "ee.wz", 1], ["KeyE", "ee.wz", -1],
  ["KeyT", "ee.wy", -1], ["KeyG", "ee.wy", 1], ["KeyZ", "ee.wx", -1], ["KeyX", "ee.wx", 1],
];
const BASE = [
  ["KeyI", "base.vx", 1], ["KeyK", "base.vx", -1], ["KeyJ", "base.vy", 1], ["KeyL", "base.vy", -1],
  ["KeyU", "base.wz", 1], ["KeyO", "base.wz", -1],
];
const BELOW = ["KeyZ", "KeyX", "KeyC", "KeyV", "KeyB", "KeyN", "KeyM"];

// What is done once: its words, its key, its button on a gamepad (of the standard layout; -1: none).
export const ACTIONS = {
  start: { says: "start, pause, go on", key: "Enter", button: 9 },
  pause: { says: "pause", key: "KeyP", button: -1 },
  stop: { says: "STOP", key: "Space", button: 1 },
  grip: { says: "open or close the gripper", key: "ShiftLeft", button: 0 },
  success: { says: "done", key: "ArrowRight", button: 3 },
  failure: { says: "failed", key: "ArrowDown", button: 13 },
  restart: { says: "again from the start", key: "ArrowLeft", button: 2 },
  discard: { says: "throw away", key: "Backspace", button: 16 },
  undo: { says: "undo to the checkpoint", key: "Backquote", button: 12 },
  quit: { says: "end the recording", key: "End", button: -1 },
  focus: { says: "base or hand", key: "KeyB", button: 11 },
  mode: { says: "next mode", key: "BracketRight", button: 8 },
  joint: { says: "one joint alone, the next", key: "Semicolon", button: -1 },
  frame: { says: "next frame of the hand", key: "KeyY", button: -1 },
  camera: { says: "next camera", key: "KeyV", button: -1 },
  slower: { says: "slower", key: "Minus", button: -1 },
  faster: { says: "faster", key: "Equal", button: 10 },
  help: { says: "this card", key: "KeyH", button: -1 },
};
// What is held on a gamepad.
export const HELD = {
  deadman: { says: "hold to move", button: 4 },
  turn: { says: "hold: sticks turn the hand; press: they move other joints, or the base", button: 5 },
  up: { says: "hand up", button: 7 },
  down: { says: "hand down", button: 6 },
};
export const STICKS = {
  hand: [[0, "ee.vy", -1], [1, "ee.vx", -1], [2, "ee.wz", -1], [3, "ee.vz", -1]],
  turn: [[0, "ee.wx", 1], [1, "ee.wy", -1], [2, "ee.wz", -1]], // while "turn" is held
  base: [[0, "base.vy", -1], [1, "base.vx", -1], [2, "base.wz", -1]],
  both: [[0, "base.wz", -1], [1, "base.vx", -1], [2, "ee.vy", -1], [3, "ee.vx", -1]],
};

// The keys of the arm's joints are drawn from the robot: a digit turns one way, the key below it the other way.
export function defaultKeys(stage) {
  const arm = stage.joints.slice(stage.base, stage.base + BELOW.length);
  const joints = arm.flatMap((name, index) => [[`Digit${index + 1}`, `joint.${name}`, 1], [BELOW[index], `joint.${name}`, -1]]);
  return [...HAND, ...BASE, ...joints];
}

export const BY_JOINTS = "base by its joints"; // owned: keys and sticks of the base mean its joints

const drives = (axis, owned) => owned.has(axis) || (axis.startsWith("base.") && owned.has(BY_JOINTS));

// Which of the entries count now: those of what is owned; of two on one key, the hand's.
export function inForce(entries, owned) {
  const hand = entries.filter(([, axis]) => axis.startsWith("ee.") && owned.has(axis));
  const taken = new Set(hand.map(([code]) => code));
  return [...hand, ...entries.filter(([code, axis]) => !axis.startsWith("ee.") && !taken.has(code) && drives(axis, owned))];
}

// What two sticks can move in turn where these channels are owned: hand, base or both; of joints, four at a time.
function banks(owned, turns) {
  const arm = [...owned].filter((name) => name.startsWith("joint.") && !name.includes("base"));
  const fours = arm.flatMap((_, index) => (index % 4 ? [] : [arm.slice(index, index + 4).map((axis, each) => [each, axis, 1])]));
  const isHand = [...owned].some((name) => name.startsWith("ee.")), isBase = owned.has("base.vx") || owned.has(BY_JOINTS);
  if (isHand) return [turns ? STICKS.turn : isBase ? STICKS.both : STICKS.hand, ...fours];
  return [...fours, ...(isBase || !arm.length ? [STICKS.base] : [])];
}

// Which axes two sticks move now, and how many banks of them there are.
export function sticksInForce(owned, turns, bank) {
  const all = banks(owned, turns);
  const chosen = all[bank % all.length];
  const extra = chosen === STICKS.hand && !owned.has("ee.vx") ? STICKS.turn.slice(0, 2) : [];
  return { sticks: [...chosen, ...extra].filter(([, axis]) => drives(axis, owned)), count: all.length };
}

const KEY_NAMES = {
  Backquote: "`", Minus: "−", Equal: "=", BracketLeft: "[", BracketRight: "]", Semicolon: ";", Quote: "'", Comma: ",",
  Period: ".", Slash: "/", Backslash: "\\", ArrowRight: "→", ArrowLeft: "←", ArrowUp: "↑", ArrowDown: "↓",
  ShiftLeft: "left Shift", ShiftRight: "right Shift", Escape: "Esc",
};

export function keyName(code) {
  return KEY_NAMES[code] ?? code.replace(/^Key|^Digit/, "");
}

export function jointName(name) {
  return name.replace("joint.", "").replace(/_joint$/, "").replaceAll("_", " ");
}

export function axisName(axis, sign) {
  if (axis in AXES) return AXES[axis][sign > 0 ? 1 : 0];
  return `${jointName(axis)} ${sign > 0 ? "+" : "−"}`;
}
