/* Nearest points of two convex shapes: closed forms for segments, boxes and the floor, else GJK.

   A sphere is a point with a radius, a capsule a segment with a radius: nearest points of the cores come first,
   the radii are added along the normal. */
#include "shapes.h"

#define MEET 1e-9        /* [m] below which cores meet: the normal is lost */
#define PARALLEL 1e-12
#define ITERATIONS 100   /* of GJK; polytopes need fewer than 20 */
#define CONVERGED 1e-12  /* relative gap of GJK's squared distance */

static double radius_of(const Shape *s) { return s->kind <= CAPSULE ? s->size[0] : 0.0; }

static double half_of(const Shape *s) { return s->kind == CAPSULE ? s->size[1] : 0.0; }

static void long_axis(const Shape *s, double *z) {
  for (int i = 0; i < 3; i++) z[i] = s->rotation[3 * i + 2];
}

/* Segments p + s z, |s| <= h: nearest points a and b (V. Lumelsky 1985). */
static void segment_segment(const double *p1, const double *z1, double h1, const double *p2, const double *z2,
                            double h2, double *a, double *b) {
  double r[3];
  along3(p1, -1.0, p2, r);
  double f = dot3(z2, r), c = dot3(z1, r), k = dot3(z1, z2), left = 1.0 - k * k;
  double s = left > PARALLEL ? clamp((k * f - c) / left, -h1, h1) : 0.0;
  double t = k * s + f;
  if (t > h2 || t < -h2) {
    t = clamp(t, -h2, h2);
    s = clamp(k * t - c, -h1, h1);
  }
  along3(p1, s, z1, a);
  along3(p2, t, z2, b);
}

/* Half the derivative by s of the squared distance from c + s z to a box of half sizes H. */
static double slope(const double *c, const double *z, const double *H, double s) {
  double total = 0.0;
  for (int i = 0; i < 3; i++) {
    double p = c[i] + s * z[i];
    total += z[i] * (p - clamp(p, -H[i], H[i]));
  }
  return total;
}

/* Segment c + s z, |s| <= h, and a box of half sizes H at the origin: nearest points a and b.
   The squared distance is convex and piecewise quadratic in s; its pieces end where the line meets faces. */
static void segment_box(const double *c, const double *z, double h, const double *H, double *a, double *b) {
  double low = -h, high = h, s = low, at_low = slope(c, z, H, low);
  if (at_low < 0.0 && h > 0.0) {
    double at_high = slope(c, z, H, high);
    if (at_high <= 0.0) {
      s = high;
    } else {
      for (int i = 0; i < 3; i++) {
        if (fabs(z[i]) < PARALLEL) continue;
        for (int side = -1; side <= 1; side += 2) {
          double t = (side * H[i] - c[i]) / z[i];
          if (t <= low || t >= high) continue;
          double there = slope(c, z, H, t);
          if (there < 0.0) {
            low = t;
            at_low = there;
          } else {
            high = t;
            at_high = there;
          }
        }
      }
      s = at_high > at_low ? low - at_low * (high - low) / (at_high - at_low) : 0.5 * (low + high);
    }
  }
  for (int i = 0; i < 3; i++) {
    a[i] = c[i] + s * z[i];
    b[i] = clamp(a[i], -H[i], H[i]);
  }
}

/* The farthest point of a shape's core in a direction. */
static void support(const Shape *s, const double *direction, double *out) {
  double d[3], local[3] = {0, 0, 0};
  rotate_back(s->rotation, direction, d);
  if (s->kind == BOX) {
    for (int i = 0; i < 3; i++) local[i] = d[i] < 0.0 ? -s->size[i] : s->size[i];
  } else if (s->kind == CAPSULE) {
    local[2] = d[2] < 0.0 ? -s->size[1] : s->size[1];
  } else if (s->kind == CYLINDER) {
    double aside = hypot(d[0], d[1]);
    if (aside > 0.0) {
      local[0] = s->size[0] * d[0] / aside;
      local[1] = s->size[0] * d[1] / aside;
    }
    local[2] = d[2] < 0.0 ? -s->size[1] : s->size[1];
  }
  rotate(s->rotation, local, out);
  for (int i = 0; i < 3; i++) out[i] += s->position[i];
}

