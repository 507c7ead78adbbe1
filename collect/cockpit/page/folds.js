// What can be put away: panels on a small screen, sticks where there is a mouse.
import { keep, recall } from "./store.js";

const byId = (id) => document.getElementById(id);

function shows(button, isShown) {
  button.setAttribute("aria-expanded", String(isShown));
}

export function foldPanels() {
  const panels = [...document.querySelectorAll("[data-opens]")];
  for (const button of panels) {
    button.addEventListener("click", () => {
      const isOpen = byId(button.dataset.opens).classList.toggle("open");
      for (const other of panels) if (other !== button) { byId(other.dataset.opens).classList.remove("open"); shows(other, false); }
      shows(button, isOpen);
    });
  }
  const sticks = byId("sticks-open");
  const show = (isShown) => { byId("sticks").hidden = !isShown; shows(sticks, isShown); };
  show(recall("sticks", (value) => typeof value === "boolean", matchMedia("(pointer: coarse)").matches));
  sticks.addEventListener("click", () => {
    show(byId("sticks").hidden);
    keep("sticks", !byId("sticks").hidden);
  });
}
