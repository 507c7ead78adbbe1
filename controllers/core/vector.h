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

/* Four numbers side by side, anywhere in memory, as gcc and clang know them. */
typedef double Four __attribute__((vector_size(32), aligned(8), may_alias));

static inline double sum_of(Four x) { return (x[0] + x[1]) + (x[2] + x[3]); }

/* Two times four sums side by side, which do not wait for each other. */
static inline double dot(const double *a, const double *b, int64_t size) {
  Four even = {0, 0, 0, 0}, odd = {0, 0, 0, 0};
  int64_t i = 0;
  for (; i + 8 <= size; i += 8) {
    even += *(const Four *)(a + i) * *(const Four *)(b + i);
    odd += *(const Four *)(a + i + 4) * *(const Four *)(b + i + 4);
  }
  if (i + 4 <= size) even += *(const Four *)(a + i) * *(const Four *)(b + i), i += 4;
  double rest = 0.0;
  for (; i < size; i++) rest += a[i] * b[i];
  return sum_of(even + odd) + rest;
}

/* x -= sum of shares_i a_i, shares_i = a_i'x, of four rows, orthonormal: they need not wait for each other. */
static inline void take_four(double *restrict x, const double *restrict a, int64_t stride, int64_t size,
                             double *restrict shares) {
  const double *b = a + stride, *c = b + stride, *d = c + stride;
  Four sums[4] = {{0, 0, 0, 0}, {0, 0, 0, 0}, {0, 0, 0, 0}, {0, 0, 0, 0}};
  int64_t t = 0;
  for (; t + 4 <= size; t += 4) {
    Four now = *(Four *)(x + t);
    sums[0] += *(const Four *)(a + t) * now;
    sums[1] += *(const Four *)(b + t) * now;
    sums[2] += *(const Four *)(c + t) * now;
    sums[3] += *(const Four *)(d + t) * now;
  }
  for (int i = 0; i < 4; i++) {
    for (int64_t rest = t; rest < size; rest++) sums[i][0] += a[i * stride + rest] * x[rest];
    shares[i] = sum_of(sums[i]);
  }
  for (t = 0; t < size; t++)
    x[t] -= (shares[0] * a[t] + shares[1] * b[t]) + (shares[2] * c[t] + shares[3] * d[t]);
}

/* y += t x */
static inline void add(double *restrict y, double t, const double *restrict x, int64_t size) {
  for (int64_t i = 0; i < size; i++) y[i] += t * x[i];
}

#endif
