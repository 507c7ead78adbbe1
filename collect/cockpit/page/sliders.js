// Sliders as a leader arm: while one is held, the arm's joints go where the sliders are.
// A slider that was let go stands where the arm is, and moves from there: nothing jumps.
import { ENDS } from "./dom.js";
import { jointName, owns } from "./keymap.js";

const STEP = 0.03; // of an arrow key [rad]
const ARROWS = { ArrowRight: 1, ArrowUp: 1, ArrowLeft: -1, ArrowDown: -1 };

export class Sliders {
  // choose(channel): a joint's name or bar was clicked
  constructor(box, choose) {
    Object.assign(this, { box, choose, device: "sliders", held: new Set(), targets: [], q: [], rows: [] });
  }

  stage(stage) {
    this.base = stage.base;
    this.letGo();
    this.rows = stage.joints.slice(stage.base).map((name, index) => this.row(name, index, stage));
    this.box.replaceChildren(...this.rows.map(({ whole }) => whole));
  }

  row(name, index, stage) {
    const low = stage.lower[this.base + index] ?? -Math.PI, high = stage.upper[this.base + index] ?? Math.PI;
    const whole = document.createElement("div"), words = document.createElement("span"), keys = document.createElement("kbd"), track = document.createElement("div"), knob = document.createElement("i");
    whole.className = "slider";
    words.textContent = jointName(name);
    Object.assign(track, { className: "track", tabIndex: 0 });
    for (const [key, value] of Object.entries({ role: "slider", "aria-label": jointName(name), "aria-valuemin": low, "aria-valuemax": high })) track.setAttribute(key, value);
    track.append(knob);
    whole.append(words, track);
    words.prepend(keys, " ");
    whole.addEventListener("pointerdown", () => this.choose(row.channel));
    const row = { whole, keys, track, knob, low, high, channel: `joint.${name}` };
    this.listen(row, index);
    return row;
  }

  listen(row, index) {
    const { track } = row;
    let from = 0, start = 0;
    track.addEventListener("pointerdown", (event) => {
      if (track.getAttribute("aria-disabled") === "true") return;
      event.preventDefault();
      track.setPointerCapture(event.pointerId);
      this.hold(index);
      from = event.clientX;
      start = this.targets[index];
    });
    track.addEventListener("pointermove", (event) => {
      if (this.held.has(index) && track.hasPointerCapture(event.pointerId)) this.put(index, start + (event.clientX - from) / track.clientWidth * (row.high - row.low));
    });
    for (const end of ENDS) track.addEventListener(end, () => this.drop(index));
    track.addEventListener("keydown", (event) => {
      if (!(event.code in ARROWS) || track.getAttribute("aria-disabled") === "true") return;
      event.preventDefault();
      if (event.repeat && !this.held.has(index)) return; // held since before: it has to go up first
      this.hold(index);
      this.put(index, this.targets[index] + STEP * ARROWS[event.code]);
    });
    for (const end of ["keyup", "blur"]) track.addEventListener(end, () => this.drop(index));
  }

  // The first one that is held: all joints stay where the arm is now.
  hold(index) {
    if (!this.held.size) this.targets = this.q.slice(this.base);
    this.held.add(index);
  }

  put(index, value) {
    if (!this.held.has(index)) return; // let go meanwhile
    const { low, high } = this.rows[index];
    this.targets[index] = Math.min(high, Math.max(low, value));
    this.draw();
  }

  drop(index) {
    this.held.delete(index);
    if (!this.held.size) this.targets = [];
    this.draw();
  }

  letGo() {
    this.held.clear();
    this.targets = [];
  }

  moves() {
    return [];
  }

  // Show each joint's keys, [[channel, key], …].
  letter(entries) {
    for (const { keys, channel } of this.rows) keys.textContent = entries.filter(([each]) => each === channel).map(([, key]) => key).join(" ");
  }

  // Show where the arm is; sliders are there only where the arm's joints are steered.
  frame(frame, owned) {
    this.q = frame.q;
    const isShown = frame.mode !== "direct_single" && this.rows.some(({ channel }) => owned.has(channel)) && !owns(owned, "ee.");
    if (!isShown) this.letGo();
    this.box.closest("[data-sliders]").hidden = !isShown;
    if (!isShown) return;
    for (const { track, channel } of this.rows) track.setAttribute("aria-disabled", String(!owned.has(channel)));
    this.draw();
  }

  draw() {
    this.rows.forEach(({ track, knob, low, high }, index) => {
      const value = this.targets[index] ?? this.q[this.base + index] ?? low;
      knob.style.left = `${Math.min(100, Math.max(0, 100 * (value - low) / (high - low)))}%`;
      track.classList.toggle("held", this.held.has(index));
      track.setAttribute("aria-valuenow", value.toFixed(2));
    });
  }
}
