/* Velocities that are linear between knots, (count, n), dt apart; the last is held. */
#include "core.h"
#include "vector.h"

/* A coordinate at a time in units of dt. */
static double at(const double *velocities, int64_t count, int64_t n, double knot, int64_t j) {
  const double *column = velocities + j;
  if (!(knot < (double)(count - 1))) return column[(count - 1) * n];
  int64_t index = (int64_t)LARGER(knot, 0.0);
  double weight = knot - (double)index;
  return (1.0 - weight) * column[index * n] + weight * column[(index + 1) * n];
}

/* At times in units of dt, (number,); (number, n). */
void interpolate(const double *velocities, int64_t count, int64_t n, const double *knots, int64_t number, double *out) {
  for (int64_t k = 0; k < number; k++)
    for (int64_t j = 0; j < n; j++) out[k * n + j] = at(velocities, count, n, knots[k], j);
}

/* Mean accelerations over stages of dt, the first of which begins at a time in units of dt, (stages, n). */
void mean_accelerations(const double *velocities, int64_t count, int64_t n, double first, double dt, int64_t stages,
                        double *out) {
  for (int64_t j = 0; j < n; j++) {
    double before = at(velocities, count, n, first, j);
    for (int64_t k = 0; k < stages; k++) {
      double after = at(velocities, count, n, first + (double)(k + 1), j);
      out[k * n + j] = (after - before) / dt;
      before = after;
    }
  }
}

/* Velocities of the fastest stop after every dt until it is over, (intervals, n), if there is room for so many. Return
   their number, one at least; -1 where the velocity is not finite. */
int64_t stop_velocities(const double *velocity, int64_t n, const double *a_max, double dt, int64_t room, double *out) {
  double longest = 0.0;
  for (int64_t j = 0; j < n; j++) longest = larger_or_nan(longest, fabs(velocity[j]) / a_max[j]);
  if (!(longest < 1e6 * dt)) return -1;
  int64_t intervals = LARGER(1, (int64_t)ceil(longest / dt));
  for (int64_t k = 0; intervals <= room && k < intervals; k++)
    for (int64_t j = 0; j < n; j++) {
      double left = LARGER(fabs(velocity[j]) - a_max[j] * (dt * (double)(k + 1)), 0.0);
      out[k * n + j] = velocity[j] < 0.0 ? -left : left;
    }
  return intervals;
}
