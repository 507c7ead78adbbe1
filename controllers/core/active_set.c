/* A dual active-set method for the banded QP of one update.

       min 1/2 s'H s + g's + sum_i (r1 sigma_i + r2/2 sigma_i^2)   so that   c_p's - a_p sigma_i(p) <= b_p

   with H = L L' banded. In y = (L's, sqrt(r2) sigma) the objective is 1/2 |y + f|^2, so that the solution is the
   nearest point to -f within the rows m_p = (L^-1 c_p, -a_p / sqrt(r2)). Rows become active one by one, the most
   violated first, while all multipliers stay >= 0 (D. Goldfarb, A. Idnani 1983). The active rows are kept as
   M = T Q, T lower triangular, the rows of Q orthonormal: rows of neighbouring nodes are nearly parallel, and
   M M' would square that. Begun with the rows of the last update, it needs few changes.

   Work is counted in numbers touched, never by the clock. Where it ends, the answer is the nearest point within
   the rows that are active so far. */
#include "core.h"
#include "vector.h"

#define DEPENDENT 1e-12 /* squared sine to the active rows, below which a row is a combination of them */
#define CHANGES 10      /* for each variable: an answer that takes more is none */
#define CANCELLED 0.25  /* share of a row's square below which a second projection is worth while */
#define BAND 30         /* numbers touched for each variable and change besides the active rows */

/* H = L L' in place: band[j, i - j] = H[i, j], (M, B); return whether it is positive definite. */
WIDE int64_t factor(double *band, int64_t size, int64_t width) {
  for (int64_t j = 0; j < size; j++) {
    double *row = band + j * width;
    if (!(row[0] > 0.0)) return 0;
    double scale = 1.0 / sqrt(row[0]);
    for (int64_t t = 0; t < width; t++) row[t] *= scale;
    for (int64_t c = 1; c < SMALLER(width, size - j); c++)
      if (row[c] != 0.0) add(band + (j + c) * width, -row[c], row + c, width - c);
  }
  return 1;
}

/* x = L^-1 x from an entry on, before which it is 0. */
WIDE static void forward(const Core *c, double *x, int64_t start) {
  for (int64_t j = start; j < c->M; j++) {
    const double *row = c->band + j * c->B;
    x[j] /= row[0];
    if (x[j] != 0.0) add(x + j + 1, -x[j], row + 1, SMALLER(c->B, c->M - j) - 1);
  }
}

/* x = L'^-1 x. What does not need the last results is summed apart, so that it need not wait for them. */
WIDE static void backward(const Core *c, double *x) {
  for (int64_t j = c->M - 1; j >= 0; j--) {
    const double *row = c->band + j * c->B;
    int64_t width = SMALLER(c->B, c->M - j), near = SMALLER(width, 5);
    double sum = dot(row + near, x + j + near, width - near);
    for (int64_t t = near - 1; t > 0; t--) sum += row[t] * x[j + t];
    x[j] = (x[j] - sum) / row[0];
  }
}

static void solve_upper(const Core *c, int64_t count, double *x) { /* x = T'^-1 x */
  for (int64_t i = count - 1; i >= 0; i--) {
    x[i] /= c->triangle[i * c->V + i];
    add(x, -x[i], c->triangle + i * c->V, i);
  }
}

/* Split the new row into a combination of the active ones and what is normal to them; return its square. */
WIDE static double project(Core *c, int64_t count) {
  double whole = dot(c->fresh, c->fresh, c->V), before = whole, square;
  memcpy(c->normal, c->fresh, c->V * sizeof(double));
  memset(c->coordinates, 0, count * sizeof(double));
  for (;;) {
    int64_t i = 0;
    for (; i + 4 <= count; i += 4) {
      double shares[4];
      take_four(c->normal, c->directions + i * c->V, c->V, c->V, shares);
      for (int row = 0; row < 4; row++) c->coordinates[i + row] += shares[row];
    }
    for (; i < count; i++) {
      double share = dot(c->directions + i * c->V, c->normal, c->V);
      c->coordinates[i] += share;
      add(c->normal, -share, c->directions + i * c->V, c->V);
    }
    square = dot(c->normal, c->normal, c->V);
    if (!(square <= CANCELLED * before && square >= 1e-30 * whole)) break; /* also of NaN */
    before = square;
  }
  memcpy(c->shares, c->coordinates, count * sizeof(double));
  solve_upper(c, count, c->shares);
  return square;
}

