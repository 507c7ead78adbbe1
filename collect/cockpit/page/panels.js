// Words and buttons: what the page says besides the picture. Everything comes from the newest frame.
import { button, byId, follow, set } from "./dom.js";
import { jointName } from "./keymap.js";
import { stateOf } from "./states.js";
import { centimetres } from "./way.js";

const STARTS = { ready: "Start", paused: "Go on", stopped: "Release" };
const NEEDS = {
  begun: ["pause", "undo", "success", "failure"], driver: ["restart", "discard", "quit"],
  choices: ["mode", "frame", "speed", "one-joint"],
};

const SILENT = 2000; // without a frame [ms]

export class Panels {
  constructor(link) {
    this.link = link;
    this.seen = Infinity; // when the newest frame came [ms]
    setInterval(() => this.state(), SILENT / 4);
    this.you = { driving: false, free: true, pages: 1 };
    this.isConnected = true;
    this.over = this.newest = null;
    const chosen = (id, value) => byId(id).addEventListener("change", (event) => { link.ask(id, value(event.target)); event.target.blur(); });
    chosen("mode", (select) => select.value);
    chosen("frame", (select) => select.value);
    chosen("practice", (box) => box.checked);
    byId("speed").addEventListener("input", (event) => link.ask("speed", Number(event.target.value)));
    for (const each of document.querySelectorAll("[data-focus]")) each.addEventListener("click", () => link.ask("focus", each.dataset.focus));
    this.state();
  }

  stage(stage) {
    this.stageNow = stage;
    this.modes = Object.fromEntries(stage.modes.map((mode) => [mode.name, mode]));
    const own = new Option("a mask of your own", "");
    own.hidden = true;
    byId("mode").replaceChildren(...stage.modes.map((mode) => new Option(mode.name, mode.name)), own);
    this.hands = stage.hands.map(({ name }, index) => {
      const made = button(name, () => this.link.ask("hand", name));
      made.className = `hand-${index}`;
      return made;
    });
    byId("hand").hidden = stage.hands.length < 2 || stage.refuses.includes("hand");
    byId("hands").replaceChildren(...this.hands);
    this.locks(stage);
    this.pictures(stage.cameras);
  }

  locks(stage) {
    byId("locks").parentElement.hidden = stage.refuses.includes("lock");
    byId("locks").replaceChildren(...stage.joints.map((name, index) => {
      const label = document.createElement("label"), box = document.createElement("input");
      box.type = "checkbox";
      box.dataset.joint = index;
      box.addEventListener("change", () => {
        const chosen = [...byId("locks").querySelectorAll("input:checked")].map((each) => Number(each.dataset.joint));
        this.link.ask("lock", chosen);
      });
      label.append(box, ` ${jointName(name)}`);
      return label;
    }));
  }

  pictures(cameras) {
    this.images = cameras.map((name) => {
      const figure = document.createElement("figure"), image = document.createElement("img"), caption = document.createElement("figcaption");
      image.alt = `camera: ${name}`;
      image.hidden = true;
      caption.textContent = name;
      figure.append(image, caption);
      return figure;
    });
    byId("pictures").replaceChildren(...this.images);
  }

  picture(index, blob) {
    const image = this.images?.[index]?.querySelector("img");
    if (!image) return;
    URL.revokeObjectURL(image.src);
    image.src = URL.createObjectURL(blob);
    image.hidden = false;
  }

  connected(isConnected) {
    this.isConnected = isConnected;
    this.over = null;
    this.state();
  }

  ended(said) {
    this.over = said;
    this.state();
  }

  told(you) {
    this.you = you;
    const drives = byId("drives");
    drives.hidden = you.driving && !you.asked;
    drives.replaceChildren();
    if (you.asked) {
      drives.append("Someone asks to drive. ", button("Let them", () => this.link.ask("give")));
    } else if (!you.driving) {
      const asks = button(you.asking ? "Asked; waiting" : you.free ? "Drive" : "Ask to drive", () => this.link.ask("take"));
      asks.disabled = you.asking;
      drives.append(you.free ? "You watch. Nobody drives. " : "You watch: someone else drives. You too can press STOP. ", asks);
    }
    set("watchers", you.pages > 1 ? `${you.pages} pages open` : "");
    this.state();
  }

