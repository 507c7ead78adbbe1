// Puts the page together: inputs up many times a second, the newest picture down.
import { Decision } from "./decision.js";
import { byId, set } from "./dom.js";
import { driverWords } from "./drivers.js";
import { Episodes } from "./episodes.js";
import { Gamepad } from "./gamepad.js";
import { Help } from "./help.js";
import { named, partsOf } from "./hands.js";
import { Inputs } from "./inputs.js";
import { Mapping } from "./mapping.js";
import { BY_JOINTS, digitGroups, inForce, keyName, owns } from "./keymap.js";
import { Link } from "./link.js";
import { Masks } from "./masks.js";
import { Notices } from "./notices.js";
import { Panels } from "./panels.js";
import { Sliders } from "./sliders.js";
import { TouchSticks } from "./sticks.js";
import { Study } from "./study.js";
import { View } from "./view.js";
import { wayOf } from "./way.js";
import { XrHands } from "./xr.js";
import { foldPanels } from "./folds.js";

const PERIOD = 25; // between two messages [ms]
const view = new View(byId("view"), (hand) => ask("hand", hand));
let stage = null, frame = null, told = null, drawn = null, spoken = 0;
let groups = [], group = 0, active = 0; // of the joints that digits mean; and the hand at that time

const ask = (what, value) => { episodes.cancel(); link.ask(what, value); };
const DO = {
  start: () => { decision.close(); return frame?.phase === "driving" ? ask("pause") : episodes.start(frame?.phase); },
  stop: () => ask("stop"), grip: () => inputs.flipGrip(frame?.hand ?? 0), pause: () => ask("pause"), success: () => decision.success(),
  failure: () => decision.failure(), restart: () => { decision.close(); ask("restart"); }, discard: () => { decision.close(); ask("discard"); }, undo: () => ask("undo"),
  quit: () => decision.quit(), help: () => help.toggle(), back: () => help.cancel() || decision.close() || help.close() || view.playback.close(),
  hand: () => otherHand(), grip_left: () => inputs.flipGrip(0), grip_right: () => inputs.flipGrip(1),
  focus: () => otherFocus(), slower: () => faster(-0.2), faster: () => faster(0.2), mode: () => next("mode"), frame: () => next("frame"),
  joint: () => masks.nextJoint(), camera: () => view.nextCamera(),
};
const act = (name) => DO[name]();

const notices = new Notices();
const decision = new Decision(ask, way);
const inputs = new Inputs(act);
const gamepad = new Gamepad(inputs, act, (words) => notices.say(words));
const touch = new TouchSticks(byId("sticks"), inputs, act);
const sliders = new Sliders(byId("sliders"), (channel) => choose(groups.findIndex(({ channels }) => channels.includes(channel))));
const link = new Link({
  connected: (isConnected) => { if (!isConnected) episodes.cancel(); panels.connected(isConnected); },
  you: (you) => { if (!you.driving) decision.close(); panels.told(you); study.told(you); },
  card: (card) => study.show(card),
  error: (said) => notices.say(`The robot's side says: ${said}`),
  over: (said) => { panels.ended(said); study.ended(said); },
  picture: (index, blob) => panels.picture(index, blob),
  stage: async (said) => {
    if (stage && stage.robot !== said.robot) return location.reload(); // nothing of it fits
    stage = said;
    if (inputs.mapping?.name !== new Mapping(stage).name) inputs.mapping = new Mapping(stage); // else it keeps what was changed
    inputs.isShared = Boolean(stage.policy);
    groups = digitGroups(stage);
    if (inputs.grips.length !== stage.hands.length) inputs.grips = stage.hands.map(() => false);
    for (const each of [panels, masks, sliders, episodes, study, decision, xr]) each.stage(stage);
    document.body.classList.toggle("beside", Boolean(stage.policy));
    hint();
    label();
    await view.stage(stage);
  },
  frame: (said) => { frame = said; panels.seen = performance.now(); say(); }, // answered at once: so the server knows how long that takes
});
const panels = new Panels(link);
const masks = new Masks(link);
const episodes = new Episodes(link);
const help = new Help(inputs, gamepad, label);
const study = new Study(link, keysOf);
const xr = new XrHands(byId("xr"), inputs, (what, value) => link.ask(what, value), (words) => notices.say(words), (session) => view.headset.enter(session, show, () => view.fit()));
inputs.sources.push(gamepad, touch, sliders, xr);
foldPanels();

