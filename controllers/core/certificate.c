/* How far a motion falls short of safety: below its least distance, beyond a joint's range, or, where one is beyond
   already, farther than now. Written as (of the hard limits alone, of all), [m, rad]; 0 where it is safe.

   A pair p comes nearer by at most r_p = |v_p| + sum_j L_jp |v_j| a second. Where it was d_p, it is measured again
   before it can have come below its least distance by more than a share of that. */
#include "core.h"
#include "vector.h"

#define ERROR 1e-3       /* of signed distances, that is no loss [m] */
#define HARD_ERROR 1e-4  /* the same where a thing that stands is nearer than its hard limit [m] */
#define HARD 0.5         /* hard limit of the robot with itself and with what stands, as a share of the least */
#define UNFOLDING 0.005  /* that a pair of own shapes may come nearer while others overlap [m] */
#define BEYOND 0.01      /* of its range that a joint may come to rest [m, rad] */
#define MOST_SAMPLES 128 /* of a stretch */
#define SPACING 0.5      /* way of a pair between two samples, as a share of its least distance */

/* A part of a motion, in which velocities are linear in time. */
typedef struct {
  double q[MOST_COORDINATES];      /* where it begins */
  double before[MOST_COORDINATES]; /* velocities at both ends */
  double after[MOST_COORDINATES];
  double time;                     /* when it begins, from now [s] */
  double length;                   /* [s] */
} Stretch;

static void find(Scene *s, double time, double hard, double all) {
  if (!(hard <= 0.0 && all <= 0.0)) s->violation[2] = SMALLER(s->violation[2], time);
  s->violation[0] = larger_or_nan(s->violation[0], hard);
  s->violation[1] = larger_or_nan(s->violation[1], larger_or_nan(all, hard));
}

/* The smallest distance between the robot's own shapes at the start, 0 where none overlap. */
static double deepest_own(const Scene *s) {
  double deepest = 0.0;
  for (int64_t p = 0; p < s->P; p++)
    if (s->slack[p] == OWN) deepest = SMALLER(deepest, s->start_distances[p]);
  return deepest;
}

/* A robot that overlaps itself (an arm folded by hand) has to unfold: its shapes are larger than it is, and another
   pair of them that came no nearer at all could hold it for good. None comes nearer than the deepest is. */
static void check_pair(Scene *s, int64_t pair, double time) {
  double least = s->least[pair], now = s->start_distances[pair], distance = s->here[pair];
  if (s->slack[pair] == OWN && s->deepest < 0.0) now = SMALLER(now, LARGER(s->deepest, now - UNFOLDING));
  double hard = SMALLER(HARD * least, now - HARD_ERROR) - distance;
  find(s, time, s->slack[pair] == MOVING ? 0.0 : hard, SMALLER(least, now - ERROR) - distance);
}

static void check_joints(Scene *s, const double *begin, const double *q, double time) {
  for (int64_t j = 0; j < s->n; j++) {
    double room = SMALLER(q[j] - s->lower[j], s->upper[j] - q[j]);
    double least = SMALLER(-BEYOND, SMALLER(begin[j] - s->lower[j], s->upper[j] - begin[j]));
    if (!(room >= least)) find(s, time, least - room, 0.0);
  }
}

/* q_j(t) = q_j + v_j t + 1/2 (v'_j - v_j) t^2 / length. */
static void position(const Scene *s, const Stretch *part, double time, double *q) {
  double share = part->length > 0.0 ? time / part->length : 0.0;
  for (int64_t j = 0; j < s->n; j++)
    q[j] = part->q[j] + time * (part->before[j] + 0.5 * share * (part->after[j] - part->before[j]));
}

/* Find the pairs that can come below their least distance on a way, (n), in a time. */
static int64_t close_pairs(Scene *s, const double *way, double time) {
  int64_t count = 0;
  for (int64_t p = 0; p < s->P; p++) s->bound[p] = s->here[p] - s->speed[p] * time;
  for (int64_t j = 0; j < s->n; j++) add(s->bound, -way[j], s->bounds + j * s->P, s->P);
  for (int64_t p = 0; p < s->P; p++)
    if (!(s->bound[p] >= s->least[p])) s->close[count++] = p;
  return count;
}

