// The elements of the page: found by their ids, changed only where they say something else.
export const ENDS = ["pointerup", "pointercancel", "lostpointercapture"]; // of a press: events of who was pressed

export const byId = (id) => document.getElementById(id);

export function write(element, words) {
  if (element.textContent !== words) element.textContent = words;
}

export const set = (id, words) => write(byId(id), words);

export function addStyle(file) {
  document.head.append(Object.assign(document.createElement("link"), { rel: "stylesheet", href: file }));
}
