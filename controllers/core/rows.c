/* The inequality rows  c_p' s - a_p sigma <= b_p  of one update, and which of them a point breaks.

   A row has a number, the same in every update: first the slacks (sigma >= 0), then the limits of the joints
   (+-x <= 1 + a sigma, x of (q, v, u) relative to half of its range, which comes back with a joint beyond it), then those of the distances,
   first + 1000 pair + node. Its place is where it stands in this update: that number, or the first + its index. */
#include "core.h"
#include "vector.h"

#define NODES 1000  /* more than there are in any plan */
#define SCALE 10.0  /* a violation of 0.1 m counts like one of a whole joint limit */
#define SLACK_TOLERANCE 1e-7
#define DISTANCE_TOLERANCE 1e-6 /* [m] */

static const double SHARES[3] = {1.0, VELOCITY_SLACK, 0.0}; /* of the limits' slack that (q, v, u) get */
static const double TOLERANCES[3] = {1e-5, 1e-5, 1e-7};

static int64_t joint_rows(const Core *c) { return SLACKS + 6 * c->M; }

void take_joints(Core *c, const double *q, const double *v, const double *u) {
  int64_t n = c->n;
  c->broken = 0;
  for (int64_t j = 0; j < n; j++) {
    c->joint_scale[j] = 0.5 * (c->upper[j] - c->lower[j]);
    c->joint_scale[n + j] = c->v_max[j];
    c->joint_scale[2 * n + j] = c->a_max[j];
  }
  for (int64_t k = 0; k < c->N; k++)
    for (int64_t j = 0; j < n; j++) {
      double *value = c->joint_value + 3 * k * n + j;
      double middle = 0.5 * (c->upper[j] + c->lower[j]) + c->shift[k * n + j];
      value[0] = (q[(k + 1) * n + j] - middle) / c->joint_scale[j];
      value[n] = v[(k + 1) * n + j] / c->joint_scale[n + j];
      value[2 * n] = u[k * n + j] / c->joint_scale[2 * n + j];
      c->broken |= LARGER(fabs(value[0]), fabs(value[n])) > 1.0;
    }
}

/* Whether a distance with this gradient can fall by more than it may while accelerations keep their limit. */
static int can_fall(const Core *c, int64_t node, const double *gradient, double left) {
  int64_t n = c->n, stage = SMALLER(node, c->N) - 1;
  const double *rises = c->rises + 4 * stage * n;
  const double *gain = node > c->N ? c->gains + (node - c->N - 1) * n : 0;
  double fall = 0.0;
  for (int64_t j = 0; j < n; j++) {
    int64_t side = gradient[j] > 0.0 ? n : 0;
    double way = rises[side + j] + (gain ? gain[j] * rises[2 * n + side + j] : 0.0);
    fall += fabs(gradient[j]) * way;
  }
  return !(fall < left);
}

/* Take  d >= margin - deficit 0.8^k  of what was found near at nodes after now: a pair inside its margin recovers
   gradually. Rows that cannot be met are left out. */
void take_distances(Core *c, const Scene *scene) {
  int64_t n = c->n, found = c->count;
  c->count = 0;
  for (int64_t i = 0; i < found; i++) {
    int64_t node = c->near[2 * i], pair = c->near[2 * i + 1], index = c->count;
    const double *gradient = c->gradient + i * n;
    double deficit = LARGER(c->margins[pair] - c->found[pair], 0.0);
    double left = c->found[node * scene->P + pair] - c->margins[pair] + deficit * pow(RECOVERY, (double)node);
    c->broken |= left < 0.0;
    if (!can_fall(c, node, gradient, left)) continue;
    c->near[2 * index] = node;
    c->near[2 * index + 1] = pair;
    c->number[index] = joint_rows(c) + NODES * pair + node;
    c->left[index] = left;
    memmove(c->gradient + index * n, gradient, n * sizeof(double));
    c->count++;
  }
}

