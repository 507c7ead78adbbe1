// The scene in a headset: who enters stands behind the robot, looks where the scene's x leads, and goes along with the base.
import { THREE } from "./three.min.js";

const BACK = 1.2, EYES = 1.5; // of the person, behind the base and above the floor, at scale 1 [m]
const RIGHT = [0, -1, 0], UP = [0, 0, 1], BEHIND = [-1, 0, 0]; // the device's axes in the scene

export class Headset {
  constructor(renderer, scene) {
    Object.assign(this, { renderer, scene, camera: new THREE.PerspectiveCamera(50, 1, 0.03, 60), rig: new THREE.Group() });
    this.rig.quaternion.setFromRotationMatrix(new THREE.Matrix4().makeBasis(...[RIGHT, UP, BEHIND].map((axis) => new THREE.Vector3(...axis))));
    scene.add(this.rig.add(this.camera));
    renderer.xr.setReferenceSpaceType("local"); // it begins at the person's eyes
  }

  get isOn() {
    return this.renderer.xr.isPresenting;
  }

  // Draws into a session until that ends; before(): called before each picture; after(): at the end.
  async enter(session, before, after) {
    const { renderer, scene, camera } = this;
    session.addEventListener("end", () => {
      renderer.setAnimationLoop(null);
      renderer.xr.enabled = false;
      after();
    });
    renderer.xr.enabled = true;
    await renderer.xr.setSession(session);
    renderer.setAnimationLoop(() => {
      before();
      renderer.render(scene, camera);
    });
  }

  follow({ x, y }, scale) {
    this.rig.position.set(x - BACK * scale, y, EYES * scale);
  }
}
