/* One descent of inverse kinematics, as `Kinematics.descend` has it in NumPy, without the cost of its calls.

   Where the tool is follows from the product of exponentials of the joints' screws (R. W. Brockett, "Robotic manipulators and the
   product of exponentials formula", 1984). No Python is needed to build this, and no library but libm; nothing is allocated.
   Vectors are (3,), matrices (3, 3) by rows; metres, radians; everything is in the world's frame. */

#include <math.h>
#include <string.h>

#define MOST_JOINTS 16
#define PI 3.14159265358979323846
/* Told to whoever loads this, so that it is not taken for another of another layout. */
#define LAYOUT 1

#ifdef _WIN32
#define EXPORT __declspec(dllexport)
#else
#define EXPORT __attribute__((visibility("default")))
#endif

/* An arm. The first four arrays are of how it stands when all `travel` is zero. */
typedef struct {
  int n;
  int order[MOST_JOINTS]; /* of the joints, from the base to the tool */
  int slides[MOST_JOINTS];
  double axes[MOST_JOINTS][3], anchors[MOST_JOINTS][3]; /* zero for a joint that does not move the tool */
  double position[3], rotation[9];                      /* of the TCP */
  double reference[MOST_JOINTS], lower[MOST_JOINTS], upper[MOST_JOINTS];
  double metres_per_radian, damping, min_damping, max_step, stall_share;
  int max_steps, stall_steps;
} Arm;

/* What is asked, and what was found. */
typedef struct {
  int free_turn; /* `orientation` is an approach direction (3,), else a rotation (9,) */
  double position[3], orientation[9], q[MOST_JOINTS];
  double position_tolerance, orientation_tolerance, usual, yielding; /* weights, metres per radian */
  double position_error, orientation_error;
} Aim;

/* How an arm stands: its tool, and a Jacobian's columns. */
typedef struct {
  double position[3], rotation[9];
  double linear[MOST_JOINTS][3], angular[MOST_JOINTS][3];
} Stance;

static double dot(const double *a, const double *b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

static void cross(const double *a, const double *b, double *to) {
  to[0] = a[1] * b[2] - a[2] * b[1];
  to[1] = a[2] * b[0] - a[0] * b[2];
  to[2] = a[0] * b[1] - a[1] * b[0];
}

static void turn(const double *matrix, const double *vector, double *to) {
  for (int i = 0; i < 3; i++) to[i] = dot(matrix + 3 * i, vector);
}

static void multiply(const double *a, const double *b, double *to) {
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) to[3 * i + j] = a[3 * i] * b[j] + a[3 * i + 1] * b[3 + j] + a[3 * i + 2] * b[6 + j];
}

/* Rodrigues' formula for a unit axis. */
static void rotation_about(const double *axis, double angle, double *to) {
  double s = sin(angle), c = cos(angle), x = axis[0], y = axis[1], z = axis[2], d = 1.0 - c;
  to[0] = c + d * x * x, to[1] = d * x * y - s * z, to[2] = d * x * z + s * y;
  to[3] = d * x * y + s * z, to[4] = c + d * y * y, to[5] = d * y * z - s * x;
  to[6] = d * x * z - s * y, to[7] = d * y * z + s * x, to[8] = c + d * z * z;
}

static void stand(const Arm *arm, const double *q, Stance *stance) {
  double shift[3] = {0.0, 0.0, 0.0}, rotation[9] = {1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0};
  double axes[MOST_JOINTS][3], anchors[MOST_JOINTS][3];
  for (int k = 0; k < arm->n; k++) {
    int joint = arm->order[k];
    double travel = q[joint] - arm->reference[joint];
    turn(rotation, arm->axes[joint], axes[joint]);
    turn(rotation, arm->anchors[joint], anchors[joint]);
    for (int i = 0; i < 3; i++) anchors[joint][i] += shift[i];
    if (arm->slides[joint]) {
      for (int i = 0; i < 3; i++) shift[i] += travel * axes[joint][i];
    } else {
      double turned[9], before[9], moved[3];
      memcpy(before, rotation, sizeof before);
      rotation_about(arm->axes[joint], travel, turned);
      multiply(before, turned, rotation);
      /* The anchor stays where it is. */
      turn(rotation, arm->anchors[joint], moved);
      for (int i = 0; i < 3; i++) shift[i] = anchors[joint][i] - moved[i];
    }
  }
  turn(rotation, arm->position, stance->position);
  for (int i = 0; i < 3; i++) stance->position[i] += shift[i];
  multiply(rotation, arm->rotation, stance->rotation);
  for (int j = 0; j < arm->n; j++) {
    double lever[3];
    if (arm->slides[j]) {
      memcpy(stance->linear[j], axes[j], sizeof axes[j]);
      memset(stance->angular[j], 0, sizeof axes[j]);
      continue;
    }
    for (int i = 0; i < 3; i++) lever[i] = stance->position[i] - anchors[j][i];
    cross(axes[j], lever, stance->linear[j]);
    memcpy(stance->angular[j], axes[j], sizeof axes[j]);
  }
}

