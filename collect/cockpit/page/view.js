// The picture: the robot and things as they look, what is asked, what the plan makes of it; live, or played again.
import { THREE } from "./three.min.js";
import { AimMarks } from "./aim.js";
import { Cameras } from "./cameras.js";
import { Hands } from "./hands.js";
import { Headset } from "./headset.js";
import { Marks, POLICY } from "./marks.js";
import { Playback } from "./playback.js";
import { Ground, forgetBodies, makeBodies, place } from "./scene.js";
import { build } from "./tools.js";

const OWNED = 0xffb000;
const SLOW = 45, QUICK = 14; // to draw a frame [ms]

// Whether the processor has to draw: then it does so coarsely from the start, and has time for the robot.
function drawsInSoftware() {
  const gl = document.createElement("canvas").getContext("webgl2"), names = gl?.getExtension("WEBGL_debug_renderer_info");
  const name = names ? gl.getParameter(names.UNMASKED_RENDERER_WEBGL) : "";
  gl?.getExtension("WEBGL_lose_context")?.loseContext();
  return /swiftshader|llvmpipe|software/i.test(name);
}

export class View {
  // choose(name): the person has chosen a hand
  constructor(canvas, choose) {
    this.canvas = canvas;
    this.hands = new Hands(canvas, choose);
    const isSoftware = drawsInSoftware();
    this.tools = build(canvas, (camera) => this.choose(camera));
    this.renderer = new THREE.WebGLRenderer({ canvas, antialias: !isSoftware, powerPreference: "high-performance" });
    this.renderer.shadowMap.enabled = !isSoftware;
    this.renderer.shadowMap.type = THREE.PCFShadowMap;
    this.ratio = isSoftware ? 0.75 : Math.min(devicePixelRatio, 2);
    this.scene = new THREE.Scene();
    this.cameras = new Cameras(canvas);
    this.headset = new Headset(this.renderer, this.scene);
    this.ground = new Ground(this.scene, () => { this.stale = true; });
    this.marks = new Marks(this.scene, this.tools.label);
    this.aimMarks = new AimMarks(this.scene);
    this.playback = new Playback(this, this.tools.playback);
    this.choose(this.cameras.choice);
    this.bodies = [];
    this.owned = this.its = new Set();
    this.isReady = false; // nobody drives who does not see
    const watch = new ResizeObserver(() => this.fit());
    for (const each of [canvas, ...this.tools.over]) watch.observe(each);
    this.fit();
  }

  async stage(stage) {
    const bodies = await makeBodies(stage.shapes, stage.meshes);
    forgetBodies(this.scene, this.bodies);
    this.bodies = bodies;
    this.channels = stage.channels;
    this.marks.stage(stage, bodies);
    this.hands.stage(stage, bodies);
    this.aimMarks.scale = stage.scale;
    this.cameras.stage(stage);
    this.light_up(this.owned, this.its);
    if (this.played) return;
    this.scene.add(...bodies);
    this.rehearse();
    this.isReady = true;
  }

  // Draws everything once and waits for it: how to draw is compiled at the first use, and who drives has no time for that.
  rehearse() {
    this.marks.rehearse();
    this.aimMarks.show(true);
    this.renderer.render(this.scene, this.cameras.camera);
    const gl = this.renderer.getContext();
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4)); // waits
    this.hideMarks();
  }

  hideMarks() {
    this.marks.hide();
    this.hands.isShown = false;
    this.aimMarks.show(false);
    this.stale = true;
  }

  // Lights the bodies that the operator owns, and those that a policy drives.
  light_up(owned, its = new Set()) {
    Object.assign(this, { owned, its });
    for (const body of this.bodies) {
      for (const { material } of body.children) {
        material.emissive.set(owned.has(body.name) ? OWNED : its.has(body.name) ? POLICY : 0);
        material.emissiveIntensity = 0.22;
      }
    }
    this.stale = true;
  }

  frame(frame) {
    if (frame.phase === "driving") this.playback.close(); // who drives sees what is, not what was
    if (this.played) return;
    this.pose(this.bodies, frame.poses, 0);
    this.marks.frame(frame);
    this.aimMarks.frame(frame);
    this.hands.isShown = true;
    this.hands.frame(frame, this.channels);
    const tools = frame.tools.map((pose) => place(new THREE.Group(), pose));
    this.look(this.bodies, tools[frame.hand], tools, frame.aim && new THREE.Vector3(...frame.aim.pose));
  }

  pose(bodies, numbers, start) {
    bodies.forEach((body, index) => place(body, numbers, start + 7 * index));
    this.stale = true;
  }

  // tool: of the active hand; tools: all of them
  look(bodies, tool, tools, aim) {
    this.cameras.frame(bodies[1], tool, tools, aim);
    this.ground.follow(bodies[1].position.clone().setZ(0));
    this.headset.follow(bodies[1].position, this.aimMarks.scale);
  }

  // Shows an episode that was, instead of what is; without one, what is again.
  play(bodies) {
    if (this.played) forgetBodies(this.scene, this.played);
    this.scene.remove(...this.bodies);
    this.scene.add(...(bodies ?? this.bodies));
    this.played = bodies;
    this.hideMarks();
  }

  playRow(numbers, start) {
    this.pose(this.played, numbers, start);
    const hand = this.played.find(({ name }) => name.endsWith("gripper")) ?? this.played.at(-1);
    this.look(this.played, hand, [hand]);
  }

  choose(camera) {
    this.cameras.choose(camera);
    this.tools.camera.value = this.cameras.choice;
    this.stale = true;
  }

  nextCamera() {
    this.choose(this.cameras.next);
  }

  get azimuth() {
    return this.cameras.azimuth;
  }

  fit() {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    if (!width || !height || this.headset.isOn) return;
    this.renderer.setPixelRatio(this.ratio);
    this.renderer.setSize(width, height, false);
    this.cameras.fit(width, height, this.tools.free());
    this.stale = true;
  }

  // Draws if anything has changed: a computer without a graphics card has better things to do.
  render() {
    this.playback.step();
    if (this.headset.isOn) return;
    if (!this.cameras.update() && !this.stale) return;
    this.stale = false;
    const began = performance.now();
    this.renderer.render(this.scene, this.cameras.camera);
    this.hands.letter(this.cameras.camera);
    this.marks.letter(this.cameras.camera, this.canvas.clientWidth, this.canvas.clientHeight);
    this.adapt(performance.now() - began);
  }

  // Draws fewer pixels, then no shadows, where drawing is slow.
  adapt(took) {
    this.usual = 0.9 * (this.usual ?? took) + 0.1 * took;
    this.drawn = (this.drawn ?? 0) + 1;
    if (this.drawn < 20 || this.usual < SLOW) return;
    if (this.ratio > 0.6) this.ratio = Math.max(0.6, 0.75 * this.ratio);
    else if (this.renderer.shadowMap.enabled) {
      this.renderer.shadowMap.enabled = false;
      this.ground.sun.castShadow = false;
    }
    this.drawn = 0;
    this.fit();
  }
}
