/* What the core works on. Python reads the structures, the functions and the numbers from this page, and allocates
   every array with the shape that stands behind it; numbers of rows are upper bounds.

   n coordinates (a joint each), S shapes, P pairs, N stages, K = N + 3 nodes, M = N n variables, V = M + 4,
   B = 3 n, R residual rows of a stage, A of them affine with E entries, C curved. */
#ifndef HANDRAIL_CORE_H
#define HANDRAIL_CORE_H
#include <stdint.h>

#define RECOVERY 0.8        /* of a distance deficit that is left after each node */
#define VELOCITY_SLACK 1e-3 /* share of the limits' slack that velocity limits get: they can always be kept */
#define MOST_COORDINATES 64 /* that a robot may have */

enum { OWN, STANDING, MOVING, LIMITS, SLACKS };

/* The robot among the shapes that it keeps from. */
typedef struct {
  int64_t n;
  int64_t S;
  int64_t P;
  int64_t *parent;           /* (n,) joint that carries each joint, from 1; 0 is the world */
  int64_t *slides;           /* (n,) whether it slides */
  double *joint_rotation;    /* (n, 9) placement on the parent */
  double *joint_position;    /* (n, 3) */
  double *joint_axis;        /* (n, 3) */
  int64_t *kind;             /* (S,) of shapes.h */
  int64_t *carrier;          /* (S,) joint that carries it */
  double *size;              /* (S, 3) */
  double *shape_rotation;    /* (S, 9) placement on the joint */
  double *shape_position;    /* (S, 3) */
  double *velocity;          /* (S, 3) of a mover, as seen from the joint */
  int64_t *first;            /* (P,) shapes of each pair */
  int64_t *second;           /* (P,) */
  double *moves;             /* (P, n) -1, 1: moves the first, the second alone; 0: none or both */
  double *bounds;            /* (n, P) way of a pair by a unit of a coordinate, at most */
  double *speed;             /* (P,) of a mover */
  double *lower;             /* (n,) range of the joints */
  double *upper;             /* (n,) */
  double *a_max;             /* (n,) */
  int64_t *slack;            /* (P,) own, standing or moving */
  int64_t changes;           /* of the scene so far */
  double *now_q;             /* (n,) configuration measured last at time 0, */
  double *now;               /* (P,) its distances, */
  int64_t now_changes;       /* after so many changes of the scene; -1: none */
  double *world_rotation;    /* (n + 1, 9) joints in the world */
  double *world_position;    /* (n + 1, 3) */
  double *axis;              /* (n, 3) */
  int64_t *placed;           /* (S,) shapes placed at this configuration */
  double *placed_rotation;   /* (S, 9) */
  double *placed_position;   /* (S, 3) */
  double *bound;             /* (P,) */
  double *here;              /* (P,) */
  double *least;             /* (P,) distances that a motion has to keep, */
  double *start;             /* (n,) from here, */
  double *start_distances;   /* (P,) where they are these */
  double deepest;            /* smallest of the robot's own, 0 where none overlap */
  int64_t *close;            /* (P,) pairs that may come too near on the way */
  double *violation;         /* (3,) how far a motion falls short of safety, and from when on [s] */
  int (*measure)(int64_t pair, const double *placements, double *witness); /* of cores that meet; 0: measured */
} Scene;

