// What is said for a while: what went wrong, and three sentences for who is here for the first time.
import { keyName } from "./keymap.js";
import { keep, recall } from "./store.js";

const SHOWN = 7000; // [ms]
const byId = (id) => document.getElementById(id);

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

  // keys: the mapping in force, [[code, axis, sign], …]
  hint(keys, actions, isTouch) {
    const first = keys.slice(0, 4).map(([code]) => keyName(code)).join(" ");
    const how = isTouch ? "put a thumb on a stick" : `hold ${first || "a key"}`;
    const [start, stop] = [keyName(actions.start), keyName(actions.stop)];
    byId("hint-words").textContent = `Press Start (${start}), then ${how} to move. Let go, and the robot stands still. ${isTouch ? "STOP" : stop} stops everything at once.`;
    byId("hint").hidden = recall("hint", (value) => value === "seen", "") === "seen";
  }

  understood() {
    keep("hint", "seen");
    byId("hint").hidden = true;
  }
}
