// Two sticks for thumbs, or the mouse: where a finger is on them, they are. Each finger has its own.
import { ENDS, write } from "./dom.js";
import { shaped } from "./inputs.js";
import { owns, shortName } from "./keymap.js";

export class TouchSticks {
  constructor(box, inputs, act) {
    Object.assign(this, { box, inputs, device: "touch", turns: false, lift: 0, held: {}, deflected: { left: [0, 0], right: [0, 0] } });
    this.knobs = [...box.querySelectorAll(".stick")];
    for (const stick of this.knobs) this.stick(stick);
    for (const lever of box.querySelectorAll("[data-lever]")) this.lever(lever, act);
  }

  stick(stick) {
    const side = stick.dataset.axes;
    const move = (event) => {
      const area = stick.getBoundingClientRect();
      const x = (event.clientX - area.left) / area.width * 2 - 1, y = (event.clientY - area.top) / area.height * 2 - 1;
      const length = Math.max(1, Math.hypot(x, y));
      this.deflect(side, [x / length, y / length]);
    };
    stick.addEventListener("pointerdown", (event) => { event.preventDefault(); stick.setPointerCapture(this.held[side] = event.pointerId); move(event); });
    stick.addEventListener("pointermove", (event) => { if (this.held[side] === event.pointerId && stick.hasPointerCapture(event.pointerId)) move(event); });
    for (const end of ENDS) stick.addEventListener(end, (event) => { if (this.held[side] === event.pointerId) this.deflect(side, [0, 0]); });
  }

  deflect(side, [x, y]) {
    this.deflected[side] = [x, y];
    const stick = this.knobs.find((each) => each.dataset.axes === side), size = stick.clientWidth / 3;
    stick.querySelector("i").style.transform = x || y ? `translate(${x * size}px, ${y * size}px)` : "";
  }

  lever(lever, act) {
    const name = lever.dataset.lever;
    if (name === "grip") lever.addEventListener("click", () => act("grip"));
    if (name === "turn") lever.addEventListener("click", () => this.turn());
    if (name !== "up" && name !== "down") return;
    lever.addEventListener("pointerdown", (event) => { lever.setPointerCapture(event.pointerId); this.lift = name === "up" ? 1 : -1; });
    for (const end of ENDS) lever.addEventListener(end, () => { this.lift = 0; });
  }

  // The other thing that the sticks can do: turn the hand, or move the next joints.
  turn() {
    if (owns(this.inputs.owned, "ee.")) this.turns = !this.turns;
    else this.inputs.nextBank();
  }

  letGo() {
    this.lift = 0;
    this.held = {}; // a finger that stays there has to go first
    for (const side of ["left", "right"]) this.deflect(side, [0, 0]);
  }

  moves() {
    const values = [...this.deflected.left, ...this.deflected.right].map(shaped);
    const moves = this.inputs.sticks().map(([index, axis, sign]) => [axis, sign * values[index]]);
    return this.lift && this.inputs.owned.has("ee.vz") ? [...moves, ["ee.vz", this.lift]] : moves;
  }

  // Say on each stick what it does now.
  label() {
    const sticks = this.inputs.sticks();
    const said = (from) => sticks.filter(([index]) => index === from || index === from + 1)
      .map(([, axis]) => shortName(axis)).join(" · ");
    this.knobs.forEach((stick, index) => {
      const part = sticks.find(([each]) => each >> 1 === index)?.[1] ?? "";
      const [what] = this.inputs.channelOf(part).split(".");
      const words = `${{ joint: "joints", ee: "hand", pair: "both hands", "": "joints" }[what] ?? what}: ${said(2 * index)}`;
      write(stick.querySelector("span"), words);
    });
    this.box.querySelector("[data-lever=turn]").setAttribute("aria-pressed", String(this.turns));
    for (const name of ["up", "down"]) this.box.querySelector(`[data-lever=${name}]`).hidden = !this.inputs.owned.has("ee.vz");
  }
}
