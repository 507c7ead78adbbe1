// Which key, button and stick does what: as it came, or as a person has changed it; kept for each robot.
import { actionsOf, defaultKeys, heldOf, inForce } from "./keymap.js";
import { forget, keep, recall } from "./store.js";

export const STOP = "Space"; // is always the stop, whatever else changes
export const BACK = "Escape"; // always closes or cancels, and does nothing else
export const STICK_AXES = ["left stick, sideways", "left stick, up and down", "right stick, sideways", "right stick, up and down"];
// Where a browser does not know a gamepad, it numbers sticks and buttons as the driver does.
const OTHER_STICKS = [[0, 1], [1, 1], [3, 1], [4, 1]];
const STANDARD_STICKS = [[0, 1], [1, 1], [2, 1], [3, 1]];

const each = (table, what) => Object.fromEntries(Object.entries(table).map(([name, entry]) => [name, entry[what]]));

function defaults(stage) {
  return {
    keys: defaultKeys(stage),
    actions: each(actionsOf(stage), "key"),
    buttons: each({ ...actionsOf(stage), ...heldOf(stage) }, "button"),
    sticks: null, // as the gamepad has them
  };
}

const isCode = (value) => typeof value === "string" && value !== BACK && /^[A-Za-z0-9]{1,24}$/.test(value);
const isIndex = (value) => Number.isInteger(value) && value >= -1 && value < 64;
const sameNames = (value, wanted) => value !== null && typeof value === "object" && Object.keys(wanted).every((name) => name in value)
  && Object.keys(value).length === Object.keys(wanted).length;

// An older page ended the recording with that key.
function renewed(kept, first) {
  return kept.actions?.quit === BACK ? { ...kept, actions: { ...kept.actions, quit: first.actions.quit } } : kept;
}

// What was kept fits this robot and this page, piece by piece.
function isFine(kept, first) {
  const keys = Array.isArray(kept.keys) && kept.keys.length === first.keys.length
    && kept.keys.every((entry, index) => Array.isArray(entry) && isCode(entry[0]) && entry[0] !== STOP && entry[1] === first.keys[index][1] && entry[2] === first.keys[index][2]);
  const actions = sameNames(kept.actions, first.actions) && Object.values(kept.actions).every(isCode) && kept.actions.stop === STOP;
  const buttons = sameNames(kept.buttons, first.buttons) && Object.values(kept.buttons).every(isIndex) && kept.buttons.deadman >= 0;
  const sticks = kept.sticks === null || (Array.isArray(kept.sticks) && kept.sticks.length === 4
    && kept.sticks.every((each) => Array.isArray(each) && isIndex(each[0]) && Math.abs(each[1]) === 1));
  return keys && actions && buttons && sticks;
}

export class Mapping {
  constructor(stage) {
    this.name = `map:${stage.robot}`;
    Object.assign(this, { offered: actionsOf(stage), held: heldOf(stage) });
    this.first = defaults(stage);
    Object.assign(this, renewed(recall(this.name, (kept) => isFine(renewed(kept, this.first), this.first), this.first), this.first));
  }

  // The action of a key, or undefined.
  action(code) {
    return Object.keys(this.actions).find((name) => this.actions[name] === code);
  }

  // Where the four directions of two sticks are on a gamepad: [number of the axis, sign].
  sticksOf(pad) {
    if (this.sticks) return this.sticks;
    return pad.mapping !== "standard" && pad.axes.length >= 6 ? OTHER_STICKS : STANDARD_STICKS;
  }

  // Give an axis another key; whatever has that key now gets the old one.
  setKey(entry, code, owned) {
    if (code === STOP || code === BACK) return false;
    const old = entry[0], rival = inForce(this.keys, owned).find((each) => each[0] === code), action = this.action(code);
    this.keys = this.keys.map((each) => (each === entry ? [code, each[1], each[2]] : each === rival ? [old, each[1], each[2]] : each));
    if (action) this.actions = { ...this.actions, [action]: old };
    return this.keep();
  }

  setAction(name, code) {
    if (code === STOP || code === BACK || name === "stop") return false;
    const old = this.actions[name], action = this.action(code);
    this.keys = this.keys.map((each) => (each[0] === code ? [old, each[1], each[2]] : each));
    this.actions = { ...this.actions, ...(action ? { [action]: old } : {}), [name]: code };
    return this.keep();
  }

  setButton(name, index) {
    const old = this.buttons[name], rival = Object.keys(this.buttons).find((each) => this.buttons[each] === index);
    if (rival === "deadman" && old < 0) return false; // there is always one
    this.buttons = { ...this.buttons, ...(rival ? { [rival]: old } : {}), [name]: index };
    return this.keep();
  }

  setStick(direction, axis, sign, pad) {
    this.sticks = this.sticksOf(pad).map((each, index) => (index === direction ? [axis, sign] : each));
    return this.keep();
  }

  reset() {
    forget(this.name);
    Object.assign(this, this.first);
  }

  keep() {
    keep(this.name, { keys: this.keys, actions: this.actions, buttons: this.buttons, sticks: this.sticks });
    return true;
  }
}
