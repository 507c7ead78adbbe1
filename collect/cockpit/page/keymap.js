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
  "apart.v": ["hands together", "hands apart"],
};
// The same in a word, both ways.
export const SHORT = {
  "ee.vx": "forward", "ee.vy": "sideways", "ee.vz": "up", "ee.wx": "roll", "ee.wy": "tip", "ee.wz": "turn",
  "base.vx": "drive", "base.vy": "sideways", "base.wz": "turn", "apart.v": "apart",
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
const SECOND = [ // of two hands that are steered at once; the first one has the hand's keys
  ["KeyI", "two.vx", 1], ["KeyK", "two.vx", -1], ["KeyJ", "two.vy", 1], ["KeyL", "two.vy", -1], ["KeyU", "two.vz", 1], ["KeyO", "two.vz", -1],
];
const APART = [["Digit0", "apart.v", 1], ["Digit9", "apart.v", -1]];
const LONE = [["Period", "lone.v", 1], ["Comma", "lone.v", -1]]; // of a joint that is steered beside a hand
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
  undo: { says: "undo, to where you went on last", key: "Backquote", button: 12 },
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
// What is done once with this robot: where it has several hands, each gripper has a key and a trigger of its own.
export function actionsOf({ hands }) {
  if (hands.length < 2) return ACTIONS;
  const { grip, ...others } = ACTIONS;
  const gripOf = ({ name }) => grip.says.replace("the", `the ${name}`);
  return {
    hand: { says: "the other hand; of joints, the next that digits turn", key: "Slash", button: 0 },
    grip_left: { says: gripOf(hands[0]), key: "ShiftLeft", button: 6 },
    grip_right: { says: gripOf(hands[1]), key: "ShiftRight", button: 7 },
    ...others,
  };
}
// What is held on a gamepad.
export const HELD = {
  deadman: { says: "hold to move", button: 4 },
  turn: { says: "hold: sticks turn the hand; press: they move other joints, or the base", button: 5 },
  up: { says: "hand up", button: 7 },
  down: { says: "hand down", button: 6 },
};
export function heldOf({ hands }) {
  const { up, down, ...others } = HELD;
  return hands.length < 2 ? HELD : others; // the triggers are the grippers'
}
export const STICKS = {
  hand: [[0, "ee.vy", -1], [1, "ee.vx", -1], [2, "ee.wz", -1], [3, "ee.vz", -1]],
  turn: [[0, "ee.wx", 1], [1, "ee.wy", -1], [2, "ee.wz", -1]], // while "turn" is held
  base: [[0, "base.vy", -1], [1, "base.vx", -1], [2, "base.wz", -1]],
  both: [[0, "base.wz", -1], [1, "base.vx", -1], [2, "ee.vy", -1], [3, "ee.vx", -1]],
  hands: [[0, "one.vy", -1], [1, "one.vx", -1], [2, "two.vy", -1], [3, "two.vx", -1]],
  hands_turn: [[0, "one.wz", -1], [1, "one.vz", -1], [2, "two.wz", -1], [3, "two.vz", -1]],
  apart: [[3, "apart.v", -1]], // of a pair, while "turn" is held
};

// The joints' channels that digits reach at a time: those that move one hand alone, then the rest; as many as there are keys.
export function digitGroups({ joints, base, hands }) {
  const movedBy = (index) => hands.length < 2 ? [0] : hands.flatMap((hand, number) => (hand.joints.includes(index) ? [number] : []));
  const arm = joints.flatMap((name, index) => (index < base ? [] : [{ channel: `joint.${name}`, by: movedBy(index) }]));
  const sets = [...hands.keys(), null].map((hand) => ({ hand, own: arm.filter(({ by }) => (by.length === 1 ? by[0] : null) === hand) }));
  return sets.flatMap(({ hand, own }) => own.flatMap((_, index) => (index % BELOW.length ? [] : [{ hand, channels: own.slice(index, index + BELOW.length).map(({ channel }) => channel) }])));
}

// The keys of the arm's joints are drawn from the robot: a digit turns one way, the key below it the other way.
// Where there are more joints than such keys, they mean one group of them after the other.
export function defaultKeys(stage) {
  const all = stage.joints.slice(stage.base).map((name) => `joint.${name}`), groups = digitGroups(stage);
  const arm = groups.length > 1 ? BELOW.map((_, index) => `digit${index + 1}.v`) : all;
  const joints = arm.flatMap((axis, index) => [[`Digit${index + 1}`, axis, 1], [BELOW[index], axis, -1]]);
  const first = HAND.slice(0, SECOND.length).map(([code, axis, sign]) => [code, axis.replace("ee", "one"), sign]);
  return [...HAND, ...BASE, ...joints, ...(stage.hands.length > 1 ? [...first, ...SECOND, ...APART, ...LONE] : [])];
}

export const BY_JOINTS = "base by its joints"; // owned: keys and sticks of the base mean its joints

// Whether something is owned whose name begins so, such as "ee.".
export const owns = (owned, start) => [...owned].some((name) => name.startsWith(start));

const drives = (axis, owned) => owned.has(axis) || (axis.startsWith("base.") && owned.has(BY_JOINTS));

const FIRST = [["one.", "two."], ["ee.", "apart."], [""]]; // of two on one key, the hand's; of both hands, each one's

// Which of the entries count now: those of what is owned.
export function inForce(entries, owned) {
  const found = [], taken = new Set();
  for (const parts of FIRST) {
    const more = entries.filter((entry) => !found.includes(entry) && !taken.has(entry[0]) && parts.some((part) => entry[1].startsWith(part)) && drives(entry[1], owned));
    found.push(...more);
    for (const [code] of more) taken.add(code);
  }
  return found;
}

// What two sticks can move in turn where these channels are owned: hand, base or both; of joints, four at a time.
function banks(owned, turns) {
  const arm = [...owned].filter((name) => name.startsWith("joint.") && !name.includes("base"));
  const fours = arm.flatMap((_, index) => (index % 4 ? [] : [arm.slice(index, index + 4).map((axis, each) => [each, axis, 1])]));
  const isHand = owns(owned, "ee."), isBase = owned.has("base.vx") || owned.has(BY_JOINTS);
  if (owned.has("two.vx")) return [turns ? STICKS.hands_turn : STICKS.hands, ...fours];
  if (isHand) return [turns ? [...STICKS.turn, ...STICKS.apart, [3, "lone.v", -1]] : isBase ? STICKS.both : STICKS.hand, ...fours];
  return [...fours, ...(isBase || !arm.length ? [STICKS.base] : [])];
}

// Which axes two sticks move now, and how many banks of them there are.
export function sticksInForce(owned, turns, bank) {
  const all = banks(owned, turns);
  const chosen = all[bank % all.length];
  const extra = chosen === STICKS.hand && !owned.has("ee.vx") ? STICKS.turn.slice(0, 2) : [];
  return { sticks: [...chosen, ...extra].filter(([, axis]) => drives(axis, owned)), count: all.length };
}

// Keys go by their place; what this keyboard has there is said where the browser knows it.
const layout = await navigator.keyboard?.getLayoutMap().catch(() => null);
const KEY_NAMES = {
  Backquote: "`", Minus: "−", Equal: "=", BracketLeft: "[", BracketRight: "]", Semicolon: ";", Quote: "'", Comma: ",",
  Period: ".", Slash: "/", Backslash: "\\", ArrowRight: "→", ArrowLeft: "←", ArrowUp: "↑", ArrowDown: "↓",
  ShiftLeft: "left Shift", ShiftRight: "right Shift", Escape: "Esc",
};

export function keyName(code) {
  const own = code.startsWith("Digit") ? null : layout?.get(code);
  if (own) return code.startsWith("Key") ? own.toUpperCase() : own;
  return KEY_NAMES[code] ?? code.replace(/^Key|^Digit/, "");
}

export function jointName(name) {
  return name.replace("joint.", "").replace(/_joint$/, "").replaceAll("_", " ");
}

// What moves along a channel, both ways; of several hands with the hand's name. Nothing for a joint.
export function wordsOf(channel) {
  const [part, way] = channel.split("."), words = part !== "joint" && AXES[`ee.${way}`];
  return AXES[channel] ?? (words || undefined)?.map((each) => each.replace("hand", part === "pair" ? "both hands:" : `${part} hand`));
}

// The same in a word.
export function shortName(channel) {
  return SHORT[channel] ?? (wordsOf(channel) ? SHORT[`ee.${channel.split(".")[1]}`] : jointName(channel));
}

export function axisName(axis, sign) {
  const words = wordsOf(axis);
  if (words) return words[sign > 0 ? 1 : 0];
  return `${jointName(axis)} ${sign > 0 ? "+" : "−"}`;
}
