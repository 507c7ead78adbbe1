// What lies over the picture: the choice of cameras, what the marks mean, the bar of playback, the nearest distance.
import { CAMERAS } from "./cameras.js";

const LEGEND = [ // class of the sample, words
  ["ghost", "you lead the hand"], ["outline", "you lead the base"], ["plan", "the robot's plan"],
  ["near", "nearest to touching"], ["yours", "glows: yours"],
];

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
  const box = make("p", "legend", "", parent);
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

// choose(name): a camera was chosen
export function build(canvas, choose) {
  const style = document.createElement("link");
  Object.assign(style, { rel: "stylesheet", href: "view.css" });
  document.head.append(style);
  const box = make("div", "view-tools"), label = make("output", "nearest-label");
  canvas.after(label, box); // below whatever else lies over the picture
  label.hidden = true;
  const camera = cameraChoice(box, choose);
  legend(box);
  const playback = playbackBar(box);
  return { camera, playback, label };
}
