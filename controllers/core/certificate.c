/* How far a motion falls short of safety: below its least distance, beyond a joint's range, or, where one is beyond
   already, farther than now. Written as (of the hard limits alone, of all), [m, rad]; 0 where it is safe. */
#include "core.h"
#include "vector.h"

#define ERROR 1e-3      /* of signed distances, that is no loss [m] */
#define HARD_ERROR 1e-4 /* the same where a thing that stands is nearer than its hard limit [m] */
#define HARD 0.5        /* hard limit of the robot with itself and with what stands, as a share of the least */
#define BEYOND 0.01     /* of its range that a joint may come to rest [m, rad] */
#define SAMPLES 4       /* of a stop, and of the waiting after it */

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

/* Of the full stop from (q, v):  q_j(t) = q_j + v_j t - 1/2 sign(v_j) a_j t^2  until |v_j| / a_j, after a delay; and,
   where there are movers, of waiting until the span is over. A lag is added to all configurations once more. */
void stop_violation(Scene *s, double delay, double span, const double *lag) {
  const double *q = s->stop_q, *v = s->stop_v, *a_max = s->a_max;
  double path[2 * SAMPLES * MOST_COORDINATES], times[2 * SAMPLES], found[4 * SAMPLES], longest = 0.0;
  int64_t n = s->n, count = SAMPLES;
  int moving = 0;
  for (int64_t p = 0; p < s->P; p++) moving |= s->speed[p] > 0.0;
  for (int64_t j = 0; j < n; j++) longest = larger_or_nan(longest, fabs(v[j]) / a_max[j]);
  for (int k = 0; k < SAMPLES; k++) {
    double time = longest * (k + 1) / SAMPLES;
    times[k] = delay + time;
    for (int64_t j = 0; j < n; j++) {
      double braking = SMALLER(time, fabs(v[j]) / a_max[j]), half = 0.5 * a_max[j] * braking * braking;
      path[k * n + j] = q[j] + v[j] * braking - (v[j] > 0.0 ? half : v[j] < 0.0 ? -half : 0.0);
    }
  }
  double rest = times[SAMPLES - 1], left = span - rest;
  if (moving && left > 0.0) {
    for (int k = 0; k < SAMPLES; k++) {
      memcpy(path + (SAMPLES + k) * n, path + (SAMPLES - 1) * n, n * sizeof(double));
      times[SAMPLES + k] = rest + left * (k + 1) / SAMPLES;
    }
    count = 2 * SAMPLES;
  }
  s->violation[0] = s->violation[1] = 0.0;
  for (int lagging = 0; lagging <= (lag ? 1 : 0); lagging++) {
    for (int64_t i = 0; lagging && i < count * n; i++) path[i] += lag[i % n];
    path_violations(s, count, path, times, found);
    for (int64_t i = 0; i < 2 * count; i++) s->violation[i % 2] = larger_or_nan(s->violation[i % 2], found[i]);
  }
}
