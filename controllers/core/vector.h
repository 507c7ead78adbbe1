/* Small vectors and matrices, row by row; all inline. */
#ifndef HANDRAIL_VECTOR_H
#define HANDRAIL_VECTOR_H
#include <math.h>
#include <stdint.h>
#include <string.h>

/* A function that is also compiled for wider vector registers, where compiler and system choose between the two when
   the library is loaded; its sums are the same. */
#if defined(__x86_64__) && defined(__GLIBC__) && defined(__GNUC__) && !defined(__clang__)
#define WIDE __attribute__((target_clones("avx2", "default")))
#else
#define WIDE
#endif

#define SMALLER(a, b) ((a) < (b) ? (a) : (b))
#define LARGER(a, b) ((a) > (b) ? (a) : (b))

static inline double clamp(double x, double low, double high) {
  return x < low ? low : (x > high ? high : x);
}

/* The larger; NaN where one is: a fault does not pass for safe. */
static inline double larger_or_nan(double a, double b) {
  return a > b || a != a ? a : b;
}

static inline double dot3(const double *a, const double *b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static inline void cross(const double *a, const double *b, double *out) {
  out[0] = a[1] * b[2] - a[2] * b[1];
  out[1] = a[2] * b[0] - a[0] * b[2];
  out[2] = a[0] * b[1] - a[1] * b[0];
}

/* out = a + t b */
static inline void along3(const double *a, double t, const double *b, double *out) {
  for (int i = 0; i < 3; i++) out[i] = a[i] + t * b[i];
}

/* out = R x, and out = R' x */
static inline void rotate(const double *R, const double *x, double *out) {
  for (int i = 0; i < 3; i++) out[i] = dot3(R + 3 * i, x);
}

static inline void rotate_back(const double *R, const double *x, double *out) {
  for (int i = 0; i < 3; i++) out[i] = R[i] * x[0] + R[3 + i] * x[1] + R[6 + i] * x[2];
}

/* out = A B */
static inline void multiply(const double *A, const double *B, double *out) {
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++)
      out[3 * i + j] = A[3 * i] * B[j] + A[3 * i + 1] * B[3 + j] + A[3 * i + 2] * B[6 + j];
}

/* Four sums side by side, which the compiler keeps in vector registers. */
static inline double dot(const double *a, const double *b, int64_t size) {
  double sums[4] = {0, 0, 0, 0};
  int64_t i = 0;
  for (; i + 4 <= size; i += 4)
    for (int lane = 0; lane < 4; lane++) sums[lane] += a[i + lane] * b[i + lane];
  for (; i < size; i++) sums[0] += a[i] * b[i];
  return (sums[0] + sums[1]) + (sums[2] + sums[3]);
}

/* y += t x */
static inline void add(double *restrict y, double t, const double *restrict x, int64_t size) {
  for (int64_t i = 0; i < size; i++) y[i] += t * x[i];
}

#endif
