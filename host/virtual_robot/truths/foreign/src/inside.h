// SPDX-License-Identifier: GPL-3.0-or-later
// Declarations shared by the files of the foreign robot.
#ifndef VIRTUAL_ROBOT_FOREIGN_INSIDE_H
#define VIRTUAL_ROBOT_FOREIGN_INSIDE_H

#include <math.h>
#include <stdbool.h>
#include <stddef.h>

#include "foreign.h"

#define G_M_S2 9.81
#define AIR_PSI 14.7
#define ACTUATORS_PER_END 3.0  // eq. (7)

enum { WALK = 0, STEP, STATIC, PULL };
enum { OFF = 0, POSITIVE_SUPPLY, VACUUM_PUMP };

// Layout of the state. Blocks of three are in the order body, head, tail.
enum {
  X = 0,             // head, tail
  MOMENTUM = X + 2,  // head, tail
  X_ACT = MOMENTUM + 2,
  P_ACT = X_ACT + 2,  // small actuators of head and tail
  FORCE = P_ACT + 2,  // F of eq. (2), for one actuator
  CELL = FORCE + 3,   // three cells of the line for each chamber
  BOUC = CELL + 9,
  PRONY = BOUC + 3,     // five branches for each actuator
  SENSOR = PRONY + 15,  // reading and its rate
  RESERVOIR = SENSOR + 6,
  HEAT = RESERVOIR + 2,
  WARMTH = HEAT + 3,
  CREEP = WARMTH + 1,  // body, small
  SIZE = CREEP + 2
};

typedef struct Foreign {
  const ForeignRobot *r;
  ForeignTrial *trial;
  double y[SIZE];
  double t;
  // State that changes only between steps.
  int source[3], slide[2];  // slide: -1, 0 = sticks, 1
  double opened_s[3];
  int side[3];                               // of the dead zone, where the mechanism rests; 1 = it is pulled outwards
  double play[3][3], slip[3][4], anchor[3];  // plays and slips after the last step, at stroke `anchor`
  bool loose;                                // whether the pulled head slides
  double slid_m;
} Foreign;

static inline bool in_use(const Foreign *f, int chamber) {
  if (f->trial->experiment == WALK) return true;
  return chamber == (f->trial->experiment == PULL ? 1 : f->trial->chamber);
}
static inline int kind(int chamber) { return chamber != 0; }

double foreign_against(const Foreign *f, const double *y, int chamber, int side);
double foreign_stroke(const Foreign *f, const double *y, int chamber, double *rate);
double foreign_crosshead(const Foreign *f, double t, double *rate);
double foreign_push(const Foreign *f, const double *y, int chamber);
double foreign_area(const Foreign *f, int chamber, double x);
double foreign_damping(const Foreign *f, const double *y, int chamber);
double foreign_wall(const Foreign *f, const double *y, int end);
double foreign_contact_depth(const Foreign *f, const double *y, int end);
double foreign_pull(const Foreign *f, const double *y, int end);
double foreign_grip(const Foreign *f, const double *y, int end, int direction, double speed, bool at_rest);
double foreign_load(const Foreign *f, double t, double slid);
void foreign_air(const Foreign *f, double t, const double *y, double *dy);
double foreign_reading(const Foreign *f, const double *y, int chamber);
void foreign_mechanics(const Foreign *f, const double *y, double *dy);
double foreign_energy(const Foreign *f, const double *y);

#endif
