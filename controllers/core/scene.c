/* Signed distances of pairs along a path, measured only where a pair can come below its limit.

   A coordinate j brings a pair together by at most L_jp per unit, a mover by |v_p| per second, so that
       d_p(q_k, t_k) >= d_p(q', t') - sum_j L_jp |q_k - q'|_j - |v_p| |t_k - t'|
   from any (q', t') where it is known: at the start, at the node before, at this node of the last path. */
#include "core.h"
#include "shapes.h"

void place_joints(Scene *s, const double *q) {
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
    double centre[3];
    along3(s->shape_position + 3 * index, time, s->velocity + 3 * index, centre);
    multiply(s->world_rotation + 9 * joint, s->shape_rotation + 9 * index, rotation);
    rotate(s->world_rotation + 9 * joint, centre, position);
    along3(position, 1.0, s->world_position + 3 * joint, position);
    s->placed[index] = 1;
  }
  return (Shape){s->kind[index], s->size + 3 * index, rotation, position};
}

/* Return the signed distance of a pair, NaN where it cannot be measured; write its witness. */
double measured(Scene *s, int64_t pair, double time, double *witness) {
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
WIDE static void raise(Scene *s, const double *q, const double *there, double time, const double *known,
                       double *values) {
  for (int64_t p = 0; p < s->P; p++) s->bound[p] = known[p] - s->speed[p] * time;
  for (int64_t j = 0; j < s->n; j++) {
    double moved = fabs(q[j] - there[j]);
    if (moved > 0.0) add(s->bound, -moved, s->bounds + j * s->P, s->P);
  }
  for (int64_t p = 0; p < s->P; p++) values[p] = LARGER(values[p], s->bound[p]);
}

static void know_nothing(const Scene *s, double *values) {
  for (int64_t p = 0; p < s->P; p++) values[p] = -INFINITY;
}

/* The rows of a path, where they are wanted. */
typedef struct {
  int64_t count, *near;
  double *gradients;
} Rows;

/* Measure at a node the pairs whose lower bound is below its limit; write the gradients of those that are. */
static void measure(Scene *s, int64_t node, const double *q, double time, const double *within, double *values,
                    Rows *rows) {
  double witness[9];
  int is_placed = 0;
  for (int64_t p = 0; p < s->P; p++) {
    if (values[p] >= within[p]) continue;
    if (!is_placed) place_joints(s, q);
    is_placed = 1;
    values[p] = measured(s, p, time, witness);
    if (!rows || values[p] >= within[p]) continue;
    rows->near[2 * rows->count] = node;
    rows->near[2 * rows->count + 1] = p;
    gradient_of(s, p, witness, rows->gradients + rows->count++ * s->n);
  }
}

/* All distances at time 0; those of the same configuration among the same things are known. */
static void measure_now(Scene *s, const double *q, double *values) {
  double witness[9];
  if (s->now_changes != s->changes || memcmp(s->now_q, q, s->n * sizeof(double))) {
    place_joints(s, q);
    for (int64_t p = 0; p < s->P; p++) s->now[p] = measured(s, p, 0.0, witness);
    memcpy(s->now_q, q, s->n * sizeof(double));
    s->now_changes = s->changes;
  }
  memcpy(values, s->now, s->P * sizeof(double));
}

/* Write the distances, (count, P), along a path from now; of pairs that cannot come near, lower bounds. Return for
   how many a gradient is written, with node and pair, from the first node on for which they are wanted.
   known: distances, or lower bounds of them, at other configurations among the same things that stand; or none. */
int64_t scene_distances(Scene *s, int64_t count, const double *q, const double *times, const double *within,
                        const double *known_q, const double *known, int64_t first, double *values, int64_t *near,
                        double *gradients) {
  int64_t n = s->n, P = s->P;
  Rows rows = {0, near, gradients};
  measure_now(s, q, values);
  if (first == 0) {
    know_nothing(s, s->here);
    measure(s, 0, q, times[0], within, s->here, &rows);
  }
  for (int64_t k = 1; k < count; k++) {
    const double *here = q + k * n;
    double *there = values + k * P;
    know_nothing(s, there);
    raise(s, here, q, times[k], values, there);
    if (k > 1) raise(s, here, here - n, times[k] - times[k - 1], there - P, there);
    if (known) raise(s, here, known_q + k * n, 0.0, known + k * P, there);
    measure(s, k, here, times[k], within, there, &rows);
  }
  return rows.count;
}

/* Write the same at configurations; from a start, (n), and its distances now, where these are known. */
void scene_values(Scene *s, int64_t count, const double *q, const double *times, const double *start,
                  const double *now, const double *within, double *values) {
  for (int64_t k = 0; k < count; k++) {
    double *there = values + k * s->P;
    know_nothing(s, there);
    if (now) raise(s, q + k * s->n, start, times[k], now, there);
    measure(s, k, q + k * s->n, times[k], within, there, 0);
  }
}
