// The card of keys, buttons and sticks, drawn from the mapping in force; a click changes one.
import { byId } from "./dom.js";
import { buttonName } from "./gamepad.js";
import { axisName, keyName } from "./keymap.js";
import { STICK_AXES, STOP } from "./mapping.js";

function table(rows) {
  const made = document.createElement("dl");
  for (const [words, value, act] of rows) {
    const name = document.createElement("dt"), cell = document.createElement("dd"), button = document.createElement("button");
    name.textContent = words;
    button.textContent = value;
    button.setAttribute("aria-label", `${words}: ${value}. Change it`);
    if (act) button.addEventListener("click", () => act(button));
    else button.disabled = true;
    cell.append(button);
    made.append(name, cell);
  }
  return made;
}

export class Help {
  // changed(): the mapping is another
  constructor(inputs, gamepad, changed) {
    Object.assign(this, { inputs, gamepad, changed });
    byId("help-reset").addEventListener("click", () => { inputs.mapping.reset(); this.redraw(); });
  }

  get isOpen() {
    return !byId("help").hidden;
  }

  toggle() {
    byId("help").hidden = this.isOpen;
    this.cancel();
  }

  // Whatever was to be changed stays as it is; returns whether something was.
  cancel() {
    const wasAsked = Boolean(this.inputs.capture || this.gamepad.capture);
    this.inputs.capture = this.gamepad.capture = null;
    this.draw();
    return wasAsked;
  }

  close() {
    const wasOpen = this.isOpen;
    if (wasOpen) this.toggle();
    return wasOpen;
  }

  draw() {
    if (!this.isOpen || !this.inputs.mapping) return;
    byId("help-table").replaceChildren(this.keys());
    byId("help-actions").replaceChildren(this.actions());
    const pad = this.gamepad.look();
    byId("help-pad-box").hidden = !pad;
    if (pad) byId("help-pad").replaceChildren(this.buttons(pad), this.sticks(pad));
  }

  redraw() {
    this.draw();
    this.changed();
  }

  keys() {
    const { inputs } = this;
    return table(inputs.entriesInForce().map((entry) => [
      axisName(inputs.channelOf(entry[1]), entry[2]), keyName(entry[0]), (button) => this.key(button, (code) => inputs.mapping.setKey(entry, code, inputs.owned)),
    ]));
  }

  actions() {
    const { mapping } = this.inputs;
    return table(Object.entries(mapping.offered).map(([name, { says }]) => [
      says, keyName(mapping.actions[name]), mapping.actions[name] === STOP ? null : (button) => this.key(button, (code) => mapping.setAction(name, code)),
    ]));
  }

  buttons(pad) {
    const { mapping } = this.inputs;
    return table(Object.entries({ ...mapping.held, ...mapping.offered }).map(([name, { says }]) => [
      says, buttonName(mapping.buttons[name], pad), (button) => this.pad(button, "button", "press a button", (index) => mapping.setButton(name, index)),
    ]));
  }

  sticks(pad) {
    const { mapping } = this.inputs;
    return table(STICK_AXES.map((says, direction) => {
      const [axis, sign] = mapping.sticksOf(pad)[direction];
      const words = direction % 2 ? "push it down" : "push it right";
      return [says, `axis ${axis}${sign < 0 ? ", reversed" : ""}`, (button) => this.pad(button, "axis", words, ([index, way], which) => mapping.setStick(direction, index, way, which))];
    }));
  }

  key(button, change) {
    this.draft(button, "press a key");
    this.inputs.capture = (code) => { change(code); this.redraw(); };
  }

  pad(button, kind, words, change) {
    this.draft(button, words);
    this.gamepad.ask(kind, (...chosen) => { change(...chosen); this.redraw(); });
  }

  // One change at a time.
  draft(button, words) {
    this.inputs.capture = this.gamepad.capture = null;
    for (const each of byId("help").querySelectorAll(".asked")) each.classList.remove("asked");
    button.classList.add("asked");
    button.textContent = words;
  }
}
