// A gamepad: moves only while its dead-man button is held; unplugged, it has let go.
import { HELD } from "./keymap.js";
import { shaped } from "./inputs.js";

const PUSHED = 0.6; // of a stick that is to be chosen

export class Gamepad {
  // say(words): tells the person something
  constructor(inputs, act, say) {
    Object.assign(this, { inputs, act, say, device: "gamepad", pad: null, was: {}, isArmed: false, capture: null });
    addEventListener("gamepaddisconnected", () => this.look());
    addEventListener("gamepadconnected", () => this.look());
  }

  // Look which gamepad there is; a new one, or none, has everything let go.
  look() {
    const pad = [...navigator.getGamepads()].find((each) => each?.connected) ?? null;
    if (pad?.index !== this.pad?.index || pad?.id !== this.pad?.id) {
      if (!pad) this.say("Gamepad unplugged: it stops.");
      else this.say(`Gamepad found. Hold ${this.deadman(pad)} to move.`);
      this.was = null;
      this.letGo();
    }
    this.pad = pad;
    return pad;
  }

  deadman(pad) {
    return buttonName(this.inputs.mapping?.buttons.deadman ?? HELD.deadman.button, pad);
  }

  // How it is with the gamepad, in words; empty where there is none.
  get says() {
    if (!this.pad) return "";
    return this.isHeld ? "gamepad: moves" : `gamepad: hold ${this.deadman(this.pad)} to move`;
  }

  letGo() {
    this.isArmed = false; // until the dead-man was let go
  }

  isPressed(name) {
    const button = this.pad?.buttons[this.inputs.mapping.buttons[name]];
    return Boolean(button?.pressed);
  }

  get turns() {
    return Boolean(this.pad && this.inputs.mapping && this.isPressed("turn"));
  }

  get isHeld() {
    return Boolean(this.pad && this.inputs.mapping && this.isArmed && this.isPressed("deadman"));
  }

  // Deflections now, [[axis, value], …]; buttons that were just pressed act.
  moves() {
    const pad = this.look();
    if (!pad || !this.inputs.mapping) return [];
    if (this.capture) return this.choose(pad);
    this.actions();
    if (!this.isPressed("deadman")) this.isArmed = true;
    if (!this.isHeld) return [];
    const sticks = this.inputs.mapping.sticksOf(pad).map(([axis, sign]) => sign * shaped(pad.axes[axis] ?? 0));
    const moves = this.inputs.sticks().map(([index, axis, sign]) => [axis, sign * (sticks[index] ?? 0)]);
    const lift = this.value("up") - this.value("down");
    if (this.inputs.owned.has("ee.vz")) moves.push(["ee.vz", lift]);
    return moves;
  }

  value(name) {
    const value = this.pad.buttons[this.inputs.mapping.buttons[name]]?.value ?? 0;
    return Number.isFinite(value) ? value : 0;
  }

  actions() {
    const offered = Object.keys(this.inputs.mapping.offered);
    const now = Object.fromEntries([...offered, "turn"].map((name) => [name, this.isPressed(name)]));
    if (this.was && this.inputs.isHere) {
      for (const name of offered) if (now[name] && !this.was[name]) this.act(name);
      if (now.turn && !this.was.turn && !this.inputs.owned.has("ee.wx")) this.inputs.nextBank();
    }
    this.was = now;
  }

  // Someone changes what a button or stick does: the next one that moves is taken.
  ask(kind, taken) {
    const pad = this.look();
    if (pad) this.capture = { kind, taken, before: pushed(pad) };
  }

  choose(pad) {
    const { before } = this.capture, { pressed, axes } = this.capture.before = pushed(pad);
    const stop = this.inputs.mapping.buttons.stop;
    if (pressed[stop] && !before.pressed[stop]) { // whatever is asked, this is the stop
      this.capture = this.was = null;
      this.act("stop");
      return [];
    }
    const button = pressed.findIndex((now, index) => now && !before.pressed[index]);
    const axis = axes.findIndex((now, index) => now && !before.axes[index]);
    const { kind, taken } = this.capture;
    if (kind === "button" ? button < 0 : axis < 0) return [];
    this.capture = null;
    this.was = null;
    taken(kind === "button" ? button : [axis, axes[axis]], pad);
    return [];
  }
}

function pushed(pad) {
  return { pressed: pad.buttons.map((each) => each.pressed), axes: pad.axes.map((x) => (Math.abs(x) > PUSHED ? Math.sign(x) : 0)) };
}

const NAMES = ["A", "B", "X", "Y", "L1", "R1", "L2", "R2", "Back", "Start", "left stick", "right stick", "up", "down", "left", "right", "Home"];

export function buttonName(index, pad) {
  if (index < 0) return "none";
  return pad && pad.mapping !== "standard" ? `button ${index}` : NAMES[index] ?? `button ${index}`;
}
