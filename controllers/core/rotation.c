/* Rotations as SciPy has them, bit for bit: for one matrix SciPy takes most of its time to check it. */
#include "core.h"
#include "vector.h"

#define ORTHOGONAL 1e-12

/* Whether the rows are orthonormal and right-handed. */
static int is_rotation(const double *R) {
  for (int i = 0; i < 3; i++)
    for (int j = 0; j <= i; j++)
      if (!(fabs(dot3(R + 3 * i, R + 3 * j) - (i == j)) <= ORTHOGONAL)) return 0;
  double third[3];
  cross(R, R + 3, third);
  return dot3(third, R + 6) > 0.0;
}

/* Write (x, y, z, w) of a matrix that is near to a rotation, by way of the largest entry (F. Markley 2008). */
void nearest_quaternion(const double *R, double *q) {
  double trace = R[0] + R[4] + R[8];
  int i = 0;
  for (int k = 1; k < 3; k++)
    if (R[4 * k] > R[4 * i]) i = k;
  if (trace > R[4 * i]) {
    q[0] = R[7] - R[5];
    q[1] = R[2] - R[6];
    q[2] = R[3] - R[1];
    q[3] = 1.0 + trace;
  } else {
    int j = (i + 1) % 3, k = (i + 2) % 3;
    q[i] = 1.0 - trace + 2.0 * R[4 * i];
    q[j] = R[3 * j + i] + R[3 * i + j];
    q[k] = R[3 * k + i] + R[3 * i + k];
    q[3] = R[3 * k + j] - R[3 * j + k];
  }
  double norm = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  for (int k = 0; k < 4; k++) q[k] /= norm;
}

/* The same; return 0 where it is no rotation. */
int64_t quaternion_of(const double *R, double *q) {
  if (!is_rotation(R)) return 0;
  nearest_quaternion(R, q);
  return 1;
}

/* The rotation vector of a unit quaternion (x, y, z, w), its angle at most pi. */
void vector_of(const double *q, double *out) {
  double sign = q[3] < 0.0 ? -1.0 : 1.0;
  double angle = 2.0 * atan2(sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2]), sign * q[3]);
  double square = angle * angle;
  double scale = angle <= 1e-3 ? 2.0 + square / 12.0 + 7.0 * square * square / 2880.0 : angle / sin(angle / 2.0);
  for (int i = 0; i < 3; i++) out[i] = sign * scale * q[i];
}

/* The rotation vector of a rotation; return 0 where it is none. */
int64_t rotation_vector_of(const double *R, double *out) {
  double q[4];
  if (!quaternion_of(R, q)) return 0;
  vector_of(q, out);
  return 1;
}
