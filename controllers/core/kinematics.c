/* Inverse kinematics: damped Gauss-Newton, dq = sat(J' (J J' + lambda I)^-1 e), joints inside their range. */
#include "core.h"
#include "vector.h"

#define DAMPING 1e-4
#define LARGEST_STEP 0.1 /* [rad] */
#define STEPS 100        /* those that succeed take up to 80 */

/* Write e = (p_goal - p, log(R_goal R')) of the tool, a scene's first shape; return its largest entry. */
static double error_of(const Scene *s, const double *rotation, const double *position, double *tool, double *e) {
  const double *R = s->world_rotation + 9 * s->carrier[0], *p = s->world_position + 3 * s->carrier[0];
  double here[9], turn[9], quaternion[4], largest = 0.0;
  multiply(R, s->shape_rotation, here);
  rotate(R, s->shape_position, tool);
  along3(p, 1.0, tool, tool);
  along3(position, -1.0, tool, e);
  for (int i = 0; i < 3; i++)
    for (int k = 0; k < 3; k++) turn[3 * i + k] = dot3(rotation + 3 * i, here + 3 * k);
  nearest_quaternion(turn, quaternion);
  vector_of(quaternion, e + 3);
  for (int i = 0; i < 6; i++) largest = larger_or_nan(fabs(e[i]), largest);
  return largest;
}

/* Solve A x = b in place by Cholesky, (6, 6); the lower half of A is read. */
static void solve6(double *A, double *b) {
  for (int i = 0; i < 6; i++) {
    for (int k = 0; k < i; k++) b[i] -= A[6 * i + k] * b[k];
    A[7 * i] = sqrt(A[7 * i]);
    b[i] /= A[7 * i];
    for (int j = i + 1; j < 6; j++) A[6 * j + i] /= A[7 * i];
    for (int j = i + 1; j < 6; j++)
      for (int k = i + 1; k <= j; k++) A[6 * j + k] -= A[6 * j + i] * A[6 * k + i];
  }
  for (int i = 5; i >= 0; i--) {
    for (int k = i + 1; k < 6; k++) b[i] -= A[6 * k + i] * b[k];
    b[i] /= A[7 * i];
  }
}

/* Bring the tool to a pose by the coordinates from the first on; return the largest error that is left. */
double bring_tool(Scene *s, const double *rotation, const double *position, int64_t first, double tolerance,
                  double *q) {
  double columns[6 * MOST_COORDINATES];
  for (int step = 0;; step++) {
    double tool[3], e[6], A[36] = {0};
    place_joints(s, q);
    double largest = error_of(s, rotation, position, tool, e);
    if (largest < tolerance || step == STEPS) return largest;
    for (int i = 0; i < 6; i++) A[7 * i] = DAMPING;
    for (int64_t j = s->carrier[0]; j > first; j = s->parent[j - 1]) {
      double *column = columns + 6 * (j - 1), arm[3];
      const double *axis = s->axis + 3 * (j - 1);
      along3(tool, -1.0, s->world_position + 3 * j, arm);
      cross(axis, arm, column);
      for (int i = 0; i < 3; i++) column[i] = s->slides[j - 1] ? axis[i] : column[i];
      for (int i = 0; i < 3; i++) column[3 + i] = s->slides[j - 1] ? 0.0 : axis[i];
      for (int i = 0; i < 6; i++) add(A + 6 * i, column[i], column, 6);
    }
    solve6(A, e);
    for (int64_t j = s->carrier[0]; j > first; j = s->parent[j - 1]) {
      double way = clamp(dot(columns + 6 * (j - 1), e, 6), -LARGEST_STEP, LARGEST_STEP);
      q[j - 1] = clamp(q[j - 1] + way, s->lower[j - 1], s->upper[j - 1]);
    }
  }
}
