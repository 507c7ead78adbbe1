// Episodes: start (after a countdown, for who wants it), how far they are, what was recorded.
import { byId, set } from "./dom.js";
import { playButton } from "./playback.js";
import { keep, recall } from "./store.js";

const COUNTS = 3; // before the start [s]

const MANY = 1000; // episodes that there is room for: more are not counted

// disk: free [bytes], and about how many episodes that is; -1 for what nobody knows
function room([bytes, episodes] = [-1, -1]) {
  if (bytes < 0) return "";
  return `disk: ${(bytes / 1e9).toFixed(bytes < 1e10 ? 1 : 0)} GB free${episodes < 0 || episodes > MANY ? "" : `, about ${episodes} episodes`}`;
}

function checkpoint({ undo_takes: ago, undos }) {
  const count = undos === 1 ? "1 undo" : undos ? `${undos} undos` : "";
  return [ago >= 1 ? `Undo goes back ${ago.toFixed(0)} s` : "", count].filter(Boolean).join(", ");
}

export class Episodes {
  constructor(link) {
    this.link = link;
    this.timer = null;
    byId("countdown-wanted").checked = recall("countdown", (value) => typeof value === "boolean", false);
    byId("countdown-wanted").addEventListener("change", (event) => keep("countdown", event.target.checked));
  }

  stage(stage) {
    this.timeLimit = stage.time_limit;
    this.wanted = stage.wanted;
    set("task", stage.task);
    byId("task").title = stage.task;
    set("place", stage.folder ? `in ${stage.folder}` : "");
    byId("place").title = stage.folder ?? "";
    this.list(stage.episodes);
  }

  list(episodes) {
    byId("episodes-empty").hidden = episodes.length > 0;
    byId("episodes").replaceChildren(...episodes.map((episode, index) => {
      const item = document.createElement("li"), mark = document.createElement("b");
      mark.textContent = episode.kept ? (episode.success ? "✓" : "✗") : "–";
      mark.className = episode.kept ? (episode.success ? "good" : "bad") : "dim";
      item.append(mark, ` ${episode.said}, ${episode.seconds.toFixed(1)} s${episode.kept ? "" : ", not saved"}`);
      if (episode.played) item.append(playButton(episode, index + 1));
      return item;
    }));
    byId("episodes").lastElementChild?.scrollIntoView({ block: "nearest" });
  }

  // Begin, or go on; a countdown only before the beginning.
  start(phase) {
    if (phase === "stopped") return this.link.ask("stop", false);
    if (phase !== "ready" || !byId("countdown-wanted").checked) return this.link.ask("start");
    if (!this.timer) this.count(COUNTS);
    return undefined;
  }

  count(left) {
    byId("countdown").hidden = left === 0;
    set("countdown", String(left));
    this.timer = left ? setTimeout(() => this.count(left - 1), 1000) : null;
    if (!left) this.link.ask("start");
  }

  // Whatever else happens: the countdown is off.
  cancel() {
    clearTimeout(this.timer);
    this.timer = null;
    byId("countdown").hidden = true;
  }

  frame(frame) {
    if (frame.phase !== "ready") this.cancel();
    const left = frame.phase === "ready" ? this.timeLimit : Math.max(0, frame.left);
    set("clock", frame.phase === "ready" ? `${this.timeLimit} s` : `${left.toFixed(0)} s left`);
    byId("bar").style.transform = `scaleX(${Math.min(1, 1 - left / this.timeLimit)})`;
    set("saved", `${frame.saved} saved${frame.saved ? `, ${frame.succeeded} succeeded` : ""}`);
    set("progress", this.wanted ? `${frame.saved} of ${this.wanted}` : "");
    byId("progress-bar").hidden = !this.wanted;
    if (this.wanted) Object.assign(byId("progress-bar"), { max: this.wanted, value: frame.saved });
    set("disk", room(frame.disk));
    set("checkpoint", frame.phase === "ready" ? "" : checkpoint(frame));
  }
}
