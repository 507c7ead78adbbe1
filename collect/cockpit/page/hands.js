// Several hands: what keys and sticks mean by one of them, a tag beside each in the picture, and a click that chooses.
import { THREE } from "./three.min.js";

const NEAR = 60; // of a click to what it means [px]
const STILL = 5; // that a pointer may move in a click [px]
export const COLOURS = [0x00858c, 0x9333c8];

// What parts of axes stand for: `ee` for what is steered, a hand or both as a pair; `one` and `two` for hands that are steered at once;
// `lone` for the only joint that is steered beside a hand, such as a torso's; `digit1` … for the joints of a group that are steered.
export function partsOf(channels, hands, active, group) {
  const digits = Object.fromEntries(group.map((channel, index) => [`digit${index + 1}`, channel]).filter(([, channel]) => channels.includes(channel)));
  if (hands.length < 2) return digits;
  const owns = (part) => channels.some((name) => name.startsWith(`${part}.`)), owned = hands.filter(owns);
  const ee = owned.includes(hands[active]) ? hands[active] : owned[0] ?? (owns("pair") ? "pair" : hands[active]);
  const joints = channels.filter((name) => name.startsWith("joint.")), lone = owned.length && joints.length === 1 ? { lone: joints[0] } : {};
  return { ee, ...(owned.length > 1 ? { one: hands[0], two: hands[1] } : {}), ...lone, ...digits };
}

// The same channels by the names of axes, beside their own.
export function named(channels, parts) {
  const others = Object.entries(parts).flatMap(([axis, part]) => part.includes(".") ? [`${axis}.v`] : channels.filter((name) => name.startsWith(`${part}.`)).map((name) => name.replace(part, axis)));
  return [...channels, ...others];
}

export class Hands {
  // choose(name): a hand was chosen
  constructor(canvas, choose) {
    Object.assign(this, { canvas, choose, hands: [], tags: [] });
    let from = null;
    canvas.addEventListener("pointerdown", (event) => { from = event; });
    canvas.addEventListener("pointerup", (event) => {
      if (from && Math.hypot(event.clientX - from.clientX, event.clientY - from.clientY) < STILL) this.click(event);
    });
  }

  stage({ hands }, bodies) {
    for (const tag of this.tags) tag.remove();
    this.hands = hands.length > 1 ? hands.map(({ name, bodies: own }) => ({ name, bodies: own.map((index) => bodies[index]) })) : [];
    this.tags = this.hands.map(({ name }, index) => {
      const tag = document.createElement("button");
      Object.assign(tag, { className: `hand-tag hand-${index}`, textContent: name, title: `steer the ${name} hand`, hidden: true });
      tag.addEventListener("click", () => this.choose(name));
      this.canvas.after(tag);
      return tag;
    });
  }

  frame({ hand, mask }, channels) {
    this.tags.forEach((tag, index) => {
      const { name } = this.hands[index], isOwned = mask.some((channel) => [name, "pair"].includes(channels[channel].split(".")[0]));
      tag.setAttribute("aria-pressed", String(index === hand));
      tag.classList.toggle("owned", isOwned);
    });
  }

  // Where a thing is on the canvas [px].
  seen({ position }, camera) {
    const at = position.clone().project(camera), { clientWidth, clientHeight } = this.canvas;
    return Math.abs(at.z) < 1 ? new THREE.Vector2((at.x + 1) / 2 * clientWidth, (1 - at.y) / 2 * clientHeight) : null;
  }

  // Puts the tags beside the hands; called when the camera is where it will draw from.
  letter(camera) {
    this.camera = camera;
    this.tags.forEach((tag, index) => {
      const at = this.seen(this.hands[index].bodies.at(-1), camera);
      tag.hidden = !at || !this.isShown;
      if (at) tag.style.transform = `translate(${(at.x + 16).toFixed(0)}px, ${(at.y + 14).toFixed(0)}px)`;
    });
  }

  click({ clientX, clientY }) {
    if (!this.camera) return;
    const box = this.canvas.getBoundingClientRect(), there = new THREE.Vector2(clientX - box.left, clientY - box.top);
    const away = this.hands.map(({ bodies }) => Math.min(...bodies.map((body) => this.seen(body, this.camera)?.distanceTo(there) ?? Infinity)));
    const nearest = Math.min(...away);
    if (nearest < NEAR) this.choose(this.hands[away.indexOf(nearest)].name);
  }
}
