// Turns in space: quaternions are [w, x, y, z], turns are vectors [rad].
export function times([aw, ax, ay, az], [bw, bx, by, bz]) {
  return [
    aw * bw - ax * bx - ay * by - az * bz, aw * bx + ax * bw + ay * bz - az * by,
    aw * by - ax * bz + ay * bw + az * bx, aw * bz + ax * by - ay * bx + az * bw,
  ];
}

export const inverse = ([w, x, y, z]) => [w, -x, -y, -z];

// The turn that takes one quaternion to another, in the frame in which both are given.
export function turnTo(from, to) {
  const [w, ...axis] = times(to, inverse(from));
  const sine = Math.hypot(...axis), angle = 2 * Math.atan2(sine, Math.abs(w));
  return sine < 1e-6 ? [0, 0, 0] : axis.map((x) => Math.sign(w || 1) * x * angle / sine);
}
