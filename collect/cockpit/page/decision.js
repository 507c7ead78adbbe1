// Asks before an episode is saved otherwise than the task's judge says, or lost with the end of the recording.
// The robot stands still meanwhile, and STOP works as ever.
import { byId } from "./dom.js";

const SAVES = ["success", "failure"];

export class Decision {
  // ask(what): of the robot's side; way(): how far the hand has to go still, in words
  constructor(ask, way) {
    Object.assign(this, { ask, way, box: byId("decision"), buttons: {}, now: null, ends: false });
    for (const button of this.box.querySelectorAll("[data-answer]")) {
      this.buttons[button.dataset.answer] = button;
      button.addEventListener("click", () => this.answer(button.dataset.answer));
    }
  }

  // A study does not let everybody say what is done.
  stage({ refuses }) {
    this.saves = !refuses.includes("success");
  }

  frame(frame) {
    this.now = frame;
    if (frame.phase === "ready" && this.close() && this.ends) this.ask("quit"); // it was judged and saved meanwhile
  }

  get isOpen() {
    return !this.box.hidden;
  }

  get isOngoing() {
    return Boolean(this.now) && this.now.phase !== "ready";
  }

  get judgement() {
    const way = this.way();
    return this.now.judge === false ? `The task's judge says: not done${way ? ` (${way})` : ""}.` : "";
  }

  // The person says that the task is done.
  success() {
    if (this.isOpen) this.answer("success");
    else if (this.isOngoing && !this.now.practice && this.saves && this.judgement) this.open("Save it as done all the same?", false);
    else this.ask("success");
  }

  failure() {
    if (this.isOpen) this.answer("failure");
    else this.ask("failure");
  }

  // The person ends the recording.
  quit() {
    if (!this.isOngoing) this.ask("quit");
    else this.open(this.now.practice || !this.saves ? "End in the middle of it?" : "An episode is open. Save it before the recording ends?", true);
  }

  open(question, ends) {
    this.ask("pause");
    this.ends = ends;
    byId("decision-question").textContent = question;
    byId("decision-judge").textContent = this.judgement;
    for (const name of SAVES) this.buttons[name].hidden = this.now.practice || !this.saves;
    this.buttons.quit.hidden = !ends;
    this.box.hidden = false;
    this.buttons.go.focus();
  }

  answer(name) {
    if (this.buttons[name].hidden) return;
    this.close();
    if (name === "go") this.ask("start");
    else this.ask(name);
    if (this.ends && SAVES.includes(name)) this.ask("quit"); // once it is saved
  }

  close() {
    const wasOpen = this.isOpen;
    this.box.hidden = true;
    return wasOpen;
  }
}