function faster(change) {
  if (frame) link.ask("speed", Math.min(1, Math.max(0.1, Number((frame.speed + change).toFixed(1)))));
}

function otherFocus() {
  if (!frame?.focus) return false;
  link.ask("focus", frame.focus === "hand" ? "base" : "hand");
  return true;
}

// The other hand; where joints are steered, the next ones that digits mean.
function otherHand() {
  if (!frame || !(stage?.hands.length > 1)) return;
  if (owns(inputs.owned, "joint.") && !owns(inputs.owned, "ee.")) choose((group + 1) % groups.length);
  else ask("hand", stage.hands[(frame.hand + 1) % stage.hands.length].name);
}

// Digits mean these joints now; a hand that they move is the active one.
function choose(number) {
  const { hand } = groups[group = number];
  if (hand !== null && hand !== frame.hand) ask("hand", stage.hands[hand].name);
}

// The next one that there is to choose.
function next(id) {
  const values = [...byId(id).options].filter((option) => !option.hidden).map((option) => option.value);
  link.ask(id, values[(values.indexOf(byId(id).value) + 1) % values.length]);
}

function hint() {
  notices.hint(inputs.entriesInForce().map(([code, axis]) => [code, inputs.channelOf(axis)]), inputs.mapping.actions, stage.grips);
}

function way() {
  return wayOf(frame, view.azimuth, stage);
}

// Each button says its key, as it is now.
function label() {
  for (const key of document.querySelectorAll("[data-key]")) key.textContent = keyName(inputs.mapping.actions[key.dataset.key] ?? "");
  sliders.letter(inputs.entriesInForce().map(([code, axis]) => [inputs.channelOf(axis), keyName(code)]));
}

for (const name of ["start", "pause", "undo", "success", "failure", "restart", "discard", "quit"]) byId(name).addEventListener("click", () => act(name));
let stopPressed = -Infinity; // an e-stop does not wait until the finger goes up; the click that follows is the same press [ms]
byId("stop").addEventListener("pointerdown", (event) => { stopPressed = event.timeStamp; act("stop"); });
byId("stop").addEventListener("pointerup", (event) => { stopPressed = event.timeStamp; });
byId("stop").addEventListener("click", (event) => { if (event.timeStamp - stopPressed > 1000) act("stop"); });
for (const id of ["help-open", "help-close"]) byId(id).addEventListener("click", () => act("help"));
document.addEventListener("pointerup", (event) => { // while one finger steers browsers make no click of another one's
  const button = event.isPrimary ? null : event.target.closest("button");
  if (button?.contains(document.elementFromPoint(event.clientX, event.clientY))) button.click();
});
document.addEventListener("click", (event) => { // the mouse leaves no focus behind: the next key is for the robot
  if (event.detail > 0) event.target.closest("button, summary, input[type=checkbox], input[type=range]")?.blur();
});

function bodiesOf(owned) {
  const bodies = stage.shapes.bodies, lit = new Set();
  if (owns(owned, "base")) lit.add("planar_base"); // by its twist or its joints
  for (const { name: hand } of stage.hands) {
    const prefix = hand && `${hand}.`;
    if (!owns(owned, `${hand || "ee"}.`) && !(hand && owns(owned, "pair."))) continue;
    for (const name of bodies) if (name === `${prefix}gripper` || name.startsWith(`${prefix}finger`)) lit.add(name);
  }
  for (const name of owned) if (name.startsWith("joint.")) lit.add(`${name.slice(6)}_body`);
  return lit;
}