static int64_t append(Core *c, int64_t count, int64_t place, double square, double right, double multiplier) {
  double length = sqrt(square);
  for (int64_t t = 0; t < c->V; t++) c->directions[count * c->V + t] = c->normal[t] / length;
  memcpy(c->triangle + count * c->V, c->coordinates, count * sizeof(double));
  c->triangle[count * c->V + count] = length;
  c->held[count] = place;
  c->is_held[place] = 1;
  c->right[count] = right;
  c->multipliers[count] = multiplier;
  return count + 1;
}

/* Make a row inactive; rotations make T triangular again. */
WIDE static int64_t drop(Core *c, int64_t count, int64_t index) {
  int64_t V = c->V;
  double *T = c->triangle;
  c->is_held[c->held[index]] = 0;
  for (int64_t i = index; i < count - 1; i++) {
    c->held[i] = c->held[i + 1];
    c->right[i] = c->right[i + 1];
    c->multipliers[i] = c->multipliers[i + 1];
    memcpy(T + i * V, T + (i + 1) * V, (i + 2) * sizeof(double));
  }
  for (int64_t i = index; i < count - 1; i++) {
    double length = hypot(T[i * V + i], T[i * V + i + 1]);
    double cosine = T[i * V + i] / length, sine = T[i * V + i + 1] / length;
    T[i * V + i] = length;
    for (int64_t below = i + 1; below < count - 1; below++) {
      double *row = T + below * V + i, left = row[0], right = row[1];
      row[0] = cosine * left + sine * right;
      row[1] = cosine * right - sine * left;
    }
    double *restrict one = c->directions + i * V, *restrict other = c->directions + (i + 1) * V;
    for (int64_t t = 0; t < V; t++) {
      double left = one[t], right = other[t];
      one[t] = cosine * left + sine * right;
      other[t] = cosine * right - sine * left;
    }
  }
  return count - 1;
}

/* The nearest point to -f at which all active rows hold: y = -f + Q'w with T w = b + M f, multipliers -T'^-1 w. */
WIDE static void settle(Core *c, int64_t count) {
  int64_t V = c->V;
  for (int64_t i = 0; i < count; i++)
    c->shares[i] = (c->right[i] - dot(c->triangle + i * V, c->shares, i)) / c->triangle[i * V + i];
  for (int64_t t = 0; t < V; t++) c->y[t] = -c->free_point[t];
  for (int64_t i = 0; i < count; i++) {
    c->multipliers[i] = -c->shares[i];
    add(c->y, c->shares[i], c->directions + i * V, V);
  }
  solve_upper(c, count, c->multipliers);
}

/* Write m_p of a row; return its right-hand side. */
static double transform(Core *c, const Scene *scene, int64_t place) {
  int64_t first;
  double right = write_row(c, scene, place, c->fresh, &first), root = sqrt(c->quadratic);
  forward(c, c->fresh, first);
  for (int64_t i = c->M; i < c->V; i++) c->fresh[i] /= root;
  return right;
}

static int independent(const Core *c, double square) {
  return square > DEPENDENT * dot(c->fresh, c->fresh, c->V);
}

