// From where the person looks: beside the robot and along with it, from the hand, from above, or from where they like.
import { OrbitControls, THREE } from "/lib/three.js";
import { keep, recall } from "./store.js";

export const CAMERAS = { follow: "along with the robot", free: "from where I put it", hand: "from the hand", above: "from above" };
const BACK = 0.34, UP = 0.2; // of the hand's camera, behind and beside the tool point, at scale 1 [m]

export class Cameras {
  constructor(canvas) {
    this.camera = new THREE.PerspectiveCamera(50, 1, 0.03, 60);
    this.camera.up.set(0, 0, 1);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.enableDamping = true;
    this.controls.dampingFactor = 0.2;
    this.controls.maxPolarAngle = 1.7;
    this.choice = recall("camera", (name) => name in CAMERAS, "follow");
    this.before = null;
    this.scale = 1;
  }

  // scale: of the robot's world; one that is smaller is looked at from nearer.
  stage({ scale }) {
    if (scale !== this.scale) this.before = null;
    this.scale = scale;
  }

  choose(name) {
    if (name !== "free" || this.choice === "hand") this.before = null; // look anew; else stay
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

  // base: its pose as (position, quaternion); tool: the hand's.
  frame(base, tool) {
    if (this.choice === "hand") return this.ride(tool);
    if (!this.before) this.lookAt(base);
    else if (this.choice !== "free") {
      const moved = base.position.clone().setZ(0).sub(this.before);
      this.camera.position.add(moved);
      this.controls.target.add(moved);
    }
    this.before = base.position.clone().setZ(0);
    return undefined;
  }

  lookAt(base) {
    const forward = new THREE.Vector3(1, 0, 0).applyQuaternion(base.quaternion).setZ(0).normalize();
    const side = new THREE.Vector3(-forward.y, forward.x, 0);
    const at = base.position.clone(), s = this.scale;
    this.controls.target.copy(at).addScaledVector(forward, 0.5 * s).setZ(0.6 * s);
    this.camera.position.copy(at);
    if (this.choice === "above") this.camera.position.addScaledVector(forward, 0.35 * s).setZ(4.4 * s);
    else this.camera.position.addScaledVector(forward, -2.2 * s).addScaledVector(side, s).setZ(2.2 * s);
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
