/* Nearest points of two convex shapes. */
#ifndef HANDRAIL_SHAPES_H
#define HANDRAIL_SHAPES_H
#include "vector.h"

enum { SPHERE, CAPSULE, BOX, CYLINDER, FLOOR };

/* A shape in the world. size: sphere (radius), capsule and cylinder (radius, half length), box (half lengths). */
typedef struct {
  int64_t kind;
  const double *size, *rotation, *position;
} Shape;

/* Write the witness (n, p1, p2), (9): the unit normal from the first to the second and their nearest points.
   Return 0, or 1 where their cores (segments, boxes, cylinders) meet: another must measure how deep. */
int nearest(const Shape *first, const Shape *second, double *witness);

/* n.(p2 - p1) [m]; negative where they overlap. */
static inline double signed_distance(const double *witness) {
  double way[3];
  along3(witness + 6, -1.0, witness + 3, way);
  return dot3(witness, way);
}

#endif
