// All inputs together: deflections of every device are added up and clipped to a full stick.
// Sliders say where the arm's joints shall go; that wins over the joints' deflections.
import { inForce, sticksInForce } from "./keymap.js";
import { BACK, STOP } from "./mapping.js";

const DEAD = 0.12; // of a stick
const CURVE = 1.7; // exponent: fine near the middle
const NATIVE = ["ArrowUp", "ArrowDown", "ArrowLeft", "ArrowRight", "Home", "End", "PageUp", "PageDown"];
const SCROLLS = ["Space", "ArrowLeft", "ArrowRight", "ArrowDown", "ArrowUp", "Backspace"];

export function shaped(value) {
  const size = Math.abs(value);
  if (!(size >= DEAD)) return 0; // also where it is no number
  return Math.sign(value) * Math.min(1, (size - DEAD) / (1 - DEAD)) ** CURVE;
}

const isTyping = (element) => element.matches("textarea, input:not([type=range], [type=checkbox], [type=radio])");

// What a key does by itself in the control that has the focus: it must stay so for those who use no mouse.
function isNative(element, code) {
  if (element.matches("select, input[type=range], input[type=radio], [role=slider]")) return NATIVE.includes(code);
  return code === "Enter" && element.matches("button, summary, a, input");
}

export class Inputs {
  // act(name): an action is asked for
  constructor(act) {
    this.act = act;
    this.held = new Set();
    this.owned = new Set();
    const keyboard = { device: "keyboard", moves: () => this.keyed(), letGo: () => this.held.clear() };
    this.sources = [keyboard]; // each {device, moves(), letGo(), targets where it has some, turns: whether its sticks turn the hand}
    this.mapping = null;
    this.device = "keyboard";
    this.grips = [false]; // which grippers shall be closed, one a hand
    this.parts = {}; // what parts of axes stand for, where there are several hands
    this.bank = 0; // which of what they can move the sticks move
    this.isShared = false; // with a policy
    this.hasFocus = document.hasFocus();
    this.listen();
  }

  listen() {
    addEventListener("keydown", (event) => this.press(event), true);
    addEventListener("keyup", (event) => this.held.delete(event.code), true);
    addEventListener("blur", () => this.release(false));
    addEventListener("focus", () => { this.hasFocus = true; });
    document.addEventListener("visibilitychange", () => { if (document.hidden) this.release(this.hasFocus); });
    addEventListener("pagehide", () => this.release(false));
    for (const event of ["pointerdown", "focusin"]) addEventListener(event, ({ target }) => { if (target.closest?.("select")) this.giveKeys(); }, true);
    addEventListener("dragstart", () => this.giveKeys(), true);
    addEventListener("contextmenu", (event) => { // not while a thumb rests on a stick
      if (event.target.closest?.("#sticks")) event.preventDefault();
      else if (!event.defaultPrevented) this.giveKeys();
    });
  }

  // A list, a menu or a drag of the browser takes all keys, also when they go up; with them nobody could stop a policy.
  giveKeys() {
    this.release(this.hasFocus);
    if (this.isShared) this.act("pause");
  }

  get entries() {
    return this.mapping?.keys ?? [];
  }

  release(hasFocus) {
    for (const source of this.sources) source.letGo();
    this.hasFocus = hasFocus;
  }

  press(event) {
    if (event.metaKey) this.held.clear(); // macOS tells of no key that goes up while that one is held
    if (event.code !== STOP && document.querySelector("#study:not([hidden])")) return; // a card is read, and nothing moves
    if (!this.mapping || isTyping(event.target) || (event.code !== STOP && (event.ctrlKey || event.metaKey || event.altKey))) return;
    if (event.code === BACK) {
      if (this.act("back")) event.preventDefault();
      return;
    }
    if (this.capture && event.code !== STOP) {
      event.preventDefault();
      event.stopPropagation();
      const taken = this.capture;
      this.capture = null;
      taken(event.code);
      return;
    }
    if (event.code === "Enter" && (event.repeat || event.target.matches("input[type=checkbox]"))) {
      event.preventDefault();
      if (!event.repeat) event.target.click(); // Space, that does it elsewhere, is STOP
      return; // a key that stays down is one press
    }
    if (isNative(event.target, event.code)) return;
    const driving = this.entriesInForce().some(([code]) => code === event.code);
    const action = this.mapping.action(event.code);
    const acted = !driving && action && !event.repeat && this.act(action) !== false;
    if (driving || acted || SCROLLS.includes(event.code)) {
      event.preventDefault();
      if (!event.target.matches("body, [role=slider]")) document.activeElement.blur();
    }
    if (driving && !event.repeat) this.held.add(event.code); // else it was held before: it has to go up first
  }

  entriesInForce() {
    return inForce(this.entries, this.owned);
  }

  // Deflections of the keys, [[axis, value], …].
  keyed() {
    return this.entriesInForce().filter(([code]) => this.held.has(code)).map(([, axis, sign]) => [axis, sign]);
  }

  // The channel that an axis of keys and sticks is now.
  channelOf(axis, parts = this.parts) {
    const [part, way] = axis.split(".");
    if (!(part in parts)) return axis;
    return parts[part].includes(".") ? parts[part] : `${parts[part]}.${way}`;
  }

  flipGrip(hand) {
    this.grips = this.grips.map((isClosed, index) => (index === hand ? !isClosed : isClosed));
  }

  // Which axes two sticks move now.
  sticks() {
    return this.bankOf().sticks;
  }

  nextBank() {
    this.bank = (this.bank + 1) % this.bankOf().count;
  }

  bankOf() {
    return sticksInForce(this.owned, this.sources.some(({ turns }) => turns), this.bank);
  }

  get isHere() {
    return this.hasFocus && !document.hidden;
  }

  // Returns {axes, device, on, grips, targets}; `channels` names the axes.
  read(channels) {
    const sums = new Map();
    let targets = [];
    for (const source of this.sources) {
      const moves = source.moves().filter(([, value]) => value);
      const wanted = source.targets ?? [];
      if (moves.length || wanted.length) this.device = source.device;
      for (const [axis, value] of moves) sums.set(this.channelOf(axis), (sums.get(this.channelOf(axis)) ?? 0) + value);
      if (wanted.length) targets = [...wanted];
    }
    const axes = channels.map((name) => (this.isHere ? Math.max(-1, Math.min(1, sums.get(name) ?? 0)) : 0));
    return { axes, device: this.device, on: this.isHere, grips: this.grips, targets: this.isHere ? targets : [] };
  }
}