/* The rotation vector that turns the approach axis of `rotation` into `approach`. */
static void turn_of_axis(const double *rotation, const double *approach, double *to) {
  double axis[3] = {rotation[2], rotation[5], rotation[8]};
  cross(axis, approach, to);
  double length = sqrt(dot(to, to)), angle = atan2(length, dot(axis, approach));
  for (int i = 0; i < 3; i++) {
    /* Opposite directions: about any axis across. */
    if (length < 1e-6) to[i] = rotation[3 * i] * (angle > 1.0 ? angle : 0.0);
    else to[i] *= angle / length;
  }
}

/* The rotation vector that turns `rotation` into `target`, by the quaternion between them. */
static void turn_between(const double *rotation, const double *target, double *to) {
  double e[9], quat[4];
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) e[3 * i + j] = dot(target + 3 * i, rotation + 3 * j);
  /* Shepperd's method: the largest of the four comes first. */
  double sums[4] = {e[0] + e[4] + e[8], e[0] - e[4] - e[8], e[4] - e[0] - e[8], e[8] - e[0] - e[4]};
  int largest = 0;
  for (int i = 1; i < 4; i++)
    if (sums[i] > sums[largest]) largest = i;
  double skew[3] = {e[7] - e[5], e[2] - e[6], e[3] - e[1]}, twice = sqrt(fmax(0.0, 1.0 + sums[largest]));
  double share = 0.5 / twice;
  if (largest == 0) {
    quat[0] = 0.5 * twice;
    for (int i = 0; i < 3; i++) quat[1 + i] = share * skew[i];
  } else {
    int a = largest - 1, b = (a + 1) % 3, c = (a + 2) % 3;
    quat[0] = share * skew[a];
    quat[1 + a] = 0.5 * twice;
    quat[1 + b] = share * (e[3 * a + b] + e[3 * b + a]);
    quat[1 + c] = share * (e[3 * a + c] + e[3 * c + a]);
  }
  double sine = sqrt(dot(quat + 1, quat + 1));
  double angle = 2.0 * atan2(sine, quat[0]);
  if (angle > PI) angle -= 2.0 * PI;
  for (int i = 0; i < 3; i++) to[i] = sine > 0.0 ? quat[1 + i] * (angle / sine) : 0.0;
}

/* Solve for the free joints by Cholesky's decomposition; those that are held get zero. 0 when there is no solution. */
static int solve(int n, double hessian[][MOST_JOINTS], const double *gradient, const int *held, double *step) {
  int which[MOST_JOINTS], m = 0;
  double low[MOST_JOINTS][MOST_JOINTS], half[MOST_JOINTS];
  for (int j = 0; j < n; j++) {
    step[j] = 0.0;
    if (!held[j]) which[m++] = j;
  }
  for (int i = 0; i < m; i++) {
    for (int j = 0; j <= i; j++) {
      double sum = hessian[which[i]][which[j]];
      for (int k = 0; k < j; k++) sum -= low[i][k] * low[j][k];
      if (i > j) {
        low[i][j] = sum * low[j][j];
      } else {
        /* Of lengths beyond all measure the damping is lost in rounding: nothing is reached. */
        if (!(sum > 0.0) || !isfinite(sum)) return 0;
        low[i][i] = 1.0 / sqrt(sum);
      }
    }
  }
  for (int i = 0; i < m; i++) {
    double sum = gradient[which[i]];
    for (int k = 0; k < i; k++) sum -= low[i][k] * half[k];
    half[i] = sum * low[i][i];
  }
  for (int i = m - 1; i >= 0; i--) {
    double sum = half[i];
    for (int k = i + 1; k < m; k++) sum -= low[k][i] * step[which[k]];
    step[which[i]] = sum * low[i][i];
  }
  return 1;
}

