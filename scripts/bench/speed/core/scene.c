/* Signed distances of pairs along a path, measured only where a pair can come below its limit.

   A coordinate j brings a pair together by at most L_jp per unit, a thing that moves by |v_p| per second, so that
       d_p(q_k, t_k) >= d_p(q', t') - sum_j L_jp |q_k - q'|_j - |v_p| |t_k - t'|
   from any (q', t') where it is known: at the start, at the node before, at this node of the last path. */
#include "core.h"
#include "shapes.h"

static void place_joints(Scene *s, const double *q) {
  static const double IDENTITY[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  memcpy(s->world_rotation, IDENTITY, sizeof IDENTITY);
  memset(s->world_position, 0, 3 * sizeof(double));
  for (int64_t j = 0; j < s->n; j++) {
    const double *R = s->world_rotation + 9 * s->parent[j], *p = s->world_position + 3 * s->parent[j];
    double base[9], *rotation = s->world_rotation + 9 * (j + 1), *position = s->world_position + 3 * (j + 1);
    const double *a = s->joint_axis + 3 * j;
    multiply(R, s->joint_rotation + 9 * j, base);
    rotate(R, s->joint_position + 3 * j, position);
    along3(position, 1.0, p, position);
    rotate(base, a, s->axis + 3 * j);
    if (s->slides[j]) {
      memcpy(rotation, base, sizeof base);
      along3(position, q[j], s->axis + 3 * j, position);
    } else { /* O. Rodrigues */
      double sine = sin(q[j]), cosine = cos(q[j]), rest = 1.0 - cosine, turn[9];
      for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++) turn[3 * i + k] = rest * a[i] * a[k] + (i == k ? cosine : 0.0);
      turn[1] -= a[2] * sine, turn[2] += a[1] * sine, turn[3] += a[2] * sine;
      turn[5] -= a[0] * sine, turn[6] -= a[1] * sine, turn[7] += a[0] * sine;
      multiply(base, turn, rotation);
    }
  }
  memset(s->placed, 0, s->S * sizeof(int64_t));
}

static Shape placed(Scene *s, int64_t index, double time) {
  double *rotation = s->placed_rotation + 9 * index, *position = s->placed_position + 3 * index;
  if (!s->placed[index]) {
    int64_t joint = s->carrier[index];
    multiply(s->world_rotation + 9 * joint, s->shape_rotation + 9 * index, rotation);
    rotate(s->world_rotation + 9 * joint, s->shape_position + 3 * index, position);
    along3(position, 1.0, s->world_position + 3 * joint, position);
    along3(position, time, s->velocity + 3 * index, position);
    s->placed[index] = 1;
  }
  return (Shape){s->kind[index], s->size + 3 * index, rotation, position};
}

/* Return the signed distance of a pair, NaN where it cannot be measured; write its witness. */
static double measured(Scene *s, int64_t pair, double time, double *witness) {
  Shape first = placed(s, s->first[pair], time), second = placed(s, s->second[pair], time);
  if (nearest(&first, &second, witness)) {
    double placements[24];
    memcpy(placements, first.rotation, 9 * sizeof(double));
    memcpy(placements + 9, first.position, 3 * sizeof(double));
    memcpy(placements + 12, second.rotation, 9 * sizeof(double));
    memcpy(placements + 21, second.position, 3 * sizeof(double));
    if (s->measure(pair, placements, witness)) return NAN;
  }
  return signed_distance(witness);
}

/* d'_j = n.(velocity of the second's nearest point - that of the first's) by a unit of coordinate j. */
static void gradient_of(const Scene *s, int64_t pair, const double *witness, double *gradient) {
  for (int64_t j = 0; j < s->n; j++) {
    double side = s->moves[pair * s->n + j];
    gradient[j] = 0.0;
    if (side == 0.0) continue;
    const double *axis = s->axis + 3 * j;
    if (s->slides[j]) {
      gradient[j] = side * dot3(witness, axis);
    } else {
      double arm[3], way[3];
      along3(witness + (side > 0.0 ? 6 : 3), -1.0, s->world_position + 3 * (j + 1), arm);
      cross(axis, arm, way);
      gradient[j] = side * dot3(witness, way);
    }
  }
}

