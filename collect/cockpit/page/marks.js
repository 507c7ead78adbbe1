// What is asked and what is made of it, drawn into the scene: ghosts, the plan, the nearest pair. Each has a line of
// its own kind, so that nobody needs the colours: the ghosts are hollow, the plan is solid, the nearest pair is dotted, a
// policy's plan is a row of balls.
import { THREE } from "./three.min.js";
import { place } from "./scene.js";
import { centimetres } from "./way.js";

export const ASKED = 0xffa000, PLAN = 0x2f7df6, NEAR = 0xe5484d, POLICY = 0x00f0b4;
const ON_FLOOR = 0.006; // [m]

function line(scene, colour, dash) {
  const look = { color: colour, depthTest: false, transparent: true };
  const material = dash
    ? new THREE.LineDashedMaterial({ ...look, dashSize: dash, gapSize: 0.7 * dash }) : new THREE.LineBasicMaterial(look);
  const made = new THREE.Line(new THREE.BufferGeometry(), material);
  made.renderOrder = 4;
  made.frustumCulled = false;
  scene.add(made);
  return made;
}

function draw(made, points) {
  made.visible = points.length > 1;
  if (!made.visible) return;
  made.geometry.dispose();
  made.geometry = new THREE.BufferGeometry().setFromPoints(points);
  made.computeLineDistances();
}

// A plan as a tube: a line of WebGL is one pixel wide on most computers.
function tube(scene, colour, radius) {
  const made = new THREE.Mesh(new THREE.BufferGeometry(), new THREE.MeshBasicMaterial({ color: colour, depthTest: false, transparent: true }));
  made.renderOrder = 3;
  made.frustumCulled = false;
  made.radius = radius;
  scene.add(made);
  return made;
}

function drawTube(made, points, scale) {
  const length = points.slice(1).reduce((sum, point, index) => sum + point.distanceTo(points[index]), 0);
  made.visible = length > 0.01 * scale;
  if (!made.visible) return;
  made.geometry.dispose();
  made.geometry = new THREE.TubeGeometry(new THREE.CatmullRomCurve3(points), 24, made.radius, 6);
}

export class Marks {
  // label: an element beside the nearest pair
  constructor(scene, label) {
    this.scene = scene;
    this.label = label;
    this.scale = 1; // of the robot's world; lengths here are those at scale 1
    this.track = tube(scene, PLAN, 0.012);
    this.near = line(scene, NEAR, 0.008);
    this.outline = line(scene, ASKED, 0.06);
    this.ends = [0, 1].map(() => new THREE.Mesh(
      new THREE.SphereGeometry(0.012, 12, 8), new THREE.MeshBasicMaterial({ color: NEAR, depthTest: false, transparent: true }),
    ));
    for (const end of this.ends) end.renderOrder = 4;
    this.ball = this.ends[0].clone();
    this.ball.material = new THREE.MeshBasicMaterial({ color: POLICY, depthTest: false, transparent: true });
    this.balls = []; // along a policy's plan
    this.hands = []; // of each: its plan, the way that is asked for, its ghost and the bodies that it copies
    scene.add(...this.ends);
  }

  // The ghost of a hand looks like the hand.
  stage(stage, bodies) {
    this.baseSize = stage.base_size;
    while (this.hands.length < stage.hands.length) this.hands.push(this.hand());
    this.setScale(stage.scale);
    this.hands.forEach((hand, index) => {
      hand.bodies = stage.hands[index].bodies;
      hand.ghost.clear();
      for (const body of hand.bodies) {
        const copy = new THREE.Group();
        for (const part of bodies[body].children) copy.add(...this.hollow(part));
        hand.ghost.add(copy);
      }
    });
  }

  hand() {
    const made = { path: tube(this.scene, PLAN, 0.006 * this.scale), asked: line(this.scene, ASKED, 0.03 * this.scale), ghost: new THREE.Group() };
    this.scene.add(made.ghost);
    return made;
  }

  // Lines of a small robot are drawn finer.
  setScale(scale) {
    for (const each of [this.track, ...this.hands.map(({ path }) => path)]) each.radius *= scale / this.scale;
    for (const { material } of [this.near, this.outline, ...this.hands.map(({ asked }) => asked)]) {
      material.dashSize *= scale / this.scale;
      material.gapSize *= scale / this.scale;
    }
    for (const end of this.ends) end.scale.setScalar(scale);
    this.scale = scale;
  }