/* The Newton step; a joint that it pushes against its limit is held and it is solved again. */
static void bounded_step(const Arm *arm, const double *q, double hessian[][MOST_JOINTS], const double *gradient, double *step) {
  int held[MOST_JOINTS] = {0}, blocked = 0;
  if (!solve(arm->n, hessian, gradient, held, step)) {
    memset(step, 0, arm->n * sizeof *step);
    return;
  }
  for (int j = 0; j < arm->n; j++) {
    double reached = q[j] + step[j];
    held[j] = (reached < arm->lower[j] && q[j] <= arm->lower[j]) || (reached > arm->upper[j] && q[j] >= arm->upper[j]);
    blocked += held[j];
  }
  if (blocked && blocked < arm->n && !solve(arm->n, hessian, gradient, held, step)) memset(step, 0, arm->n * sizeof *step);
}

static double clip(double value, double low, double high) { return fmin(fmax(value, low), high); }

/* Damped least squares, weighted, from `q` on; the step is bounded in joints and limits. */
static void advance(const Arm *arm, const Stance *stance, const double *offset, const double *turned, double weight, double *q) {
  double hessian[MOST_JOINTS][MOST_JOINTS], gradient[MOST_JOINTS], step[MOST_JOINTS], largest = 0.0;
  double square = weight * weight, damping = dot(offset, offset) + square * dot(turned, turned);
  damping = arm->damping * damping + arm->min_damping;
  for (int i = 0; i < arm->n; i++) {
    gradient[i] = dot(stance->linear[i], offset) + square * dot(stance->angular[i], turned);
    for (int j = 0; j <= i; j++)
      hessian[i][j] = dot(stance->linear[i], stance->linear[j]) + square * dot(stance->angular[i], stance->angular[j]);
    hessian[i][i] += damping;
  }
  bounded_step(arm, q, hessian, gradient, step);
  for (int j = 0; j < arm->n; j++) largest = fmax(largest, fabs(step[j]));
  double share = largest > arm->max_step ? arm->max_step / largest : 1.0;
  for (int j = 0; j < arm->n; j++) q[j] = clip(q[j] + share * step[j], arm->lower[j], arm->upper[j]);
}

EXPORT int layout(void) { return LAYOUT; }

/* Descend from `aim->q`; it and the errors become those of the best configuration. 1 when it is within tolerance. */
EXPORT int descend(const Arm *arm, Aim *aim) {
  Stance stance;
  double q[MOST_JOINTS], offset[3], turned[3];
  double best = INFINITY, checkpoint = INFINITY;
  for (int j = 0; j < arm->n; j++) q[j] = aim->q[j] = clip(aim->q[j], arm->lower[j], arm->upper[j]);
  aim->position_error = aim->orientation_error = INFINITY;
  for (int step = 0; step < arm->max_steps; step++) {
    stand(arm, q, &stance);
    for (int i = 0; i < 3; i++) offset[i] = aim->position[i] - stance.position[i];
    if (aim->free_turn) turn_of_axis(stance.rotation, aim->orientation, turned);
    else turn_between(stance.rotation, aim->orientation, turned);
    double away = sqrt(dot(offset, offset)), off = sqrt(dot(turned, turned));
    /* Of a direction that may be off by so much, only what is beyond that is an error. */
    double beyond = aim->free_turn ? fmax(0.0, off - aim->orientation_tolerance) : off;
    double cost = away + arm->metres_per_radian * beyond;
    int there = away <= aim->position_tolerance && off <= aim->orientation_tolerance;
    if (there || cost < best) {
      best = cost;
      memcpy(aim->q, q, arm->n * sizeof *q);
      aim->position_error = away, aim->orientation_error = off;
    }
    if (there) return 1;
    if (step % arm->stall_steps == 0) {
      if (best > arm->stall_share * checkpoint) break;
      checkpoint = best;
    }
    double weight = aim->usual;
    if (off <= aim->orientation_tolerance) {
      weight = aim->yielding;
      if (aim->free_turn) memset(turned, 0, sizeof turned);
    }
    advance(arm, &stance, offset, turned, weight, q);
  }
  return 0;
}
