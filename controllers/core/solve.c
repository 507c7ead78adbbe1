/* The plan of one update: Gauss-Newton steps around a guess, usually one. */

#include "core.h"
#include "vector.h"

#define MORE_STEPS 2          /* at most, in one update */
#define COARSE 0.05           /* share of the promised descent by which a linearised cost may be wrong, */
#define SMALL 0.1             /* or of a descent that is this share of the cost */
#define TOLERANCE 1e-6        /* of the hard limits */
#define SMALLEST_SHARE 0.0625 /* of a step that makes the cost rise */

/* By how much pairs overlap at any node that do not at the first, or not as much. */
static double depth(const Core *c) {
  double deepest = 0.0;
  for (int64_t i = 0; i < c->K * c->P; i++) {
    double now = SMALLER(c->found[i % c->P], 0.0);
    deepest = LARGER(deepest, now - c->found[i]);
  }
  return deepest;
}

/* Roll out accelerations; measure distances along them; take the rows of those that are near. The next path begins
   with what this one has found. */
static void linearise(Core *c, Scene *scene) {
  int known = c->known_changes == scene->changes, moving = 0;
  roll_out(c, c->u, c->path, c->speeds);
  take_joints(c, c->path, c->speeds, c->u);
  reach_of(c, c->u);
  nodes_of(c, c->path, c->speeds);
  c->count = scene_distances(scene, c->K, c->nodes, c->times, c->within, c->known_q, known ? c->known : 0, 1, c->found,
                             c->near, c->gradient);
  take_distances(c, scene);
  for (int64_t p = 0; p < c->P; p++) moving |= scene->speed[p] > 0.0;
  c->known_changes = moving ? -1 : scene->changes;
  memcpy(c->known_q, c->nodes, c->K * c->n * sizeof(double));
  memcpy(c->known, c->found, c->K * c->P * sizeof(double));
}

/* Take u = guess within its limits; where that runs into something, the fastest stop, if it runs in less. */
static void begin(Core *c, Scene *scene) {
  int64_t size = c->N * c->n;
  for (int64_t i = 0; i < size; i++) c->u[i] = clamp(c->guess[i], -c->a_max[i % c->n], c->a_max[i % c->n]);
  linearise(c, scene);
  double deep = c->P ? depth(c) : 0.0;
  if (!(deep > 0.0)) return;
  memcpy(c->step_u, c->u, size * sizeof(double));
  for (int64_t i = 0; i < size; i++) {
    double v = c->v[i % c->n], limit = c->a_max[i % c->n] * c->dt;
    double rest = clamp(fabs(v) - (double)(i / c->n) * limit, 0.0, limit) / c->dt;
    c->u[i] = v > 0.0 ? -rest : rest;
  }
  linearise(c, scene);
  if (!(depth(c) <= deep)) {
    memcpy(c->u, c->step_u, size * sizeof(double));
    linearise(c, scene);
  }
}

/* Take the step, halved until the cost itself falls: Gauss-Newton alone may go round in circles. The rows are
   convex, so that from a guess within them a share of the step needs no more than that share of the slack. */
static double damp(Core *c, double before) {
  double linear = 0.0, square = dot(c->slacks, c->slacks, SLACKS);
  for (int i = 0; i < SLACKS; i++) linear += c->slacks[i];
  memcpy(c->guess, c->u, c->M * sizeof(double));
  for (double share = 1.0;; share *= 0.5) {
    for (int64_t i = 0; i < c->M; i++) {
      double limit = c->a_max[i % c->n], change = c->motion[(3 * (i / c->n) + 2) * c->n + i % c->n];
      c->step_u[i] = share * change;
      c->u[i] = clamp(c->guess[i] + share * change, -limit, limit);
    }
    roll_out(c, c->u, c->path, c->speeds);
    double cost = cost_of(c, c->path, c->speeds, c->u);
    double penalty = c->linear * share * linear + 0.5 * c->quadratic * share * share * square;
    if (cost + penalty <= before || share <= SMALLEST_SHARE || c->broken) return cost;
  }
}

