// What there is to draw, made from the server's list: bodies of shapes and meshes, a floor, lights.
import { THREE } from "./three.min.js";

const SIDE = 60; // of the floor [m]

function geometry(shape, meshes) {
  const [a, b, c] = shape.size;
  switch (shape.kind) {
    case "box": return new THREE.BoxGeometry(2 * a, 2 * b, 2 * c);
    case "sphere": return new THREE.SphereGeometry(a, 24, 16);
    case "ellipsoid": return new THREE.SphereGeometry(1, 24, 16).scale(a, b, c);
    case "cylinder": return new THREE.CylinderGeometry(a, a, 2 * b, 32).rotateX(Math.PI / 2);
    case "capsule": return new THREE.CapsuleGeometry(a, 2 * b, 8, 24).rotateX(Math.PI / 2);
    default: return meshes[shape.mesh];
  }
}

function meshGeometries(table, buffer) {
  const vertices = new Float32Array(buffer, 0, 3 * table.vertices);
  const faces = new Uint32Array(buffer, 12 * table.vertices);
  return table.rows.map(([vertex, vertexCount, face, faceCount]) => {
    const made = new THREE.BufferGeometry();
    made.setAttribute("position", new THREE.BufferAttribute(vertices.slice(3 * vertex, 3 * (vertex + vertexCount)), 3));
    made.setIndex(new THREE.BufferAttribute(faces.slice(3 * face, 3 * (face + faceCount)), 1));
    const flat = made.toNonIndexed();
    flat.computeVertexNormals();
    return flat;
  });
}

// Numbers are a position and a quaternion (wxyz), from `start` on.
export function place(object, numbers, start = 0) {
  object.position.set(numbers[start], numbers[start + 1], numbers[start + 2]);
  object.quaternion.set(numbers[start + 4], numbers[start + 5], numbers[start + 6], numbers[start + 3]);
  return object;
}

function look(shape) {
  const [r, g, b, alpha] = shape.rgba;
  return new THREE.MeshStandardMaterial({
    color: new THREE.Color().setRGB(r, g, b, THREE.SRGBColorSpace), roughness: 0.65, metalness: 0.1,
    transparent: alpha < 1, opacity: alpha, side: shape.kind === "mesh" ? THREE.DoubleSide : THREE.FrontSide,
  });
}

// Returns a group a body, in the order of their poses.
export async function makeBodies(shapes, digest) {
  const answer = await fetch(`/meshes/${digest}.bin`);
  const meshes = meshGeometries(shapes.meshes, await answer.arrayBuffer());
  const bodies = shapes.bodies.map((name) => Object.assign(new THREE.Group(), { name }));
  for (const shape of shapes.geoms) {
    const mesh = new THREE.Mesh(geometry(shape, meshes), look(shape));
    mesh.castShadow = mesh.receiveShadow = true;
    place(mesh, shape.at);
    bodies[shape.body].add(mesh);
  }
  return bodies;
}

export function forgetBodies(scene, bodies) {
  for (const body of bodies) {
    scene.remove(body);
    body.traverse((each) => { each.geometry?.dispose(); each.material?.dispose(); });
  }
}

// A square metre of floor: a line around it. A picture, as long lines are cut off wrongly by some graphics drivers.
function tile() {
  const canvas = document.createElement("canvas"), side = 256;
  canvas.width = canvas.height = side;
  const pen = canvas.getContext("2d");
  pen.fillStyle = "#fff";
  pen.fillRect(0, 0, side, side);
  pen.strokeStyle = "#a9b1bd";
  pen.lineWidth = 5;
  pen.strokeRect(0, 0, side, side);
  const made = new THREE.CanvasTexture(canvas);
  made.wrapS = made.wrapT = THREE.RepeatWrapping;
  made.repeat.set(SIDE, SIDE);
  made.anisotropy = 8;
  return made;
}

// A floor, on which shadows fall; the sun goes with `follow`.
export class Ground {
  constructor(scene, repaint) {
    scene.add(new THREE.HemisphereLight(0xffffff, 0x8890a0, 1.9));
    this.sun = new THREE.DirectionalLight(0xffffff, 2.2);
    this.sun.castShadow = true;
    this.sun.shadow.mapSize.set(1024, 1024);
    this.sun.shadow.bias = -0.002;
    Object.assign(this.sun.shadow.camera, { left: -3, right: 3, top: 3, bottom: -3, near: 1, far: 14 });
    this.floor = new THREE.Mesh(new THREE.PlaneGeometry(SIDE, SIDE), new THREE.MeshLambertMaterial({ map: tile() }));
    this.floor.receiveShadow = true;
    this.floor.position.z = -0.004;
    scene.add(this.sun, this.sun.target, this.floor);
    this.follow(new THREE.Vector3());
    const dark = matchMedia("(prefers-color-scheme: dark)");
    const paint = () => {
      const colour = dark.matches ? 0x14171c : 0xe9ecf1;
      scene.background = new THREE.Color(colour);
      scene.fog = new THREE.Fog(colour, 9, 22);
      this.floor.material.color.set(dark.matches ? 0x39414d : 0xe6eaf0);
      repaint();
    };
    dark.addEventListener("change", paint);
    paint();
  }

  follow(place) {
    this.sun.target.position.copy(place);
    this.sun.position.copy(place).add(new THREE.Vector3(-2.5, -3, 6));
  }
}
