// The elements of the page: found by their ids, changed only where they say something else.
export const ENDS = ["pointerup", "pointercancel", "lostpointercapture"]; // of a press: events of who was pressed

export const byId = (id) => document.getElementById(id);

export function write(element, words) {
  if (element.textContent !== words) element.textContent = words;
}

export const set = (id, words) => write(byId(id), words);

// Shows a value, unless the person has the control just now.
export function follow(id, value) {
  if (document.activeElement !== byId(id)) byId(id).value = value;
}

export function button(words, act) {
  const made = Object.assign(document.createElement("button"), { type: "button", textContent: words });
  made.addEventListener("click", act);
  return made;
}

export function addStyle(file) {
  document.head.append(Object.assign(document.createElement("link"), { rel: "stylesheet", href: file }));
}