  hollow(part) {
    const skin = new THREE.Mesh(part.geometry, new THREE.MeshBasicMaterial({ color: ASKED, transparent: true, opacity: 0.3, depthWrite: false }));
    const edges = new THREE.LineSegments(new THREE.EdgesGeometry(part.geometry, 30), new THREE.LineBasicMaterial({ color: ASKED, depthTest: false, transparent: true }));
    for (const each of [skin, edges]) {
      each.position.copy(part.position);
      each.quaternion.copy(part.quaternion);
      each.renderOrder = 3;
      each.frustumCulled = false;
    }
    return [skin, edges];
  }

  frame(frame) {
    this.hands.forEach((hand, index) => {
      drawTube(hand.path, (frame.paths[index] ?? []).map((point) => new THREE.Vector3(...point)), this.scale);
      this.lead(hand, frame.tools[index], frame.ghosts[index] ?? [], frame.poses);
    });
    drawTube(this.track, frame.track.map(([x, y]) => new THREE.Vector3(x, y, ON_FLOOR)), this.scale);
    this.leadBase(frame);
    const { leads = [], lead_base = [] } = frame.drivers ?? {};
    this.row([...leads.flat(), ...lead_base.map(([x, y]) => [x, y, ON_FLOOR])]);
    const points = frame.nearest?.points ?? [];
    const ends = points.length ? [new THREE.Vector3(...points.slice(0, 3)), new THREE.Vector3(...points.slice(3))] : [];
    draw(this.near, ends);
    this.ends.forEach((end, index) => { end.visible = ends.length > 0; if (end.visible) end.position.copy(ends[index]); });
    this.said = frame.nearest ? `${centimetres(frame.nearest.distance)} cm` : "";
  }

  row(points) {
    while (this.balls.length < points.length) this.scene.add(this.balls[this.balls.push(this.ball.clone()) - 1]);
    this.balls.forEach((ball, index) => {
      ball.visible = index < points.length;
      if (ball.visible) ball.position.set(...points[index]);
      ball.scale.setScalar(1.7 * this.scale);
    });
  }

  // Every part of a hand stands to its ghost as it stands to the hand now.
  lead({ asked, ghost, bodies }, tool, wanted, poses) {
    ghost.visible = wanted.length > 0;
    draw(asked, ghost.visible ? [tool, wanted].map((pose) => new THREE.Vector3(...pose.slice(0, 3))) : []);
    if (!ghost.visible) return;
    const [now, ahead] = [tool, wanted].map((pose) => place(new THREE.Group(), pose));
    for (const each of [now, ahead]) each.updateMatrix();
    const moved = ahead.matrix.multiply(now.matrix.invert());
    bodies.forEach((body, index) => {
      const part = ghost.children[index];
      place(part, poses, 7 * body);
      part.updateMatrix();
      moved.clone().multiply(part.matrix).decompose(part.position, part.quaternion, part.scale);
    });
  }

  // The outline of the base on the floor, with a nose that says where its front is.
  leadBase(frame) {
    const [x, y, yaw] = frame.ghost_base;
    if (!frame.ghost_base.length) return draw(this.outline, []);
    const [a, b] = this.baseSize.map((side) => side / 2);
    const corners = [[a, -b], [a, b], [-a, b], [-a, -b], [a, -b], [a + 0.15 * this.scale, 0], [a, b]];
    draw(this.outline, corners.map(([p, q]) => new THREE.Vector3(
      x + Math.cos(yaw) * p - Math.sin(yaw) * q, y + Math.sin(yaw) * p + Math.cos(yaw) * q, ON_FLOOR,
    )));
  }

  // Puts the distance beside its line; called when the camera is where it will draw from.
  letter(camera, width, height) {
    const middle = this.ends[0].position.clone().add(this.ends[1].position).multiplyScalar(0.5).project(camera);
    const seen = this.said && this.near.visible && Math.abs(middle.z) < 1;
    this.label.hidden = !seen;
    if (!seen) return;
    this.label.textContent = this.said;
    this.label.style.transform = `translate(${((middle.x + 1) / 2 * width + 10).toFixed(0)}px, ${((1 - middle.y) / 2 * height - 10).toFixed(0)}px)`;
  }

  // Shows everything there is to show, anywhere.
  rehearse() {
    const points = [new THREE.Vector3(), new THREE.Vector3(1, 0, 0)];
    for (const each of [this.near, this.outline, ...this.hands.map(({ asked }) => asked)]) draw(each, points);
    for (const each of [this.track, ...this.hands.map(({ path }) => path)]) drawTube(each, points);
    for (const each of [...this.hands.map(({ ghost }) => ghost), ...this.ends]) each.visible = true;
  }

  hide() {
    const ofHands = this.hands.flatMap(({ path, asked, ghost }) => [path, asked, ghost]);
    for (const each of [this.track, this.near, this.outline, ...this.ends, ...ofHands]) each.visible = false;
    this.row([]);
    this.said = "";
  }
}
