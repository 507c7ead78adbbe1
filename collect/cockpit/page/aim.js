// What the hand is to do, drawn: its axes and those of where it is to be brought, straight lines down from both to the
// floor, and how near is near enough.
import { THREE } from "./three.min.js";
import { COLOURS } from "./hands.js";
import { place } from "./scene.js";

const HAND = 0x00a0a8, AIM = 0xe3b505, WITHIN = 0x2fbf71;
const AXES = [0xd92626, 0x26b333, 0x264de6]; // as the goal's own
const LONG = 0.16, THICK = 0.008, RING = 0.05, ON_FLOOR = 0.007; // at scale 1 [m]

const basic = (color, look = {}) => new THREE.MeshBasicMaterial({ color, transparent: true, ...look });

// Three axes, seen through whatever is before them.
function triad() {
  const made = new THREE.Group();
  AXES.forEach((colour, index) => {
    const axis = new THREE.Mesh(new THREE.CylinderGeometry(THICK, THICK, LONG, 8).translate(0, LONG / 2, 0), basic(colour, { depthTest: false }));
    if (index === 0) axis.rotation.z = -Math.PI / 2;
    if (index === 2) axis.rotation.x = Math.PI / 2;
    axis.renderOrder = 5;
    made.add(axis);
  });
  return made;
}

// A line down to the floor, and a ring where it ends; what stands in between hides the rest of it.
function plumb(colour) {
  const made = new THREE.Group();
  const line = new THREE.Mesh(new THREE.CylinderGeometry(THICK, THICK, 1, 6).rotateX(Math.PI / 2).translate(0, 0, -0.5), basic(colour));
  const ring = new THREE.Mesh(new THREE.RingGeometry(0.6 * RING, RING, 24), basic(colour));
  made.add(line, ring);
  return made;
}

function drop(made, at, scale) {
  const [line, ring] = made.children;
  made.position.copy(at);
  line.scale.set(scale, scale, Math.max(1e-4, at.z));
  ring.scale.setScalar(scale);
  ring.position.z = ON_FLOOR * scale - at.z;
}

export class AimMarks {
  constructor(scene) {
    this.scale = 1;
    this.hand = triad();
    this.aim = triad();
    this.below = [plumb(HAND), plumb(AIM)];
    this.near = new THREE.Mesh(new THREE.SphereGeometry(1, 32, 20), basic(AIM, { opacity: 0.2, depthWrite: false }));
    this.all = [this.hand, this.aim, ...this.below, this.near];
    scene.add(...this.all);
  }

  frame({ tools, hand, aim }) {
    place(this.hand, tools[hand]);
    for (const { material } of tools.length > 1 ? this.below[0].children : []) material.color.set(COLOURS[hand]);
    drop(this.below[0], this.hand.position, this.scale);
    for (const each of [this.hand, this.below[0]]) each.visible = true;
    for (const each of [this.hand, this.aim]) each.scale.setScalar(this.scale);
    for (const each of [this.aim, this.below[1], this.near]) each.visible = Boolean(aim);
    if (!aim) return;
    place(this.aim, aim.pose.length > 3 ? aim.pose : [...aim.pose, 1, 0, 0, 0]);
    this.aim.visible = aim.pose.length > 3;
    drop(this.below[1], this.aim.position, this.scale);
    this.near.visible = aim.distance > 0;
    this.near.position.copy(this.aim.position);
    this.near.scale.setScalar(aim.distance || 1);
    const isWithin = new THREE.Vector3(...tools[aim.hand]).distanceTo(this.aim.position) <= aim.distance;
    this.near.material.color.set(isWithin ? WITHIN : AIM);
  }

  show(isShown) {
    for (const each of this.all) each.visible = isShown;
  }
}
