// What is said for a while: what went wrong, and three sentences for who is here for the first time.
import { byId } from "./dom.js";
import { keyName, shortName } from "./keymap.js";
import { keep, recall } from "./store.js";

const SHOWN = 7000; // [ms]

// "W S forward, A D sideways": both keys of each axis.
function pairs(keys) {
  const axes = [...new Set(keys.map(([, axis]) => axis))];
  return axes.map((axis) => [...keys.filter((each) => each[1] === axis).map(([code]) => keyName(code)), shortName(axis)].join(" ")).join(", ");
}

export class Notices {
  constructor() {
    byId("hint-close").addEventListener("click", () => this.understood());
  }

  say(words) {
    byId("notice").textContent = words;
    byId("notice").hidden = false;
    clearTimeout(this.timer);
    this.timer = setTimeout(() => { byId("notice").hidden = true; }, SHOWN);
  }

  // keys: the mapping in force, [[code, axis, sign], …]; grips: whether the task needs the gripper
  hint(keys, actions, grips) {
    const isTouch = matchMedia("(pointer: coarse)").matches;
    const [start, stop, grip, left, right, hand] = ["start", "stop", "grip", "grip_left", "grip_right", "hand"].map((name) => keyName(actions[name] ?? ""));
    const begin = isTouch ? "Press Start, then put a thumb on a stick to move." : `Press Start (${start}). Hold to move: ${pairs(keys)}.`;
    const gripper = actions.hand ? ` ${left} and ${right} close and open the grippers, ${hand} goes to the other hand.`
      : grips ? ` ${isTouch ? "grip" : grip} closes and opens the gripper.` : "";
    byId("hint-words").textContent = `${begin}${gripper} Let go to stop steering; ${isTouch ? "STOP" : stop} stops the robot at once.`;
    byId("hint").hidden = recall("hint", (value) => value === "seen", "") === "seen";
  }

  understood() {
    keep("hint", "seen");
    byId("hint").hidden = true;
  }
}
