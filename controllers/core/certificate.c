/* How far a motion falls short of safety: below its least distance, beyond a joint's range, or, where one is beyond
   already, farther than now. Written as (of the hard limits alone, of all), [m, rad]; 0 where it is safe. */
#include "core.h"
#include "vector.h"

#define ERROR 1e-3      /* of signed distances, that is no loss [m] */
#define HARD_ERROR 1e-4 /* the same where a thing that stands is nearer than its hard limit [m] */
#define HARD 0.5        /* hard limit of the robot with itself and with what stands, as a share of the least */
#define BEYOND 0.01     /* of its range that a joint may come to rest [m, rad] */
#define MOST_SAMPLES 128 /* of a stop, and of the waiting after it */
#define SPACING 0.5     /* of samples, as a share of the least distance, on the way of a pair */

/* Along a path, (count, 2): distances are measured where they can come below the least. */
void path_violations(Scene *s, int64_t count, const double *path, const double *times, double *violations) {
  const double *least = s->least, *start = s->start, *now = s->start_distances, *lower = s->lower, *upper = s->upper;
  for (int64_t k = 0; k < count; k++) {
    const double *q = path + k * s->n;
    double hard = 0.0, all = 0.0;
    scene_values(s, 1, q, times + k, start, now, least, s->here);
    for (int64_t p = 0; p < s->P; p++) {
      all = larger_or_nan(all, SMALLER(least[p], now[p] - ERROR) - s->here[p]);
      if (s->slack[p] != MOVING)
        hard = larger_or_nan(hard, SMALLER(HARD * least[p], now[p] - HARD_ERROR) - s->here[p]);
    }
    for (int64_t j = 0; j < s->n; j++) {
      double room = SMALLER(q[j] - lower[j], upper[j] - q[j]) + BEYOND;
      double before = SMALLER(0.0, SMALLER(start[j] - lower[j], upper[j] - start[j]));
      if (!(room >= 0.0)) hard = larger_or_nan(hard, before - room);
    }
    violations[2 * k] = hard;
    violations[2 * k + 1] = larger_or_nan(all, hard);
  }
}

/* Samples of a full stop and the waiting after it: so many that no pair which may come below its least distance goes
   farther from one to the next than a share of that, at its speed at first; but for the most that there may be. */
static int samples(const Scene *s, double delay, double longest, double span, const double *lag) {
  double most = 1.0;
  for (int64_t p = 0; p < s->P; p++) {
    double way = 0.0, fast = 0.0, passed = s->speed[p] * LARGER(span, delay + longest), began = 0.0;
    for (int64_t j = 0; j < s->n; j++) {
      way += s->bounds[j * s->P + p] * 0.5 * s->stop_v[j] * s->stop_v[j] / s->a_max[j];
      fast += s->bounds[j * s->P + p] * fabs(s->stop_v[j]);
      began += s->bounds[j * s->P + p] * (fabs(s->stop_q[j] - s->start[j]) + (lag ? fabs(lag[j]) : 0.0));
    }
    if (s->start_distances[p] - began - way - passed < s->least[p] + ERROR)
      most = larger_or_nan(most, (fast * longest + passed) / (SPACING * LARGER(s->least[p], ERROR)));
  }
  return most < MOST_SAMPLES ? (int)ceil(most) : MOST_SAMPLES;
}

/* Of the full stop from (q, v):  q_j(t) = q_j + v_j t - 1/2 sign(v_j) a_j t^2  until |v_j| / a_j, after a delay; and,
   where there are movers, of waiting until the span is over. A lag is added to all configurations once more. */
void stop_violation(Scene *s, double delay, double span, const double *lag) {
  const double *q = s->stop_q, *v = s->stop_v, *a_max = s->a_max;
  double path[2 * MOST_SAMPLES * MOST_COORDINATES], times[2 * MOST_SAMPLES], found[4 * MOST_SAMPLES], longest = 0.0;
  int64_t n = s->n;
  int moving = 0;
  for (int64_t p = 0; p < s->P; p++) moving |= s->speed[p] > 0.0;
  for (int64_t j = 0; j < n; j++) longest = larger_or_nan(longest, fabs(v[j]) / a_max[j]);
  int stop = samples(s, delay, longest, span, lag), count = stop;
  for (int k = 0; k < stop; k++) {
    double time = longest * (k + 1) / stop;
    times[k] = delay + time;
    for (int64_t j = 0; j < n; j++) {
      double braking = SMALLER(time, fabs(v[j]) / a_max[j]), half = 0.5 * a_max[j] * braking * braking;
      path[k * n + j] = q[j] + v[j] * braking - (v[j] > 0.0 ? half : v[j] < 0.0 ? -half : 0.0);
    }
  }
  double rest = times[stop - 1], left = span - rest;
  if (moving && left > 0.0) {
    for (int k = 0; k < stop; k++) {
      memcpy(path + (stop + k) * n, path + (stop - 1) * n, n * sizeof(double));
      times[stop + k] = rest + left * (k + 1) / stop;
    }
    count = 2 * stop;
  }
  s->violation[0] = s->violation[1] = 0.0;
  for (int lagging = 0; lagging <= (lag ? 1 : 0); lagging++) {
    for (int64_t i = 0; lagging && i < count * n; i++) path[i] += lag[i % n];
    path_violations(s, count, path, times, found);
    for (int64_t i = 0; i < 2 * count; i++) s->violation[i % 2] = larger_or_nan(s->violation[i % 2], found[i]);
  }
}
