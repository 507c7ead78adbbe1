// What can be put away: panels, which are away at first on a small screen, and sticks, where there is a mouse.
import { byId } from "./dom.js";
import { keep, recall } from "./store.js";

const SMALL = matchMedia("(max-height: 480px), (max-width: 760px)"); // as in style.css
const isFlag = (value) => typeof value === "boolean";

function show(button, isShown) {
  byId(button.dataset.opens).hidden = !isShown;
  button.setAttribute("aria-expanded", String(isShown));
}

export function foldPanels() {
  const panels = [...document.querySelectorAll(".fold")], sticks = byId("sticks-open");
  const begin = () => { for (const each of panels) show(each, !SMALL.matches && recall(each.dataset.opens, isFlag, true)); };
  for (const button of panels) {
    button.addEventListener("click", () => {
      const isShown = byId(button.dataset.opens).hidden;
      if (SMALL.matches) for (const other of panels) show(other, false); // one at a time
      else keep(button.dataset.opens, isShown);
      show(button, isShown);
    });
  }
  SMALL.addEventListener("change", begin);
  begin();
  show(sticks, recall("sticks", isFlag, matchMedia("(pointer: coarse)").matches));
  sticks.addEventListener("click", () => {
    show(sticks, byId("sticks").hidden);
    keep("sticks", !byId("sticks").hidden);
  });
}
