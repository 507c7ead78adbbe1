// What lies over the picture: the choice of cameras, what the marks mean, the bar of playback, the nearest distance.
import { CAMERAS } from "./cameras.js";
import { addStyle, byId } from "./dom.js";
import { keep, recall } from "./store.js";

const LEGEND = [ // class of the sample, words
  ["ghost", "you lead the hand"], ["outline", "you lead the base"], ["plan", "the robot's plan"],
  ["near", "nearest pair"], ["drop", "straight below"], ["within", "near enough"], ["yours", "glows: yours"],
  ["its", "glows: the policy's"], ["lead", "the policy's plan"],
];

const OVER = ["hint", "decision"]; // what else may lie over it

function make(tag, id, words = "", parent = null) {
  const element = document.createElement(tag);
  if (id) element.id = id;
  element.textContent = words;
  parent?.append(element);
  return element;
}

function cameraChoice(parent, choose) {
  const label = make("label", "camera-box", "Look ", parent), select = make("select", "camera", "", label);
  make("kbd", "", "V", label).dataset.key = "camera";
  select.replaceChildren(...Object.entries(CAMERAS).map(([name, words]) => new Option(words, name)));
  select.addEventListener("change", () => { choose(select.value); select.blur(); });
  return select;
}

function legend(parent) {
  const box = make("details", "legend", "", parent);
  box.open = recall("legend", (value) => typeof value === "boolean", true);
  box.addEventListener("toggle", () => keep("legend", box.open));
  make("summary", "", "Marks", box);
  for (const [kind, words] of LEGEND) {
    const entry = make("span", "", "", box), sample = make("i", "", "", entry);
    sample.className = `mark ${kind}`;
    entry.append(words);
  }
}

function playbackBar(parent) {
  const section = make("section", "playback", "", parent);
  section.hidden = true;
  section.setAttribute("aria-label", "Playback");
  const title = make("b", "playback-title", "", section), play = make("button", "playback-play", "Pause", section);
  const bar = make("input", "playback-bar", "", section);
  Object.assign(bar, { type: "range", min: 0, step: 1 });
  bar.setAttribute("aria-label", "Moment of the episode");
  const time = make("output", "playback-time", "", section), close = make("button", "playback-close", "Back to live", section);
  return { section, title, play, bar, time, close };
}

// What is left of the picture between the panels, and above and below what lies on it, {x, y, width, height} [px].
export function free(box) {
  const area = box.getBoundingClientRect(), over = [...box.children, ...OVER.map(byId)];
  const edges = over.map((each) => each.getBoundingClientRect()).filter(({ height, right }) => height && right > area.left);
  const middle = area.top + area.height / 2;
  const top = Math.max(area.top, ...edges.filter((each) => each.bottom < middle).map((each) => each.bottom));
  const bottom = Math.min(area.bottom, ...edges.filter((each) => each.top > middle).map((each) => each.top));
  return { x: area.left, y: top, width: Math.max(1, area.width), height: Math.max(1, bottom - top) };
}

// choose(name): a camera was chosen
export function build(canvas, choose) {
  addStyle("view.css");
  const box = make("div", "view-tools"), label = make("output", "nearest-label");
  canvas.after(label, box); // below whatever else lies over the picture
  label.hidden = true;
  const camera = cameraChoice(box, choose);
  legend(box);
  const playback = playbackBar(box);
  return { camera, playback, label, free: () => free(box), over: [box, ...box.children, ...OVER.map(byId)] };
}
