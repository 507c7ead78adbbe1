// From where the person looks: so that hand and aim are in view, from above, from the hand, or from where they like.
import { OrbitControls, THREE } from "./three.min.js";
import { keep, recall } from "./store.js";

export const CAMERAS = { follow: "hand and goal", free: "from where I put it", hand: "from the hand", above: "from above" };
const BACK = 0.34, UP = 0.2; // of the hand's camera, behind and beside the tool point, at scale 1 [m]
const FILLED = 0.94; // of the free area, at most
const NEAREST = 1.7; // that the camera comes by itself, at scale 1 [m]
const EASE = 0.5; // in which it does most of its way [s]
const LOW = 320; // a free area of less height has no room for the base [px]
const ROOM = 0.2, BASE = 0.42; // around hand and aim, and around the base, at scale 1 [m]
const CLOSE = 0.25, FAR = 1; // between these distances of hand and aim the base comes into view, at scale 1 [m]

export class Cameras {
  constructor(canvas) {
    this.camera = new THREE.PerspectiveCamera(50, 1, 0.03, 60);
    this.camera.up.set(0, 0, 1);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.enableDamping = true;
    this.controls.dampingFactor = 0.2;
    this.controls.maxPolarAngle = 1.7;
    this.choice = recall("camera", (name) => name in CAMERAS, "follow");
    this.placed = null; // where it put itself: what differs from that is what the person has changed
    this.scale = 1;
  }

  // scale: of the robot's world; one that is smaller is looked at from nearer.
  stage({ scale }) {
    if (scale !== this.scale) this.placed = null;
    this.scale = scale;
    this.isNew = true; // an episode begins: the camera is there at once
  }

  // width, height: of the canvas; free: what panels leave of it, {x, y, width, height} [px]
  fit(width, height, free) {
    Object.assign(this, { share: [free.width / height, free.height / height], isLow: free.height < LOW });
    this.camera.aspect = width / height;
    this.camera.setViewOffset(width, height, width / 2 - free.x - free.width / 2, height / 2 - free.y - free.height / 2, width, height);
  }

  choose(name) {
    if (name !== "free" || this.choice === "hand") this.placed = null; // look anew; else stay
    this.choice = name;
    keep("camera", name);
    this.controls.enabled = name !== "hand";
    this.camera.up.set(0, 0, 1);
    this.camera.fov = name === "hand" ? 62 : 50;
    this.camera.updateProjectionMatrix();
  }

  get next() {
    const names = Object.keys(CAMERAS);
    return names[(names.indexOf(this.choice) + 1) % names.length];
  }

  // base, tool, tools: of base, active hand and all hands, as (position, quaternion); aim: where a hand is to be brought, if that is known.
  frame(base, tool, tools, aim) {
    if (this.choice === "hand") return this.ride(tool);
    if (this.choice === "free" && this.placed) return undefined;
    if (!this.placed) this.begin(base);
    const spheres = this.spheres(base.position, tool.position, tools.map(({ position }) => position), aim);
    const { position } = this.camera, { target } = this.controls, now = performance.now();
    this.zoom *= position.distanceTo(target) / this.placed.distance;
    this.pan.add(target).sub(this.placed.target);
    const back = position.clone().sub(target).normalize(), wanted = this.fitted(spheres, back);
    const ease = this.isNew ? 1 : 1 - Math.exp((this.eased - now) / 1000 / EASE);
    const distance = this.placed.distance + ease * (wanted.distance * this.zoom - this.placed.distance);
    target.copy(this.placed.target).lerp(wanted.target.add(this.pan), ease);
    position.copy(target).addScaledVector(back, distance);
    this.placed = { target: target.clone(), distance };
    Object.assign(this, { isNew: false, eased: now });
    return undefined;
  }

  // From behind the robot and a little beside it, or from above.
  begin(base) {
    const forward = new THREE.Vector3(1, 0, 0).applyQuaternion(base.quaternion).setZ(0).normalize();
    const side = new THREE.Vector3(-forward.y, forward.x, 0), back = new THREE.Vector3(0, 0, 1);
    if (this.choice === "above") back.addScaledVector(forward, -0.04);
    else back.addScaledVector(forward, -0.9).addScaledVector(side, 0.8);
    this.controls.target.copy(base.position);
    this.camera.position.copy(base.position).addScaledVector(back.normalize(), 1);
    this.placed = { target: this.controls.target.clone(), distance: 1 };
    Object.assign(this, { zoom: 1, pan: new THREE.Vector3(), isNew: true });
  }

  // What is to be in view, {at, room}: hand and aim; the base too, as long as these are apart.
  spheres(base, tool, tools, aim) {
    const share = !aim ? 1 : this.isLow ? 0 : THREE.MathUtils.clamp((tool.distanceTo(aim) / this.scale - CLOSE) / (FAR - CLOSE), 0, 1);
    const body = { at: tool.clone().lerp(base, share), room: (ROOM + share * (BASE - ROOM)) * this.scale };
    return [body, ...[...tools, aim].filter(Boolean).map((at) => ({ at, room: ROOM * this.scale }))];
  }

  // Where to look, and from how far, so that all spheres are in the free area: {target, distance}.
  fitted(spheres, back) {
    const side = new THREE.Vector3().crossVectors(this.camera.up, back).normalize(), up = new THREE.Vector3().crossVectors(back, side);
    const slope = Math.tan(this.camera.fov * Math.PI / 360) * FILLED, [wide, high] = this.share.map((share) => slope * share);
    const seen = spheres.map(({ at, room }) => [at.dot(side), at.dot(up), at.dot(back), room]);
    const middle = (axis) => (Math.min(...seen.map((each) => each[axis] - each[3])) + Math.max(...seen.map((each) => each[axis] + each[3]))) / 2;
    const [x, y, z] = [0, 1, 2].map(middle);
    const distances = seen.map(([a, b, c, room]) => c - z + Math.max((Math.abs(a - x) + room) / wide, (Math.abs(b - y) + room) / high));
    const target = new THREE.Vector3().addScaledVector(side, x).addScaledVector(up, y).addScaledVector(back, z);
    return { target, distance: Math.max(NEAREST * this.scale, ...distances) };
  }

  // Looks along the hand's z axis, from behind it and a little beside it, with the horizon level where it can be.
  ride(tool) {
    const along = new THREE.Vector3(0, 0, 1).applyQuaternion(tool.quaternion);
    const up = new THREE.Vector3(0, 0, 1).addScaledVector(along, -along.z);
    if (up.length() < 0.2) up.set(1, 0, 0).applyQuaternion(tool.quaternion);
    up.normalize();
    this.camera.up.copy(up);
    this.camera.position.copy(tool.position).addScaledVector(along, -BACK * this.scale).addScaledVector(up, UP * this.scale);
    this.camera.lookAt(tool.position);
  }

  // Returns whether the camera has moved.
  update() {
    return this.choice !== "hand" && this.controls.update();
  }

  // Where the person looks, about the vertical: forward on the page is this way in the world [rad].
  get azimuth() {
    const look = this.camera.getWorldDirection(new THREE.Vector3());
    if (Math.hypot(look.x, look.y) < 0.05) look.set(0, 1, 0).applyQuaternion(this.camera.quaternion); // from above: up on the screen
    return Math.atan2(look.y, look.x);
  }
}
