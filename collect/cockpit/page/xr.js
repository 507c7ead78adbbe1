// A phone or headset that knows its pose (WebXR): while it is held, the hand moves as the device has moved since the press.
// The device says right, up, back; the scene forward, left, up: who begins looks where the scene's x leads.
import { inverse, times, turnTo } from "./turn.js";

const GAIN = 8; // deflection for a metre between the hand and where it shall be
const TURN_GAIN = 2.5; // the same for a radian
const DEAD = 0.02; // of a full deflection: 2.5 mm
const MODES = ["immersive-ar", "immersive-vr"];
const AXES = ["ee.vx", "ee.vy", "ee.vz", "ee.wx", "ee.wy", "ee.wz"];

const inScene = ({ x, y, z }) => [-z, -x, y];
const turnInScene = (q) => [q.w, ...inScene(q)];

// The first kind of session that the browser has, or none.
async function supported() {
  for (const mode of MODES) if (await navigator.xr?.isSessionSupported(mode).catch(() => false)) return mode;
  return null;
}

export class XrHand {
  // ask(what, value): of the robot; say(words): to the person
  constructor(button, inputs, ask, say) {
    Object.assign(this, { button, inputs, ask, say, device: "xr", session: null, source: null, start: null, now: null, hand: null });
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
    session.addEventListener("selectstart", (event) => { this.letGo(); this.source = event.inputSource; });
    session.addEventListener("selectend", (event) => { if (event.inputSource === this.source) this.letGo(); });
    session.addEventListener("visibilitychange", () => { if (session.visibilityState !== "visible") this.letGo(); });
    const context = document.createElement("canvas").getContext("webgl", { xrCompatible: true });
    await session.updateRenderState({ baseLayer: new XRWebGLLayer(session, context) });
    this.space = await session.requestReferenceSpace("local");
    this.session = session;
    this.button.setAttribute("aria-pressed", "true");
    this.ask("frame", "world"); // the pose is meant in the scene
    session.requestAnimationFrame((_, frame) => this.step(frame));
    return undefined;
  }

  ended() {
    this.letGo();
    this.session = null;
    this.button.setAttribute("aria-pressed", "false");
  }

  letGo() {
    this.source = this.start = this.now = null;
  }

  // Where the device is in this frame of the session; what is not tracked has let go.
  step(frame) {
    if (!this.session) return;
    this.session.requestAnimationFrame((_, next) => this.step(next));
    if (!this.source) return;
    const space = this.source.gripSpace;
    const pose = space ? frame.getPose(space, this.space) : frame.getViewerPose(this.space);
    if (!pose || pose.emulatedPosition || !this.hand) {
      if (this.start) this.say("The device has lost its place: let go, and press again.");
      this.letGo();
      return;
    }
    this.now = { at: inScene(pose.transform.position), turned: turnInScene(pose.transform.orientation) };
    this.start ??= { ...this.now, hand: this.hand };
  }

  // Take where the hand is.
  frame(frame) {
    this.hand = { at: frame.tool.slice(0, 3), turned: frame.tool.slice(3) };
    this.isWorld = frame.frame === "world";
  }

  // Deflections towards where the hand shall be, [[axis, value], …].
  moves() {
    if (!this.start || !this.isWorld) return [];
    const { start, now, hand } = this;
    const way = now.at.map((x, index) => start.hand.at[index] + x - start.at[index] - hand.at[index]);
    const wanted = times(times(now.turned, inverse(start.turned)), start.hand.turned);
    const twist = [...way.map((x) => GAIN * x), ...turnTo(hand.turned, wanted).map((x) => TURN_GAIN * x)];
    return AXES.map((axis, index) => [axis, Math.max(-1, Math.min(1, twist[index]))]).filter(([axis, value]) => Math.abs(value) > DEAD && this.inputs.owned.has(axis));
  }
}