  // Say in which state the page is; what the driver may do depends on it.
  state() {
    const { isConnected, over, newest: frame, you } = this;
    const isSilent = performance.now() - this.seen > SILENT && byId("study")?.hidden !== false; // while a card is open there are no frames
    const { name, chip, banner } = stateOf({ isConnected, over, frame, isDriver: you.driving, isLate: you.late, isSilent });
    document.body.dataset.phase = name;
    document.body.classList.toggle("spectator", !you.driving);
    set("phase", chip);
    set("banner", banner);
    byId("banner").hidden = !banner;
    const isDriver = you.driving && isConnected && !over && Boolean(frame);
    byId("start").disabled = !isDriver || !(frame.phase in STARTS);
    byId("practice").disabled = !isDriver || frame.phase !== "ready";
    for (const id of NEEDS.begun) byId(id).disabled = !isDriver || frame.phase === "ready";
    for (const id of [...NEEDS.driver, ...NEEDS.choices]) byId(id).disabled = !isDriver;
    for (const each of document.querySelectorAll("#owned button, #channels button, #locks input, #hands button, [data-focus]")) each.disabled = !isDriver;
    byId("stop").disabled = Boolean(over); // without a connection, too: it is said when there is one
  }

  frame(frame) {
    this.newest = frame;
    this.state();
    set("start-words", STARTS[frame.phase] ?? "Start");
    this.choices(frame);
    this.words(frame);
  }

  choices(frame) {
    const mode = this.modes[frame.mode];
    follow("mode", mode ? frame.mode : "");
    set("mode-help", mode?.help ?? "Your own mask: you steer what is lit, the robot the rest. Choose a mode to go back.");
    byId("focus").hidden = !frame.focus;
    this.hands.forEach((each, index) => each.setAttribute("aria-pressed", String(index === frame.hand)));
    for (const each of document.querySelectorAll("[data-focus]")) each.setAttribute("aria-pressed", String(each.dataset.focus === frame.focus));
    follow("frame", frame.frame);
    follow("speed", frame.speed);
    set("speed-said", `${Math.round(100 * frame.speed)} %`);
    byId("practice").checked = frame.practice;
    for (const box of byId("locks").querySelectorAll("input")) box.checked = frame.locked.includes(Number(box.dataset.joint));
    set("locked", frame.locked.length ? `${frame.locked.length} held` : "");
  }

  words(frame) {
    const { nearest } = frame;
    const near = nearest ? `nearest pair: ${nearest.names.join(" – ")}, ${centimetres(nearest.distance)} cm apart` : "";
    set("said", [frame.phase === "driving" ? frame.reason : "", near].filter(Boolean).join(" · "));
    byId("said").classList.toggle("brakes", frame.phase === "driving" && Boolean(frame.reason));
    if (this.stageNow) set("numbers", this.numbers(frame).join("\n"));
  }

  // How far the hand has to go still, in words.
  way(words) {
    set("way", words);
    byId("way").hidden = !words;
  }

  // Where everything is [m], a line each; what the connection does.
  numbers(frame) {
    const said = (numbers) => numbers.map((x) => x.toFixed(3)).join(" ");
    const things = this.stageNow.shapes.bodies.map((name, index) => [name, frame.poses.slice(7 * index, 7 * index + 3)])
      .filter(([name], index) => index > 0 && !name.endsWith("_body") && !name.endsWith("gripper"))
      .map(([name, at]) => `${name} ${said(at)}`);
    const input = `input ${Math.round(1000 * frame.age)} ms old, there and back ${Math.round(1000 * frame.round_trip)} ms`;
    const counts = Object.entries(frame.dropped ?? {}).map(([why, count]) => `dropped: ${count} ${why}`);
    const hands = this.stageNow.hands.flatMap(({ name }, index) => [
      `${name || "hand"} ${said(frame.tools[index].slice(0, 3))}`, `${name} gripper ${Math.round(100 * frame.openings[index])} % open`.trim(),
    ]);
    return [...hands, ...things, input, ...counts];
  }
}