/* Go through a stretch; distances of close pairs, or lower bounds of them, stand in here. */
static void pass(Scene *s, int64_t count, const double *begin, const Stretch *part) {
  double *rate = s->bound, q[MOST_COORDINATES], witness[9], passed = 0.0;
  for (int64_t i = 0; i < count; i++) {
    int64_t p = s->close[i];
    rate[p] = s->speed[p];
    for (int64_t j = 0; j < s->n; j++)
      rate[p] += s->bounds[j * s->P + p] * LARGER(fabs(part->before[j]), fabs(part->after[j]));
  }
  while (count && passed < part->length) {
    double left = part->length - passed, step = left;
    int is_placed = 0;
    for (int64_t i = 0; i < count; i++) {
      int64_t p = s->close[i];
      double room = LARGER(s->here[p] - s->least[p], 0.0) + SPACING * LARGER(s->least[p], ERROR);
      if (rate[p] * step > room) step = room / rate[p];
    }
    step = LARGER(step, part->length / MOST_SAMPLES);
    passed = step < left ? passed + step : part->length;
    for (int64_t i = 0; i < count; i++) {
      int64_t p = s->close[i];
      s->here[p] -= rate[p] * step;
      if (s->here[p] >= s->least[p]) continue;
      if (!is_placed) {
        position(s, part, passed, q);
        place_joints(s, q);
        is_placed = 1;
      }
      s->here[p] = measured(s, p, part->time + passed, witness);
      check_pair(s, p, part->time + passed);
    }
  }
  position(s, part, part->length, q);
  check_joints(s, begin, q, part->time + part->length);
}

/* Begin the stretch from a knot to the next; the first begins where the robot is now. */
static void begin_stretch(const Scene *s, const double *velocities, double dt, double elapsed, int first,
                          Stretch *part) {
  double share = first ? SMALLER(elapsed / dt, 1.0) : 0.0;
  part->length = dt * (1.0 - share);
  for (int64_t j = 0; j < s->n; j++) {
    part->after[j] = velocities[s->n + j];
    part->before[j] = (1.0 - share) * velocities[j] + share * part->after[j];
  }
}

static void end_stretch(const Scene *s, Stretch *part) {
  position(s, part, part->length, part->q);
  part->time += part->length;
}

/* Of a motion from the start to rest, whose velocities are linear between knots, (count, n), dt apart, of which a
   time less than dt has passed; and, where things move, of waiting until the span is over. With a lag, (n,), of the
   same motion from start + lag, too. */
void motion_violation(Scene *s, int64_t count, const double *velocities, double dt, double elapsed, double span,
                      const double *lag) {
  double way[MOST_COORDINATES] = {0}, begin[MOST_COORDINATES], time = 0.0;
  int64_t n = s->n;
  int moving = 0;
  Stretch part;
  for (int64_t k = 0; k + 1 < count; k++) {
    begin_stretch(s, velocities + k * n, dt, elapsed, k == 0, &part);
    time += part.length;
    for (int64_t j = 0; j < n; j++) way[j] += 0.5 * part.length * (fabs(part.before[j]) + fabs(part.after[j]));
  }
  for (int64_t p = 0; p < s->P; p++) moving |= s->speed[p] > 0.0;
  double wait = moving ? LARGER(span - time, 0.0) : 0.0;
  s->violation[0] = s->violation[1] = 0.0, s->violation[2] = INFINITY;
  s->deepest = deepest_own(s);
  for (int lagging = 0; lagging <= (lag ? 1 : 0); lagging++) {
    memcpy(s->here, s->start_distances, s->P * sizeof(double));
    memcpy(part.q, s->start, n * sizeof(double));
    for (int64_t j = 0; lagging && j < n; j++) {
      part.q[j] += lag[j];
      add(s->here, -fabs(lag[j]), s->bounds + j * s->P, s->P);
    }
    memcpy(begin, part.q, n * sizeof(double));
    part.time = 0.0;
    int64_t close = close_pairs(s, way, time + wait);
    for (int64_t k = 0; k + 1 < count; k++) {
      begin_stretch(s, velocities + k * n, dt, elapsed, k == 0, &part);
      pass(s, close, begin, &part);
      end_stretch(s, &part);
    }
    memset(part.before, 0, sizeof part.before), memset(part.after, 0, sizeof part.after);
    part.length = wait;
    if (wait > 0.0) pass(s, close, begin, &part);
  }
}
