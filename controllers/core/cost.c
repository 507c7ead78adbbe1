/* The Gauss-Newton cost  1/2 sum_k |r(z_k) - ref_k|^2_W_k  of z = (q, v, u) after every stage: value, gradient and
   Hessian in the variables of motion.c. Rows with a constant Jacobian give a Hessian that the weights alone make. */
#include "core.h"
#include "vector.h"

static double affine_error(const Core *c, int64_t k, int64_t row) {
  const double *z = c->z + 3 * k * c->n;
  double error = c->offset[row] - c->reference[k * c->R + c->affine[row]];
  for (int64_t e = c->begins[row]; e < c->begins[row + 1]; e++) error += c->entries[e] * z[c->columns[e]];
  return error;
}

/* Add weight g g' of a row g of stage k's variables to the band, and weight error g to the slope. */
WIDE static void add_row(const Core *c, int64_t k, const double *g, double weight, double error, double *slope,
                         double *band) {
  int64_t width = c->B, start = (k - 2) * c->n;
  for (int64_t a = LARGER(0, -start); a < width; a++) {
    double share = weight * g[a];
    if (share == 0.0) continue;
    if (slope) slope[start + a] += share * error;
    add(band + (start + a) * width, share, g + a, width - a);
  }
}

/* The part of the Hessian that the weights alone make. */
void constant_hessian(Core *c) {
  double row[3 * MOST_COORDINATES], g[3 * MOST_COORDINATES];
  memset(c->constant, 0, c->M * c->B * sizeof(double));
  for (int64_t k = 0; k < c->N; k++)
    for (int64_t r = 0; r < c->A; r++) {
      double weight = c->weights[k * c->R + c->affine[r]];
      if (!(weight > 0.0)) continue;
      memset(row, 0, c->B * sizeof(double));
      for (int64_t e = c->begins[r]; e < c->begins[r + 1]; e++) row[c->columns[e]] = c->entries[e];
      to_variables(c, row, g);
      add_row(c, k, g, weight, 0.0, 0, c->constant);
    }
}

static void take(Core *c, const double *q, const double *v, const double *u) {
  int64_t n = c->n;
  for (int64_t k = 0; k < c->N; k++) {
    double *z = c->z + 3 * k * n;
    memcpy(z, q + (k + 1) * n, n * sizeof(double));
    memcpy(z + n, v + (k + 1) * n, n * sizeof(double));
    memcpy(z + 2 * n, u + k * n, n * sizeof(double));
  }
}

static double curved_error(const Core *c, int64_t k, int64_t row) {
  return c->values[k * c->C + row] - c->reference[k * c->R + c->curved[row]];
}

/* Return the cost of a motion; write its slope and Hessian. */
double expand(Core *c, const double *q, const double *v, const double *u) {
  double total = 0.0, by_motion[3 * MOST_COORDINATES], g[3 * MOST_COORDINATES];
  take(c, q, v, u);
  c->evaluate();
  memcpy(c->band, c->constant, c->M * c->B * sizeof(double));
  memset(c->slope, 0, c->M * sizeof(double));
  for (int64_t k = 0; k < c->N; k++) {
    memset(by_motion, 0, c->B * sizeof(double));
    for (int64_t r = 0; r < c->A; r++) {
      double weight = c->weights[k * c->R + c->affine[r]];
      if (!(weight > 0.0)) continue;
      double error = affine_error(c, k, r);
      total += weight * error * error;
      for (int64_t e = c->begins[r]; e < c->begins[r + 1]; e++)
        by_motion[c->columns[e]] += weight * error * c->entries[e];
    }
    to_variables(c, by_motion, g);
    int64_t start = (k - 2) * c->n;
    for (int64_t a = LARGER(0, -start); a < c->B; a++) c->slope[start + a] += g[a];
    for (int64_t r = 0; r < c->C; r++) {
      double weight = c->weights[k * c->R + c->curved[r]];
      if (!(weight > 0.0)) continue;
      double error = curved_error(c, k, r);
      total += weight * error * error;
      const double *jacobian = c->jacobians + k * c->B * c->C;
      for (int64_t a = 0; a < c->B; a++) by_motion[a] = jacobian[a * c->C + r];
      to_variables(c, by_motion, g);
      add_row(c, k, g, weight, error, c->slope, c->band);
    }
  }
  return 0.5 * total;
}

/* Return the cost of a motion alone. */
double cost_of(Core *c, const double *q, const double *v, const double *u) {
  double total = 0.0;
  take(c, q, v, u);
  c->evaluate_values();
  for (int64_t k = 0; k < c->N; k++) {
    for (int64_t r = 0; r < c->A; r++) {
      double weight = c->weights[k * c->R + c->affine[r]], error = weight > 0.0 ? affine_error(c, k, r) : 0.0;
      total += weight > 0.0 ? weight * error * error : 0.0;
    }
    for (int64_t r = 0; r < c->C; r++) {
      double weight = c->weights[k * c->R + c->curved[r]], error = weight > 0.0 ? curved_error(c, k, r) : 0.0;
      total += weight > 0.0 ? weight * error * error : 0.0;
    }
  }
  return 0.5 * total;
}
