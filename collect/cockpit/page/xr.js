// Phones and controllers that know their pose (WebXR): while one is held, a hand moves as it has moved since the press. Of a robot
// with several hands each controller has one: its grip button is held, its trigger closes and opens the gripper.
// The device says right, up, back; the scene forward, left, up: who begins looks where the scene's x leads.
import { inverse, times, turnTo } from "./turn.js";

const GAIN = 8; // deflection for a metre between the hand and where it shall be
const TURN_GAIN = 2.5; // the same for a radian
const DEAD = 0.02; // of a full deflection: 2.5 mm
const MODES = ["immersive-ar", "immersive-vr"];
const AXES = ["vx", "vy", "vz", "wx", "wy", "wz"];
const SIDES = ["left", "right"];

const inScene = ({ x, y, z }) => [-z, -x, y];
const turnInScene = (q) => [q.w, ...inScene(q)];

// Where a pose is in the scene; nothing where that is not known.
function placed(pose) {
  if (!pose || pose.emulatedPosition) return null;
  const at = inScene(pose.transform.position), turned = turnInScene(pose.transform.orientation);
  return [...at, ...turned].every(Number.isFinite) ? { at, turned } : null;
}

// The first kind of session that the browser has, or none.
async function supported() {
  for (const mode of MODES) if (await navigator.xr?.isSessionSupported(mode).catch(() => false)) return mode;
  return null;
}

export class XrHands {
  // ask(what, value): of the robot; say(words): to the person; draw(session): the scene into it
  constructor(button, inputs, ask, say, draw) {
    Object.assign(this, { button, inputs, ask, say, draw, device: "xr", session: null, leads: new Map(), names: [], hands: [] });
    supported().then((mode) => {
      this.mode = mode;
      button.hidden = !mode;
    });
    button.addEventListener("click", () => this.toggle().catch((error) => this.say(`The device's pose cannot be had: ${error.message}`)));
  }

  async toggle() {
    if (this.session) return this.session.end();
    const session = await navigator.xr.requestSession(this.mode, { optionalFeatures: ["dom-overlay"], domOverlay: { root: document.body } });
    session.addEventListener("end", () => this.ended());
    for (const kind of ["select", "squeeze"]) {
      session.addEventListener(`${kind}start`, ({ inputSource }) => this.press(kind, inputSource));
      session.addEventListener(`${kind}end`, ({ inputSource }) => { if (kind === this.clutch(inputSource)) this.drop(inputSource); });
    }
    session.addEventListener("visibilitychange", () => { if (session.visibilityState !== "visible") this.letGo(); });
    await (session.domOverlayState ? this.overlay(session) : this.draw(session));
    this.space = await session.requestReferenceSpace("local");
    this.space.addEventListener?.("reset", () => this.lost(this.leads.size)); // it was centred anew: every pose jumps
    this.session = session;
    this.button.setAttribute("aria-pressed", "true");
    this.ask("frame", "world"); // the pose is meant in the scene
    session.requestAnimationFrame((_, frame) => this.step(frame));
    return undefined;
  }

  // A phone shows the page itself over what its camera sees.
  async overlay(session) {
    const context = document.createElement("canvas").getContext("webgl", { xrCompatible: true });
    await session.updateRenderState({ baseLayer: new XRWebGLLayer(session, context) });
  }

  ended() {
    this.letGo();
    this.session = null;
    this.button.setAttribute("aria-pressed", "false");
  }

  stage({ hands }) {
    this.names = hands.map(({ name }) => name);
    this.letGo();
  }

  // What is held to lead a hand.
  clutch({ targetRayMode }) {
    return this.names.length > 1 && targetRayMode === "tracked-pointer" ? "squeeze" : "select";
  }

  // Whose hand a source leads, by number: that of its name or side; of a phone the active one.
  handOf({ handedness }) {
    if (this.names.length < 2 || !SIDES.includes(handedness)) return this.active ?? 0;
    return this.names.includes(handedness) ? this.names.indexOf(handedness) : SIDES.indexOf(handedness);
  }

  press(kind, source) {
    const hand = this.handOf(source);
    if (kind !== this.clutch(source)) {
      if (kind === "select") this.inputs.flipGrip(hand);
      return;
    }
    this.drop(source);
    this.leads.set(hand, { source, start: null, now: null }); // of two sources with one hand, the newest
    if (this.names.length > 1 && !this.inputs.owned.has(`${this.names[hand]}.vx`)) this.ask("hand", this.names[hand]);
  }

  drop(source) {
    for (const [hand, lead] of this.leads) if (lead.source === source) this.leads.delete(hand);
  }

  letGo() {
    this.leads.clear();
  }

  lost(isHeld) {
    if (isHeld) this.say("The device has lost its place: let go, and press again.");
    this.letGo();
  }

  // Where the sources are in this frame of the session; where one is not tracked, all have let go.
  step(frame) {
    if (!this.session) return;
    this.session.requestAnimationFrame((_, next) => this.step(next));
    for (const [hand, lead] of this.leads) {
      const space = lead.source.gripSpace;
      lead.now = placed(space ? frame.getPose(space, this.space) : frame.getViewerPose(this.space));
      if (!lead.now || !this.hands[hand]) {
        this.lost(lead.start);
        return;
      }
      lead.start ??= { ...lead.now, hand: this.hands[hand] };
    }
  }

  // Take where the hands are.
  frame(frame) {
    this.hands = frame.tools.map((tool) => ({ at: tool.slice(0, 3), turned: tool.slice(3) }));
    this.active = frame.hand;
    this.isWorld = frame.frame === "world";
  }

  // Deflections towards where the hands shall be, [[axis, value], …]; a pair is led by the one that was pressed first.
  moves() {
    const isPair = this.inputs.parts.ee === "pair", leads = [...this.leads].filter(([, { start }]) => start && this.isWorld);
    return (isPair ? leads.slice(0, 1) : leads).flatMap(([number, lead]) => this.led(lead, this.hands[number], isPair ? "ee" : this.names[number] || "ee"));
  }

  led({ start, now }, hand, part) {
    const way = now.at.map((x, index) => start.hand.at[index] + x - start.at[index] - hand.at[index]);
    const wanted = times(times(now.turned, inverse(start.turned)), start.hand.turned);
    const twist = [...way.map((x) => GAIN * x), ...turnTo(hand.turned, wanted).map((x) => TURN_GAIN * x)];
    return AXES.map((axis, index) => [`${part}.${axis}`, Math.max(-1, Math.min(1, twist[index]))]).filter(([axis, value]) => Math.abs(value) > DEAD && this.inputs.owned.has(axis));
  }
}