// Channels, by the names of axes too; and, where all joints of the base are among them, that its keys and sticks mean these.
function meant(channels, parts) {
  const names = new Set(named(channels, parts));
  const base = stage.joints.slice(0, stage.base).map((name) => `joint.${name}`);
  return base.length && !names.has("base.vx") && base.every((name) => names.has(name)) ? names.add(BY_JOINTS) : names;
}

// The keys where these channels are owned, and of what is done once: [[code, channel or words, sign], …].
function keysOf(channels) {
  if (!inputs.mapping) return [];
  const { actions, offered } = inputs.mapping, grips = stage.grips ? ["grip", "grip_left", "grip_right"] : [];
  const parts = partsOf(channels, stage.hands.map(({ name }) => name), frame?.hand ?? 0, groups[0]?.channels ?? []);
  const held = inForce(inputs.entries, meant(channels, parts)).map(([code, axis, sign]) => [code, inputs.channelOf(axis, parts), sign]);
  const once = ["start", "pause", ...grips, "failure", "quit", "stop"].filter((name) => name in offered);
  return [...held, ...once.map((name) => [actions[name], offered[name].says])];
}

function own() {
  if (frame.hand !== active && groups[group].hand !== frame.hand) group = Math.max(0, groups.findIndex(({ hand }) => hand === frame.hand));
  active = frame.hand;
  const before = Object.values(inputs.parts).join();
  const channels = frame.mask.map((index) => stage.channels[index]);
  inputs.parts = partsOf(channels, stage.hands.map(({ name }) => name), active, groups[group].channels);
  const names = meant(channels, inputs.parts);
  if (before === Object.values(inputs.parts).join() && [...names].join() === [...inputs.owned].join()) return;
  inputs.owned = names;
  inputs.bank = 0;
  touch.turns = false;
  if (!frame.drivers) view.light_up(bodiesOf(inputs.owned));
  help.draw();
  hint();
  label();
}

// Beside a policy what each drives now is lit, and said.
function sayDrivers() {
  byId("drivers").hidden = !frame.drivers;
  if (!frame.drivers) return;
  const said = driverWords(frame, masks.groups, stage, { start: keyName(inputs.mapping.actions.start ?? "") });
  set("drivers", said);
  byId("drivers").classList.toggle("mine", frame.drivers.person.length > 0);
  const [mine, its] = ["person", "policy"].map((who) => bodiesOf(new Set(frame.drivers[who].map((index) => stage.channels[index]))));
  if ([...mine, "", ...its].join() !== [...view.owned, "", ...view.its].join()) view.light_up(mine, its);
}

function show() {
  if (stage && frame && frame !== drawn && view.bodies.length * 7 === frame.poses.length) {
    view.frame(frame);
    drawn = frame;
  }
}

function step() {
  requestAnimationFrame(step);
  show();
  view.render();
}

// Says how it stands, also while a slow machine draws less often.
function tell() {
  told = frame;
  own();
  for (const each of [masks, panels, episodes, decision, xr]) each.frame(frame);
  sayDrivers();
  panels.way(way());
  sliders.frame(frame, inputs.owned);
  touch.label();
}

function say() {
  spoken = performance.now();
  if (!stage || !view.isReady) return;
  if (frame && frame !== told) tell();
  const input = inputs.read(stage.channels);
  set("pad", gamepad.says);
  if (panels.you.driving) link.drive({ ...input, view: view.azimuth });
}

addEventListener("keydown", (event) => { if (!event.repeat) say(); }); // after what inputs make of it
for (const event of ["keyup", "blur"]) addEventListener(event, say);
setInterval(() => { if (performance.now() - spoken > PERIOD / 2) say(); }, PERIOD); // also while a slow machine draws less often than that
requestAnimationFrame(step);