/* Whether the cost's linearisation was too coarse. */
static int is_coarse(double before, double after, double descent) {
  return fabs(after - before - descent) > COARSE * LARGER(fabs(descent), SMALL * after);
}

/* Keep the speeds within their limits: cutting is monotone, so that no acceleration becomes larger. Begin with the
   velocity that is being sent, and follow the plan within what accelerations allow. */
static void finish(Core *c) {
  int64_t n = c->n, size = c->N * n;
  int fast = 0, other = 0;
  for (int64_t i = 0; i < size; i++) fast |= !(fabs(c->speeds[n + i]) <= c->v_max[i % n]);
  if (fast) {
    for (int64_t i = 0; i < size; i++) {
      double limit = c->v_max[i % n];
      c->speeds[n + i] = clamp(c->speeds[n + i], -limit, limit);
    }
    for (int64_t i = 0; i < size; i++) c->u[i] = (c->speeds[n + i] - c->speeds[i]) / c->dt;
    roll_out(c, c->u, c->path, c->speeds);
  }
  for (int64_t i = 0; i < size; i++) {
    double bound = c->a_max[i % n] * (1.0 + TOLERANCE) + TOLERANCE;
    c->solved &= fabs(c->u[i]) <= bound && isfinite(c->path[n + i]) && isfinite(c->speeds[n + i]);
  }
  for (int64_t j = 0; j < n; j++) other |= c->sent[j] != c->speeds[j];
  if (!other) return;
  memcpy(c->speeds, c->sent, n * sizeof(double));
  for (int64_t i = 0; i < size; i++) {
    double step = c->dt * c->a_max[i % n], before = c->speeds[i];
    c->speeds[n + i] = clamp(c->speeds[n + i], before - step, before + step);
    c->u[i] = (c->speeds[n + i] - before) / c->dt;
    c->path[n + i] = c->path[i] + 0.5 * c->dt * (before + c->speeds[n + i]);
  }
}

/* By how much the plan falls short of its distances, as `take_distances` wants them. */
static double shortfall(Core *c, Scene *scene) {
  double most = 0.0;
  nodes_of(c, c->path, c->speeds);
  scene_values(scene, c->K, c->nodes, c->times, c->path, c->distances, c->within, c->found);
  for (int64_t i = c->P; i < c->K * c->P; i++) {
    int64_t pair = i % c->P;
    double deficit = LARGER(c->margins[pair] - c->distances[pair], 0.0);
    most = LARGER(most, c->margins[pair] - deficit * pow(RECOVERY, (double)(i / c->P)) - c->found[i]);
  }
  return most;
}

/* Write the QP of a step from the guess: H, g and the rows; return the cost of the guess. */
double build_program(Core *c, Scene *scene) {
  for (int64_t p = 0; p < c->P; p++) c->within[p] = c->margins[p] + c->activation;
  begin(c, scene);
  return expand(c, c->path, c->speeds, c->u);
}


/* Solve the problem that stands in the core. A step that did not lead where its linearisation said is followed by
   another; what is reached when the work is spent is the plan. */
void solve_update(Core *c, Scene *scene) {
  for (c->steps = 1;; c->steps++) {
    double before = build_program(c, scene);
    if (c->steps == 1) memcpy(c->distances, c->found, c->P * sizeof(double));
    c->rows = c->count;
    c->solved = solve_program(c, scene);
    double after = c->solved ? damp(c, before) : 0.0;
    if (!c->solved) return;
    if (c->work <= 0.0 || c->steps > MORE_STEPS || !is_coarse(before, after, c->descent)) break;
    memcpy(c->guess, c->u, c->M * sizeof(double));
  }
  finish(c);
  c->shortfall = c->work <= 0.0 ? shortfall(c, scene) : 0.0;
}
