// Cards of a user study: what a participant reads and answers, above everything else; a strip while they drive.
// An answer is sent until the card comes back with it: then it is on the disk.
import { addStyle, button, byId } from "./dom.js";
import { drawItem } from "./form.js";
import { axisName, keyName } from "./keymap.js";

const AGAIN = 1000; // after which an answer that is not yet kept is sent again [ms]
const NEXT = ":next", PAUSE = ":pause";
const CONTROLS = [
  ...["mode", "practice", "undo", "discard", "restart", "success"].map((ask) => [ask, ask]),
  ["mask", "one-joint"], ["mask", "channels"], ["lock", "locks"],
];

function make(tag, id, text = "") {
  const element = document.createElement(tag);
  element.id = id;
  element.textContent = text;
  return element;
}

export class Study {
  // keys(owned): the keys where these channels are owned, [[code, channel or words, sign], …]
  constructor(link, keys) {
    this.link = link;
    this.keys = keys;
    this.card = null;
    this.pending = new Map();
    this.items = new Map();
    this.isDriving = false;
    this.build();
    for (const kind of ["keydown", "keyup"]) addEventListener(kind, (event) => { if (!this.box.hidden) event.stopPropagation(); }, true);
    setInterval(() => this.send(), AGAIN);
  }

  build() {
    addStyle("study.css");
    this.box = make("section", "study");
    this.box.hidden = true;
    this.box.setAttribute("role", "dialog");
    this.box.setAttribute("aria-labelledby", "study-title");
    this.page = make("form", "study-page");
    this.page.addEventListener("submit", (event) => event.preventDefault());
    this.box.append(this.page);
    this.strip = make("p", "strip");
    this.strip.setAttribute("role", "status");
    this.strip.hidden = true;
    document.body.append(this.box, this.strip);
  }

  // What the study does not let a participant do is not there.
  stage(stage) {
    byId("owned").inert = stage.refuses.includes("mask"); // it still says which parts the participant steers
    for (const [ask, id] of CONTROLS) {
      const control = byId(id);
      const whole = control?.closest("label, details:not(#more)") ?? control;
      if (whole && stage.refuses.includes(ask)) whole.style.display = "none";
    }
  }

  told(you) {
    this.isDriving = you.driving;
    this.cover();
  }

  // The last card stays; of a session that failed nothing can be answered any more.
  ended({ trouble }) {
    if (!trouble) return;
    this.card = null;
    this.cover();
  }

  show(card) {
    const isNew = card.id !== this.card?.id;
    this.card = card;
    if (isNew) {
      this.pending.clear();
      this.draw();
      this.box.scrollTop = 0;
    }
    for (const [name, value] of this.pending) if (name in (card.answers ?? {}) && card.answers[name] === value) this.pending.delete(name);
    this.cover();
    this.refresh();
  }

  cover() {
    const isCard = Boolean(this.card?.id);
    const hide = !(isCard && this.isDriving);
    if (!hide && this.box.hidden) document.activeElement?.blur();
    this.box.hidden = hide;
    this.strip.hidden = isCard || !this.card;
    if (this.card && !isCard) this.strip.textContent = [this.card.strip, this.card.note].filter(Boolean).join(" · ");
    if (isCard) byId("phase").textContent = "questions";
  }

  draw() {
    const card = this.card;
    this.box.dataset.card = card.id;
    this.items.clear();
    if (!card.id) return;
    const parts = [make("h1", "study-title", card.title)];
    if (card.note) parts.unshift(make("p", "study-note", card.note));
    for (const text of card.text) parts.push(make("p", "", text));
    if (card.keys.length) parts.push(this.keyTable(card.keys));
    for (const item of card.items) {
      const drawn = drawItem(item, (value) => this.answer(item.name, value));
      this.items.set(item.name, drawn);
      parts.push(drawn.box);
    }
    this.state = make("p", "study-state");
    this.state.setAttribute("role", "status");
    parts.push(this.state);
    if (!card.last) parts.push(this.buttons(card));
    this.page.replaceChildren(...parts);
  }

  buttons(card) {
    const row = make("div", "study-buttons");
    this.next = button(card.items.length ? "Next" : "Go on", () => this.answer(NEXT, true));
    row.append(Object.assign(this.next, { id: "study-next", className: "main" }));
    if (card.pause) row.append(Object.assign(button("Pause: go on another time", () => this.answer(PAUSE, true)), { id: "study-pause" }));
    return row;
  }

  keyTable(owned) {
    const table = make("dl", "study-keys");
    for (const [code, axis, sign] of this.keys(owned)) {
      const name = document.createElement("dt"), key = document.createElement("dd");
      name.textContent = sign ? axisName(axis, sign) : axis;
      key.append(Object.assign(document.createElement("kbd"), { textContent: keyName(code) }));
      table.append(key, name);
    }
    return table;
  }

  answer(item, value) {
    this.pending.delete(item);
    if (value !== undefined) this.pending.set(item, value);
    this.send();
    this.refresh();
  }

  send() {
    if (!this.card?.id || !this.isDriving) return;
    for (const [item, value] of this.pending) this.link.say({ kind: "answer", card: this.card.id, item, value });
    this.refresh();
  }

  refresh() {
    if (!this.card?.id || this.card.last) return;
    const kept = this.card.answers;
    for (const [name, item] of this.items) item.set(this.pending.has(name) ? this.pending.get(name) : kept[name]);
    const left = [...this.items].filter(([name, item]) => item.isOpen || !(name in kept || this.pending.has(name))).length;
    this.next.disabled = left > 0 || this.pending.size > 0;
    const saying = !this.link.isOpen ? "No connection: your answers are sent when it is back." : this.pending.size ? "Saving …" : "";
    this.state.textContent = this.card.error || saying || (left ? `${left} to answer` : this.items.size ? "All answered and saved." : "");
  }
}