/* A corner of the difference of two shapes, and the points that it is the difference of. */
typedef struct {
  double w[3], a[3], b[3];
} Corner;

/* Weights of the point nearest to the origin: of a segment, a triangle (C. Ericson 2005), a tetrahedron. */
static void weigh_segment(const Corner *c, double *weight) {
  double way[3];
  along3(c[1].w, -1.0, c[0].w, way);
  double square = dot3(way, way);
  double t = square > 0.0 ? clamp(-dot3(c[0].w, way) / square, 0.0, 1.0) : 0.0;
  weight[0] = 1.0 - t;
  weight[1] = t;
}

static void weigh_triangle(const Corner *c, double *weight) {
  double ab[3], ac[3];
  along3(c[1].w, -1.0, c[0].w, ab);
  along3(c[2].w, -1.0, c[0].w, ac);
  double d1 = -dot3(ab, c[0].w), d2 = -dot3(ac, c[0].w);
  double d3 = -dot3(ab, c[1].w), d4 = -dot3(ac, c[1].w);
  double d5 = -dot3(ab, c[2].w), d6 = -dot3(ac, c[2].w);
  double vc = d1 * d4 - d3 * d2, vb = d5 * d2 - d1 * d6, va = d3 * d6 - d5 * d4;
  weight[0] = weight[1] = weight[2] = 0.0;
  if (d1 <= 0.0 && d2 <= 0.0) {
    weight[0] = 1.0;
  } else if (d3 >= 0.0 && d4 <= d3) {
    weight[1] = 1.0;
  } else if (vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0) {
    weight[1] = d1 / (d1 - d3);
    weight[0] = 1.0 - weight[1];
  } else if (d6 >= 0.0 && d5 <= d6) {
    weight[2] = 1.0;
  } else if (vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0) {
    weight[2] = d2 / (d2 - d6);
    weight[0] = 1.0 - weight[2];
  } else if (va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0) {
    weight[2] = (d4 - d3) / ((d4 - d3) + (d5 - d6));
    weight[1] = 1.0 - weight[2];
  } else {
    double total = va + vb + vc;
    weight[1] = vb / total;
    weight[2] = vc / total;
    weight[0] = 1.0 - weight[1] - weight[2];
  }
}

static void point_of(const Corner *c, const double *weight, int count, double *out) {
  out[0] = out[1] = out[2] = 0.0;
  for (int i = 0; i < count; i++) along3(out, weight[i], c[i].w, out);
}

/* Return whether the origin is inside of the tetrahedron; else weigh its nearest face. */
static int weigh_tetrahedron(const Corner *c, double *weight) {
  static const int FACES[4][4] = {{0, 1, 2, 3}, {0, 2, 3, 1}, {0, 3, 1, 2}, {1, 3, 2, 0}};
  double best = INFINITY;
  int inside = 1;
  for (int face = 0; face < 4; face++) {
    const int *f = FACES[face];
    double ab[3], ac[3], ad[3], normal[3];
    along3(c[f[1]].w, -1.0, c[f[0]].w, ab);
    along3(c[f[2]].w, -1.0, c[f[0]].w, ac);
    along3(c[f[3]].w, -1.0, c[f[0]].w, ad);
    cross(ab, ac, normal);
    double inner = dot3(normal, ad), outer = -dot3(normal, c[f[0]].w);
    if (inner * outer > 0.0 && fabs(inner) > 0.0) continue; /* the origin is on the inner side of this face */
    inside = 0;
    Corner three[3] = {c[f[0]], c[f[1]], c[f[2]]};
    double of_face[3], point[3];
    weigh_triangle(three, of_face);
    point_of(three, of_face, 3, point);
    double square = dot3(point, point);
    if (square < best) {
      best = square;
      memset(weight, 0, 4 * sizeof(double));
      for (int i = 0; i < 3; i++) weight[f[i]] = of_face[i];
    }
  }
  return inside;
}