/* Raise lower bounds, (P), by what is known at another configuration. */
static void raise(const Scene *s, const double *q, const double *there, double time, const double *known,
                  double *bound, double *room) {
  for (int64_t p = 0; p < s->P; p++) room[p] = known[p] - s->speed[p] * time;
  for (int64_t j = 0; j < s->n; j++) {
    double moved = fabs(q[j] - there[j]);
    if (moved > 0.0) add(room, -moved, s->bounds + j * s->P, s->P);
  }
  for (int64_t p = 0; p < s->P; p++) bound[p] = LARGER(bound[p], room[p]);
}

static void measure_all(Scene *s, const double *q, double *values) {
  double witness[9];
  if (s->now_known && !memcmp(s->now_q, q, s->n * sizeof(double))) {
    memcpy(values, s->now, s->P * sizeof(double));
    return;
  }
  place_joints(s, q);
  for (int64_t p = 0; p < s->P; p++) values[p] = measured(s, p, 0.0, witness);
  memcpy(s->now_q, q, s->n * sizeof(double));
  memcpy(s->now, values, s->P * sizeof(double));
  s->now_known = 1;
}

/* Measure at a node the pairs whose lower bound is below its limit; hand on those that are below it. */
static void measure_near(Scene *s, int64_t node, const double *q, double time, double *values,
                         const double *within, const Near *near) {
  double witness[9], gradient[64];
  int is_placed = 0;
  for (int64_t p = 0; p < s->P; p++) {
    if (values[p] >= within[p]) continue;
    if (!is_placed) place_joints(s, q);
    is_placed = 1;
    values[p] = measured(s, p, time, witness);
    if (near && !(values[p] >= within[p])) {
      gradient_of(s, p, witness, gradient);
      near->row(near->target, node, p, values[p], gradient);
    }
  }
}

/* Write the distances, (count, P), along a path from now; of pairs that cannot come near, lower bounds. The next
   path begins with what this one has found. */
void scene_distances(Scene *s, int64_t count, const double *q, const double *times, double *values,
                     const Near *near) {
  int64_t n = s->n, P = s->P;
  int moving = 0;
  for (int64_t p = 0; p < P; p++) moving |= s->speed[p] > 0.0;
  measure_all(s, q, values);
  for (int64_t k = 1; k < count; k++) {
    const double *here = q + k * n;
    double *there = values + k * P;
    for (int64_t p = 0; p < P; p++) there[p] = -INFINITY;
    raise(s, here, q, times[k], values, there, s->bound);
    if (k > 1) raise(s, here, here - n, times[k] - times[k - 1], there - P, there, s->bound);
    if (s->known_nodes == count) raise(s, here, s->known_q + k * n, 0.0, s->known + k * P, there, s->bound);
    measure_near(s, k, here, times[k], there, near->within, near);
  }
  s->known_nodes = moving ? 0 : count;
  memcpy(s->known_q, q, count * n * sizeof(double));
  memcpy(s->known, values, count * P * sizeof(double));
}

/* Write the same at configurations that are not a path from now; no gradients, and nothing is remembered. */
void scene_values(Scene *s, int64_t count, const double *q, const double *times, const double *start,
                  const double *now, const double *within, double *values) {
  for (int64_t k = 0; k < count; k++) {
    double *there = values + k * s->P;
    for (int64_t p = 0; p < s->P; p++) there[p] = -INFINITY;
    if (now) raise(s, q + k * s->n, start, times[k], now, there, s->bound);
    measure_near(s, k, q + k * s->n, times[k], there, within, 0);
  }
}
