/* Motions of a double integrator, and the variables s of local support in which their cost is banded:

       u_k = s_k - 2 s_{k-1} + s_{k-2},   v_k = dt (s_k - s_{k-1}),   q_k = dt^2/2 (s_k + s_{k-1})

   for the changes after stage k; s = 0 before the first. Those of stage k begin at (k - 2) n. */
#include "core.h"
#include "vector.h"

/* q_k = q_{k-1} + dt/2 (v_{k-1} + v_k),  v_k = v_{k-1} + dt u_k, (N + 1, n) each. */
void roll_out(const Core *c, const double *u, double *q, double *v) {
  int64_t n = c->n;
  memcpy(q, c->q, n * sizeof(double));
  memcpy(v, c->v, n * sizeof(double));
  for (int64_t i = 0; i < c->N * n; i++) {
    v[n + i] = v[i] + c->dt * u[i];
    q[n + i] = q[i] + 0.5 * c->dt * (v[i] + v[n + i]);
  }
}

/* A row of (q, v, u) of a stage, (3 n), as a row of its variables (s_{k-2}, s_{k-1}, s_k). */
void to_variables(const Core *c, const double *row, double *out) {
  int64_t n = c->n;
  double half = 0.5 * c->dt * c->dt;
  for (int64_t j = 0; j < n; j++) {
    double q = half * row[j], v = c->dt * row[n + j], u = row[2 * n + j];
    out[j] = u;
    out[n + j] = q - v - 2.0 * u;
    out[2 * n + j] = q + v + u;
  }
}

/* Changes of (q, v, u) after every stage, (N, 3, n), of variables s, (N n). */
void to_motion(const Core *c, const double *s, double *motion) {
  int64_t n = c->n;
  double half = 0.5 * c->dt * c->dt;
  for (int64_t k = 0; k < c->N; k++)
    for (int64_t j = 0; j < n; j++) {
      double now = s[k * n + j];
      double before = k > 0 ? s[(k - 1) * n + j] : 0.0, earlier = k > 1 ? s[(k - 2) * n + j] : 0.0;
      double *out = motion + 3 * k * n + j;
      out[0] = half * (now + before);
      out[n] = c->dt * (now - before);
      out[2 * n] = now - 2.0 * before + earlier;
    }
}

/* The configurations at which distances are kept: now, after every stage, and of the stop at full deceleration
   from the last node, q_N + c v_N |v_N| / a_max, with c = 3/8 half way in time and c = 1/2 at rest. */
void nodes_of(Core *c, const double *q, const double *v) {
  static const double SHARES[2] = {0.375, 0.5};
  int64_t n = c->n, N = c->N;
  const double *last_q = q + N * n, *last_v = v + N * n;
  double longest = 0.0;
  memcpy(c->nodes, q, (N + 1) * n * sizeof(double));
  for (int64_t k = 0; k <= N; k++) c->times[k] = c->dt * k;
  for (int64_t j = 0; j < n; j++) {
    double stop = fabs(last_v[j]) / c->a_max[j];
    longest = LARGER(longest, stop);
    for (int i = 0; i < 2; i++) {
      c->gains[i * n + j] = 2.0 * SHARES[i] * stop;
      c->nodes[(N + 1 + i) * n + j] = last_q[j] + SHARES[i] * stop * last_v[j];
    }
  }
  for (int i = 0; i < 2; i++) c->times[N + 1 + i] = c->times[N] + 0.5 * longest * (i + 1);
}

/* How far q and v of every stage can rise and fall from a guess while |u| <= a_max, (N, 2, 2, n). */
void reach_of(Core *c, const double *u) {
  int64_t n = c->n;
  for (int64_t k = 0; k < c->N; k++) {
    double *now = c->rises + 4 * k * n;
    const double *before = k ? now - 4 * n : 0;
    for (int64_t j = 0; j < n; j++)
      for (int side = 0; side < 2; side++) {
        double room = c->a_max[j] + (side ? u[k * n + j] : -u[k * n + j]);
        double v = before ? before[(2 + side) * n + j] : 0.0, q = before ? before[side * n + j] : 0.0;
        double after = v + c->dt * LARGER(room, 0.0);
        now[(2 + side) * n + j] = after;
        now[side * n + j] = q + 0.5 * c->dt * (v + after);
      }
  }
}
