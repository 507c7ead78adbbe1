// One question of a form, as the card describes it. Nothing is chosen before somebody chooses it.
const DECLINED = "I prefer not to answer";
let groups = 0;

function make(tag, className = "", text = "") {
  const element = document.createElement(tag);
  element.className = className;
  element.textContent = text;
  return element;
}

// A radio button for each value; `set` ticks the one that is kept.
class Choices {
  constructor(item, say, values, row) {
    this.name = `form-${groups += 1}`;
    this.radios = values.map(([value, text]) => this.radio(row, value, text, say));
    if (item.declines) this.radios.push(this.radio(item.box, null, DECLINED, say, "declines"));
  }

  radio(parent, value, text, say, className = "") {
    const label = make("label", className), radio = document.createElement("input");
    radio.type = "radio";
    radio.name = this.name;
    radio.dataset.value = JSON.stringify(value);
    radio.setAttribute("aria-label", text);
    radio.addEventListener("change", () => say(value));
    label.append(radio, make("span", "", text));
    parent.append(label);
    return radio;
  }

  set(value) {
    for (const radio of this.radios) radio.checked = radio.dataset.value === JSON.stringify(value);
  }
}

// A field to type in; a value that does not fit is not sent, and the page says so. It is open until a value fits.
class Field {
  constructor(item, say) {
    this.item = item;
    this.isOpen = false;
    this.input = document.createElement(item.kind === "text" ? "textarea" : "input");
    if (item.kind === "number") Object.assign(this.input, { type: "number", min: item.least, max: item.most, step: "any" });
    this.input.setAttribute("aria-label", item.text);
    this.wrong = make("p", "wrong");
    this.say = say;
    this.input.addEventListener("input", () => this.typed());
    this.input.addEventListener("change", () => { if (this.isOpen) this.typed(0); });
    item.box.append(this.input, this.wrong);
    if (item.declines) this.declined = new Choices({ ...item, declines: true }, (value) => this.decline(value), [], item.box);
  }

  typed(patience = 400) {
    clearTimeout(this.timer);
    this.isOpen = true;
    this.say(undefined);
    this.timer = setTimeout(() => {
      const value = this.value();
      this.isOpen = value === undefined;
      this.wrong.textContent = this.isOpen && this.input.value.trim() ? this.expected() : "";
      if (!this.isOpen) this.say(value);
    }, patience);
  }

  decline(value) {
    clearTimeout(this.timer);
    this.isOpen = false;
    this.input.value = this.wrong.textContent = "";
    this.say(value);
  }

  value() {
    const text = this.input.value.replace(/[^\P{Cc}\n]/gu, " ").trim(); // no tabs and the like
    if (!text) return undefined;
    if (this.item.kind === "text") return text.length <= this.item.longest ? text : undefined;
    const number = Number(text);
    return Number.isFinite(number) && number >= this.item.least && number <= this.item.most ? number : undefined;
  }

  expected() {
    return this.item.kind === "text" ? `At most ${this.item.longest} letters.` : `A number from ${this.item.least} to ${this.item.most}.`;
  }

  set(value) {
    if (value === undefined || this.isOpen) return;
    this.declined?.set(value);
    if (document.activeElement !== this.input) this.input.value = value ?? "";
  }
}

function scale(item, say) {
  const row = make("div", "scale");
  const count = Math.round((item.most - item.least) / item.step) + 1;
  row.style.setProperty("--places", count);
  const values = Array.from({ length: count }, (_, index) => item.least + index * item.step);
  const ends = make("div", "ends");
  ends.append(make("span", "", item.low), make("span", "", item.high));
  item.box.append(row, ends);
  return new Choices(item, say, values.map((value) => [value, String(value)]), row);
}

function choice(item, say) {
  const row = make("div", item.kind);
  item.box.append(row);
  return new Choices(item, say, item.choices, row);
}

const KINDS = { scale, likert: scale, choice, pair: choice, number: (...all) => new Field(...all), text: (...all) => new Field(...all) };

// Returns {box, set(value), isOpen}; say(value) is called with each answer, null for "prefer not to answer", and with
// undefined while one is typed.
export function drawItem(item, say) {
  const box = make("fieldset", `item ${item.kind}-item`);
  box.dataset.item = item.name;
  box.append(make("legend", "", item.text || "Which one?"));
  if (item.help) box.append(make("p", "more", item.help));
  return Object.assign(KINDS[item.kind]({ ...item, box }, say), { box });
}
