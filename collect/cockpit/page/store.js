// What this browser remembers. It may be old, changed by hand, or not allowed: then it counts as nothing.
const PREFIX = "handrail:";

// Returns what is kept under a name, if `isFine` says so of it; otherwise `instead`.
export function recall(name, isFine, instead) {
  try {
    const value = JSON.parse(localStorage.getItem(PREFIX + name));
    return value !== null && isFine(value) ? value : instead;
  } catch {
    return instead;
  }
}

export function keep(name, value) {
  try {
    localStorage.setItem(PREFIX + name, JSON.stringify(value));
  } catch { /* no room, or not allowed: it is forgotten at the next visit */ }
}

export function forget(name) {
  try {
    localStorage.removeItem(PREFIX + name);
  } catch { /* nothing was kept */ }
}