/* Make rows active, less those with a negative multiplier; write y; return their number. */
static int64_t begin(Core *c, const Scene *scene, const int64_t *places, int64_t number) {
  int64_t count = 0;
  for (int64_t i = 0; i < number; i++) {
    double right = transform(c, scene, places[i]) + dot(c->fresh, c->free_point, c->V), square = project(c, count);
    if (independent(c, square)) count = append(c, count, places[i], square, right, 0.0);
  }
  for (;;) {
    int64_t worst = -1;
    settle(c, count);
    for (int64_t i = 0; i < count; i++)
      if (c->multipliers[i] < (worst >= 0 ? c->multipliers[worst] : 0.0)) worst = i;
    if (worst < 0) return count;
    count = drop(c, count, worst);
  }
}

/* Make a violated row active; return the new number of active rows, -1 where there is no answer. */
static int64_t enter(Core *c, const Scene *scene, int64_t count, int64_t place) {
  double right = transform(c, scene, place), multiplier = 0.0;
  for (;;) {
    c->changes++;
    c->work -= (double)c->V * (count + BAND);
    double square = project(c, count), step = INFINITY;
    int64_t blocking = -1;
    int moves = independent(c, square);
    if (moves) step = LARGER(dot(c->fresh, c->y, c->V) - right, 0.0) / square;
    for (int64_t i = 0; i < count; i++)
      if (c->shares[i] > 0.0 && c->multipliers[i] < step * c->shares[i])
        step = LARGER(c->multipliers[i], 0.0) / c->shares[i], blocking = i;
    if (step == INFINITY || c->changes > CHANGES * c->M) return -1;
    add(c->multipliers, -step, c->shares, count);
    multiplier += step;
    if (moves) add(c->y, -step, c->normal, c->V);
    if (blocking < 0)
      return append(c, count, place, square, right + dot(c->fresh, c->free_point, c->V), multiplier);
    count = drop(c, count, blocking);
  }
}

/* Solve with rows to begin with; return the number of active rows, -1 where there is no answer. */
static int64_t solve_from(Core *c, const Scene *scene, const int64_t *places, int64_t number) {
  double root = sqrt(c->quadratic);
  memset(c->is_held, 0, (SLACKS + 6 * c->M + c->count) * sizeof(int64_t));
  c->changes = 0;
  int64_t settled = 0, count = begin(c, scene, places, number);
  c->work -= number * c->V * (0.5 * number + BAND);
  for (;;) {
    memcpy(c->s, c->y, c->M * sizeof(double));
    backward(c, c->s);
    for (int i = 0; i < SLACKS; i++) c->slacks[i] = c->y[c->M + i] / root;
    to_motion(c, c->s, c->motion);
    int64_t place = most_violated(c, scene);
    if (c->work <= 0.0) return count;
    if (place < 0) {
      if (settled == c->changes) return count;
      settled = c->changes; /* once more, without the rounding errors of the changes */
      settle(c, count);
    } else if ((count = enter(c, scene, count, place)) < 0) {
      return -1;
    }
  }
}

/* Solve the QP, H in the band, which its factor replaces; return whether there is an answer. */
int64_t solve_program(Core *c, const Scene *scene) {
  static const int64_t AT_REST[SLACKS] = {OWN, STANDING, MOVING, LIMITS};
  int64_t count = -1, warm = 0;
  memset(c->slacks, 0, SLACKS * sizeof(double));
  c->descent = 0.0;
  if (!factor(c->band, c->M, c->B)) return 0;
  memcpy(c->free_point, c->slope, c->M * sizeof(double));
  forward(c, c->free_point, 0);
  for (int64_t i = c->M; i < c->V; i++) c->free_point[i] = c->linear / sqrt(c->quadratic);
  for (int64_t i = 0; i < c->active_rows; i++) {
    int64_t place = place_of(c, c->active[i]);
    if (place >= 0) c->active[warm++] = place;
  }
  count = solve_from(c, scene, c->active, warm);
  if (count < 0) count = solve_from(c, scene, AT_REST, SLACKS);
  c->active_rows = count < 0 ? 0 : count;
  for (int64_t i = 0; i < count; i++) c->active[i] = number_at(c, c->held[i]);
  c->descent = dot(c->slope, c->s, c->M) + 0.5 * dot(c->y, c->y, c->M);
  return count >= 0;
}