/* The optimal control problem of one update, its memory and its plan. */
typedef struct {
  int64_t N;
  int64_t n;
  int64_t K;
  int64_t P;
  int64_t M;
  int64_t V;
  int64_t B;
  int64_t R;
  int64_t A;
  int64_t E;
  int64_t C;
  double dt;
  double activation;         /* distance beyond the margin at which a pair enters [m] */
  double linear;             /* penalty of the slacks */
  double quadratic;
  double *lower;             /* (n,) limits */
  double *upper;             /* (n,) */
  double *v_max;             /* (n,) */
  double *a_max;             /* (n,) */
  int64_t *begins;           /* (A + 1,) entries of each affine row */
  int64_t *columns;          /* (E,) */
  double *entries;           /* (E,) */
  double *offset;            /* (A,) */
  int64_t *affine;           /* (A,) where the rows lie */
  int64_t *curved;           /* (C,) */
  double *q;                 /* (n,) the state, */
  double *v;                 /* (n,) */
  double *sent;              /* (n,) velocity with which the plan has to begin */
  double *margins;           /* (P,) */
  double *shift;             /* (N, n) of the joints' ranges, where one is beyond now */
  double *reference;         /* (N, R) */
  double *weights;           /* (N, R) */
  double *constant;          /* (M, B) Hessian of the affine rows under these weights */
  double *guess;             /* (N, n) */
  int64_t *active;           /* (V,) rows expected to be active; then those that are */
  int64_t active_rows;
  double *z;                 /* (N, 3 * n) (q, v, u) of every stage */
  double *values;            /* (N, C) of the curved rows */
  double *jacobians;         /* (N, 3 * n, C) column by column */
  void (*evaluate)(void);    /* z to values and jacobians */
  void (*evaluate_values)(void);
  double *u;                 /* (N, n) the plan */
  double *path;              /* (N + 1, n) */
  double *speeds;            /* (N + 1, n) */
  double *slacks;            /* (4,) */
  double shortfall;          /* of the distances in the plan, measured where the work ended [m] */
  double *distances;         /* (P,) now */
  int64_t solved;            /* whether the plan is one: finite, within the hard limits */
  int64_t changes;
  int64_t rows;
  int64_t steps;
  double work;               /* numbers that may be touched; what is left of them */
  double *nodes;             /* (K, n) at which distances are kept, */
  double *times;             /* (K,) */
  double *gains;             /* (2, n) of the stop by the last velocity, */
  double *within;            /* (P,) distance at which a pair enters */
  double *found;             /* (K, P) distances there */
  double *known_q;           /* (K, n) last path, */
  double *known;             /* (K, P) its distances or lower bounds of them, */
  int64_t known_changes;     /* after so many changes of the scene; -1: none */
  double *rises;             /* (N, 2, 2, n) how far position and velocity can rise and fall from the guess */
  int64_t count;             /* of the distance rows */
  int64_t *near;             /* (K * P, 2) their node and pair */
  double *gradient;          /* (K * P, n) of the distance by the node */
  int64_t *number;           /* (K * P,) */
  double *left;              /* (K * P,) of the distance */
  double *joint_value;       /* (N, 3, n) relative to half of the range */
  double *joint_scale;       /* (3, n) */
  int64_t broken;            /* whether the guess breaks a soft limit */
  double *slope;             /* (M,) of the cost */
  double *band;              /* (M, B) */
  double *motion;            /* (N, 3, n) of the step */
  double *s;                 /* (M,) */
  double descent;            /* g's + 1/2 s'H s */
  double *directions;        /* (V, V) the active rows as T Q */
  double *triangle;          /* (V, V) */
  double *multipliers;       /* (V,) */
  int64_t *held;             /* (V,) their places */
  int64_t *is_held;          /* (4 + 2 * 3 * M + K * P,) by place */
  double *right;             /* (V,) their right-hand sides */
  double *free_point;        /* (V,) */
  double *y;                 /* (V,) */
  double *fresh;             /* (V,) a new row, */
  double *normal;            /* (V,) */
  double *shares;            /* (V,) */
  double *coordinates;       /* (V,) */
  double *step_u;            /* (N, n) */
} Core;

/* scene.c */
void place_joints(Scene *scene, const double *q);
double measured(Scene *scene, int64_t pair, double time, double *witness);
int64_t scene_distances(Scene *scene, int64_t count, const double *q, const double *times, const double *within,
                        const double *known_q, const double *known, int64_t first, double *values, int64_t *near,
                        double *gradients);
void scene_values(Scene *scene, int64_t count, const double *q, const double *times, const double *start,
                  const double *now, const double *within, double *values);

/* certificate.c */
void motion_violation(Scene *scene, int64_t count, const double *velocities, double dt, double elapsed, double span,
                      const double *lag);

/* trajectory.c */
void interpolate(const double *velocities, int64_t count, int64_t n, const double *knots, int64_t number, double *out);
void mean_accelerations(const double *velocities, int64_t count, int64_t n, double first, double dt, int64_t stages,
                        double *out);
int64_t stop_velocities(const double *velocity, int64_t n, const double *a_max, double dt, int64_t room, double *out);

/* kinematics.c */
double bring_tool(Scene *scene, const double *rotation, const double *position, int64_t first, double tolerance,
                  double *q);

/* rotation.c */
void nearest_quaternion(const double *rotation, double *quaternion);
int64_t quaternion_of(const double *rotation, double *quaternion);
void vector_of(const double *quaternion, double *vector);
int64_t rotation_vector_of(const double *rotation, double *vector);

/* motion.c */
void roll_out(const Core *c, const double *u, double *q, double *v);
void to_variables(const Core *c, const double *row, double *out);
void to_motion(const Core *c, const double *s, double *motion);
void nodes_of(Core *c, const double *q, const double *v);
void reach_of(Core *c, const double *u);

/* cost.c */
void constant_hessian(Core *c);
double expand(Core *c, const double *q, const double *v, const double *u);
double cost_of(Core *c, const double *q, const double *v, const double *u);

/* rows.c */
void take_joints(Core *c, const double *q, const double *v, const double *u);
void take_distances(Core *c, const Scene *scene);
int64_t most_violated(const Core *c, const Scene *scene);
double write_row(const Core *c, const Scene *scene, int64_t place, double *out, int64_t *first);
int64_t place_of(const Core *c, int64_t number);
int64_t number_at(const Core *c, int64_t place);

/* active_set.c */
int64_t factor(double *band, int64_t size, int64_t width);
int64_t solve_program(Core *c, const Scene *scene);

/* solve.c */
double build_program(Core *c, Scene *scene);
void solve_update(Core *c, Scene *scene);

#endif
