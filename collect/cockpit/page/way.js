// How far the hand is from where it is to be brought, and how much turned: in words, along what its keys move it along.
import { AXES } from "./keymap.js";
import { inverse, times, turnTo } from "./turn.js";

const MOVES = ["ee.vx", "ee.vy", "ee.vz"], TURNS = ["ee.wx", "ee.wy", "ee.wz"];
const DEGREES = 180 / Math.PI;

const about = (angle) => [Math.cos(angle / 2), 0, 0, Math.sin(angle / 2)]; // the vertical
const turned = (q, v) => times(times(q, [0, ...v]), inverse(q)).slice(1);

// How the axes stand in the world that the hand's keys mean: q takes them there.
function axesOf({ frame, q, tools, hand }, azimuth, base) {
  if (frame === "view") return about(azimuth);
  if (frame === "base") return about(base ? q[2] : 0);
  return frame === "tool" ? tools[hand].slice(3) : [1, 0, 0, 0];
}

export function centimetres(metres) {
  const size = Math.max(0, 100 * metres);
  return size < 9.95 ? size.toFixed(1) : size.toFixed(0);
}

// "forward 12, left 8.0": what is left on each axis; what would be said as nothing is not.
function parts(names, values, said) {
  return names.map((name, index) => [AXES[name][values[index] > 0 ? 1 : 0].replace("hand ", "").replace(/^(\w+)s /, "$1 "), said(Math.abs(values[index]))])
    .filter(([, number]) => Number(number) > 0).map((each) => each.join(" ")).join(", ");
}

function said(whole, left, isEnough) {
  return `${whole}${isEnough ? " ✓" : ""}${left ? `: ${left}` : ""}`;
}

// base: how many joints of the robot are its base's; azimuth: from where the person looks [rad]
export function wayOf(frame, azimuth, { base, hands }) {
  const { aim } = frame;
  if (!aim) return "";
  const tool = frame.tools[aim.hand], whose = hands.length > 1 ? ` of the ${hands[aim.hand].name} hand` : "";
  const axes = inverse(axesOf(frame, azimuth, base));
  const way = turned(axes, aim.pose.slice(0, 3).map((x, index) => x - tool[index])), distance = Math.hypot(...way);
  const words = `${aim.name}${whose}: ${said(`${centimetres(distance)} cm away`, parts(MOVES, way, centimetres), distance <= aim.distance)}`;
  if (aim.pose.length < 4) return words;
  const turn = turned(axes, turnTo(tool.slice(3), aim.pose.slice(3))), angle = Math.hypot(...turn);
  const degrees = (x) => (DEGREES * x).toFixed(0);
  return `${words} · ${said(`turned ${degrees(angle)}°`, parts(TURNS, turn, degrees), angle <= aim.angle)}`;
}
