// Any mask: which parts the person owns, by group, joint or single channel; choosing a mode goes back.
import { button, byId, follow, write } from "./dom.js";
import { driverOf } from "./drivers.js";
import { jointName, shortName, wordsOf } from "./keymap.js";

const OF_PAIR = ["pair", "apart"];

function toggle(words, label, act) {
  const made = button(words, act);
  made.setAttribute("aria-label", label);
  return made;
}

export class Masks {
  constructor(link) {
    this.link = link;
    this.mine = new Set();
    this.channels = [];
    byId("one-joint").addEventListener("change", (event) => {
      if (event.target.value) this.link.ask("mask", [Number(event.target.value)]);
      event.target.blur();
    });
  }

  stage(stage) {
    this.channels = stage.channels;
    this.joints = stage.joints.map((name) => stage.channels.indexOf(`joint.${name}`));
    const hands = stage.hands.map(({ name }) => [name || "hand", [name || "ee"]]), pair = hands.length > 1 ? [["pair", OF_PAIR]] : [];
    this.groups = [["base", ["base"]], ...hands, ...pair, ["joints", ["joint"]]].map(([name, parts]) => ({
      name, channels: stage.channels.flatMap((channel, index) => (parts.includes(channel.split(".")[0]) ? [index] : [])),
    })).filter(({ channels }) => channels.length);
    this.parts = this.groups.map(({ name, channels }) => toggle(`○ ${name}: robot`, `you own the ${name}`, () => this.flip(channels)));
    byId("owned-title").textContent = stage.policy ? "You can take" : "You own";
    byId("owned").replaceChildren(...this.parts);
    this.single = stage.channels.map((name, index) => toggle(shortName(name), wordsOf(name)?.join(", ") ?? jointName(name), () => this.flip([index])));
    byId("channels").replaceChildren(...this.groups.map(({ name, channels }) => {
      const group = document.createElement("div"), title = document.createElement("b");
      title.textContent = name;
      group.append(title, ...channels.map((index) => this.single[index]));
      return group;
    }));
    byId("one-joint").replaceChildren(new Option("one joint alone …", ""), ...this.joints.map((channel) => new Option(jointName(stage.channels[channel]), channel)));
  }

  // Own all of these, or none of them where they are all owned.
  flip(channels) {
    const next = new Set(this.mine), isAll = channels.every((each) => next.has(each));
    for (const channel of channels) if (isAll) next.delete(channel); else next.add(channel);
    this.link.ask("mask", [...next].sort((a, b) => a - b));
  }

  // The next joint, alone.
  nextJoint() {
    const alone = this.mine.size === 1 ? this.joints.indexOf([...this.mine][0]) : -1;
    this.link.ask("mask", [this.joints[(alone + 1) % this.joints.length]]);
  }

  frame(frame) {
    const locked = frame.locked.map((joint) => this.joints[joint]); // they are owned by standing still
    this.mine = new Set(frame.mask.filter((channel) => !locked.includes(channel)));
    this.groups.forEach(({ name, channels }, index) => {
      const count = channels.filter((each) => this.mine.has(each)).length;
      const [mark, who, pressed] = count === channels.length ? ["●", "you", "true"] : count ? ["◐", "some", "mixed"] : ["○", "robot", "false"];
      const words = (frame.drivers && frame.phase === "driving" ? driverOf(frame.drivers, channels) : [mark, who]).join(` ${name}: `);
      write(this.parts[index], words);
      this.parts[index].setAttribute("aria-pressed", pressed);
    });
    this.single.forEach((button, index) => button.setAttribute("aria-pressed", String(this.mine.has(index))));
    const alone = this.mine.size === 1 && this.joints.includes([...this.mine][0]) ? String([...this.mine][0]) : "";
    follow("one-joint", alone);
  }
}