/* E. Gilbert, D. Johnson, S. Keerthi 1988: nearest points a and b of two cores; 1 where they meet. */
static int gjk(const Shape *first, const Shape *second, double *a, double *b) {
  Corner corners[4];
  double v[3], weight[4] = {1, 0, 0, 0};
  int count = 0;
  along3(first->position, -1.0, second->position, v);
  if (dot3(v, v) < MEET * MEET) v[0] = 1.0;
  for (int round = 0; round < ITERATIONS; round++) {
    double away[3] = {-v[0], -v[1], -v[2]};
    Corner *next = corners + count;
    support(first, away, next->a);
    support(second, v, next->b);
    along3(next->a, -1.0, next->b, next->w);
    double square = dot3(v, v);
    if (count && square - dot3(v, next->w) <= CONVERGED * square) break;
    count++;
    if (count == 1) weight[0] = 1.0;
    if (count == 2) weigh_segment(corners, weight);
    if (count == 3) weigh_triangle(corners, weight);
    if (count == 4 && weigh_tetrahedron(corners, weight)) return 1;
    int kept = 0;
    for (int i = 0; i < count; i++)
      if (weight[i] > 0.0) {
        corners[kept] = corners[i];
        weight[kept++] = weight[i];
      }
    count = kept;
    point_of(corners, weight, count, v);
    double now = dot3(v, v);
    if (now < MEET * MEET) return 1;
    if (round && !(now < square)) break; /* rounding of a flat tetrahedron: the points before are nearer */
    memset(a, 0, 3 * sizeof(double));
    memset(b, 0, 3 * sizeof(double));
    for (int i = 0; i < count; i++) {
      along3(a, weight[i], corners[i].a, a);
      along3(b, weight[i], corners[i].b, b);
    }
  }
  return 0;
}

/* A shape over the floor z = 0: its lowest point and the point below. */
static void over_floor(const Shape *s, double *witness) {
  static const double DOWN[3] = {0, 0, -1};
  double *low = witness + 3, *below = witness + 6;
  memcpy(witness, DOWN, sizeof DOWN);
  support(s, DOWN, low);
  low[2] -= radius_of(s);
  memcpy(below, low, 3 * sizeof(double));
  below[2] = 0.0;
}

/* Nearest points of the cores; 1 where they meet. The kinds are in order. */
static int cores(const Shape *first, const Shape *second, double *a, double *b) {
  double z[3];
  if (second->kind <= CAPSULE) {
    double other[3];
    long_axis(first, z);
    long_axis(second, other);
    segment_segment(first->position, z, half_of(first), second->position, other, half_of(second), a, b);
    return 0;
  }
  if (second->kind == BOX && first->kind <= CAPSULE) {
    double way[3], centre[3], direction[3], on_segment[3], on_box[3];
    long_axis(first, z);
    along3(first->position, -1.0, second->position, way);
    rotate_back(second->rotation, way, centre);
    rotate_back(second->rotation, z, direction);
    segment_box(centre, direction, half_of(first), second->size, on_segment, on_box);
    rotate(second->rotation, on_segment, a);
    rotate(second->rotation, on_box, b);
    along3(a, 1.0, second->position, a);
    along3(b, 1.0, second->position, b);
    return 0;
  }
  return gjk(first, second, a, b);
}

int nearest(const Shape *first, const Shape *second, double *witness) {
  int swapped = first->kind > second->kind;
  const Shape *one = swapped ? second : first, *other = swapped ? first : second;
  double found[9], *n = found, *a = found + 3, *b = found + 6;
  if (other->kind == FLOOR) {
    over_floor(one, found);
  } else {
    if (cores(one, other, a, b)) return 1;
    along3(b, -1.0, a, n);
    double length = sqrt(dot3(n, n));
    if (!(length > MEET)) return 1;
    for (int i = 0; i < 3; i++) n[i] /= length;
    along3(a, radius_of(one), n, a);
    along3(b, -radius_of(other), n, b);
  }
  for (int i = 0; i < 3; i++) {
    witness[i] = swapped ? -n[i] : n[i];
    witness[3 + i] = swapped ? b[i] : a[i];
    witness[6 + i] = swapped ? a[i] : b[i];
  }
  return 0;
}