/* Return the place of a row by its number; -1 where it is not in this update. */
int64_t place_of(const Core *c, int64_t number) {
  int64_t first = joint_rows(c);
  if (number < first) return number;
  for (int64_t index = 0; index < c->count; index++)
    if (c->number[index] == number) return first + index;
  return -1;
}

int64_t number_at(const Core *c, int64_t place) {
  int64_t first = joint_rows(c);
  return place < first ? place : c->number[place - first];
}

/* Return the place of the row that (s, sigma) breaks most, active ones left out; -1 if none. */
WIDE int64_t most_violated(const Core *c, const Scene *scene) {
  int64_t n = c->n, row = -1, first = joint_rows(c);
  double worst = 0.0;
  for (int64_t i = 0; i < SLACKS; i++)
    if (-c->slacks[i] > LARGER(worst, SLACK_TOLERANCE) && !c->is_held[i]) worst = -c->slacks[i], row = i;
  for (int part = 0; part < 3; part++) {
    double allowed = 1.0 + c->slacks[LIMITS] * SHARES[part], least = allowed + TOLERANCES[part];
    for (int64_t k = 0; k < c->N; k++)
      for (int64_t j = 0; j < n; j++) {
        int64_t index = (k * 3 + part) * n + j;
        double value = c->joint_value[index] + c->motion[index] / c->joint_scale[part * n + j];
        if (fabs(value) <= least || fabs(value) - allowed <= worst) continue;
        int64_t place = SLACKS + 2 * index + (value < 0.0);
        if (!c->is_held[place]) worst = fabs(value) - allowed, row = place;
      }
  }
  for (int64_t index = 0; index < c->count; index++) {
    int64_t node = c->near[2 * index], stage = SMALLER(node, c->N) - 1;
    const double *g = c->gradient + index * n, *dq = c->motion + 3 * stage * n;
    double change = -dot(g, dq, n);
    if (node > c->N) {
      const double *gain = c->gains + (node - c->N - 1) * n;
      for (int64_t j = 0; j < n; j++) change -= g[j] * gain[j] * dq[n + j];
    }
    double excess = change - c->left[index] - c->slacks[scene->slack[c->near[2 * index + 1]]];
    if (excess > DISTANCE_TOLERANCE && SCALE * excess > worst && !c->is_held[first + index])
      worst = SCALE * excess, row = first + index;
  }
  return row;
}

/* Write (c, -a) of a row, (M + 4), and its first entry; return b. */
double write_row(const Core *c, const Scene *scene, int64_t place, double *out, int64_t *first) {
  int64_t n = c->n, M = c->M;
  double row[3 * MOST_COORDINATES], g[3 * MOST_COORDINATES], right;
  memset(out, 0, c->V * sizeof(double));
  if (place < SLACKS) {
    out[M + place] = -1.0;
    *first = M;
    return 0.0;
  }
  memset(row, 0, c->B * sizeof(double));
  int64_t stage;
  if (place < joint_rows(c)) {
    int64_t index = (place - SLACKS) / 2, part = index / n % 3, j = index % n;
    double sign = (place - SLACKS) % 2 ? -1.0 : 1.0;
    stage = index / (3 * n);
    row[part * n + j] = sign / c->joint_scale[part * n + j];
    out[M + LIMITS] = -SHARES[part];
    right = 1.0 - sign * c->joint_value[index];
  } else {
    int64_t index = place - joint_rows(c), node = c->near[2 * index];
    const double *gradient = c->gradient + index * n;
    stage = SMALLER(node, c->N) - 1;
    for (int64_t j = 0; j < n; j++) {
      row[j] = -gradient[j];
      if (node > c->N) row[n + j] = -c->gains[(node - c->N - 1) * n + j] * gradient[j];
    }
    out[M + scene->slack[c->near[2 * index + 1]]] = -1.0;
    right = c->left[index];
  }
  to_variables(c, row, g);
  int64_t start = (stage - 2) * n, begin = LARGER(0, -start);
  memcpy(out + start + begin, g + begin, (c->B - begin) * sizeof(double));
  *first = start + begin;
  return right;
}
