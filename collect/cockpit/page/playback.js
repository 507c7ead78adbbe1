// Plays a recorded episode again, in place of the live picture: a bar to go through it, play, pause, close.
import { button } from "./dom.js";
import { makeBodies } from "./scene.js";

const WIDTH = 7; // numbers a body

// Returns a button that plays an episode of the list.
export function playButton(episode, number) {
  const made = button("▶ play", () => {
    made.blur();
    document.dispatchEvent(new CustomEvent("play-episode", { detail: { ...episode, number } }));
  });
  made.className = "play";
  made.setAttribute("aria-label", `play episode ${number} again`);
  return made;
}

// A file: the length of a JSON header, the header, then rows of numbers: the time, and where each body is.
function parse(buffer) {
  const length = new DataView(buffer).getUint32(0, true);
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
  return { ...header, numbers: new Float32Array(buffer, 4 + length), width: 1 + WIDTH * header.shapes.bodies.length };
}

export class Playback {
  // box: its elements: {section, title, play, bar, time, close}
  constructor(view, box) {
    this.view = view;
    this.box = box;
    document.addEventListener("play-episode", (event) => this.open(event.detail));
    box.close.addEventListener("click", () => this.close());
    box.play.addEventListener("click", () => this.toggle());
    box.bar.addEventListener("input", () => { this.runs = false; this.show(Number(box.bar.value)); });
  }

  get isOpen() {
    return Boolean(this.file);
  }

  async open(episode) {
    const wanted = this.wanted = episode.played;
    const answer = await fetch(`/played/${wanted}`);
    if (!answer.ok) return;
    const file = parse(await answer.arrayBuffer());
    const bodies = await makeBodies(file.shapes, file.meshes);
    if (this.wanted !== wanted) return; // another one was asked for, or driving began
    this.file = file;
    this.rows = file.numbers.length / file.width;
    this.view.play(bodies);
    this.box.section.hidden = false;
    this.box.title.textContent = `Episode ${episode.number}: ${episode.said}`;
    this.box.bar.max = this.rows - 1;
    this.start(0);
  }

  start(row) {
    this.runs = true;
    this.began = performance.now() - 1000 * this.time(row);
    this.show(row);
  }

  toggle() {
    if (this.runs) this.runs = false;
    else this.start(this.row >= this.rows - 1 ? 0 : this.row);
    this.say();
  }

  // Returns whether it was open.
  close() {
    const wasOpen = this.isOpen;
    this.wanted = null;
    if (!wasOpen) return false;
    this.file = null;
    this.box.section.hidden = true;
    this.view.play(null);
    return true;
  }

  // The time of a row since the first one [s].
  time(row) {
    return this.file.numbers[row * this.file.width] - this.file.numbers[0];
  }

  show(row) {
    this.row = row;
    this.box.bar.value = row;
    this.view.playRow(this.file.numbers, row * this.file.width + 1);
    this.say();
  }

  say() {
    this.box.play.textContent = this.runs ? "Pause" : "Play";
    this.box.time.textContent = `${this.time(this.row).toFixed(1)} / ${this.time(this.rows - 1).toFixed(1)} s`;
  }

  // Goes on, once a drawn frame.
  step() {
    if (!this.isOpen || !this.runs) return;
    let row = this.row;
    while (row < this.rows - 1 && this.time(row + 1) <= (performance.now() - this.began) / 1000) row += 1;
    this.runs = row < this.rows - 1;
    if (row !== this.row || !this.runs) this.show(row);
  }
}
