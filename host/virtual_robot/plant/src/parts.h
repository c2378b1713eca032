// SPDX-License-Identifier: GPL-3.0-or-later
// Declarations shared by the parts of the plant.
#ifndef VIRTUAL_ROBOT_PARTS_H
#define VIRTUAL_ROBOT_PARTS_H

#include <stdbool.h>

#include "plant.h"

#define GRAVITY 9.81
#define SURROUNDINGS_PSI 14.7
#define SMALL_PER_END 3.0  // eq. (7): three small actuators at each end
#define MAX_SPRING 256

// Continuous state. Blocks have one entry per chamber, except that the body's x and v are those of head and tail.
enum {
  X_HEAD,
  V_HEAD,
  X_TAIL,
  V_TAIL,
  X_SMALL,
  V_SMALL = X_SMALL + 2,         // head's and tail's actuators
  PRESSURE = V_SMALL + 2,        // F / a
  LINE = PRESSURE + CHAMBERS,    // inlet pressure behind the tube
  LOOP = LINE + CHAMBERS,        // hysteresis, -1..1
  RELAXING = LOOP + CHAMBERS,    // force of the Maxwell branch
  SENSED = RELAXING + CHAMBERS,  // lagging sensor
  REGULATED = SENSED + CHAMBERS,
  RINGING,
  RINGING_RATE,  // marker on its mount
  STATES
};

typedef struct Spring {
  double first, step, force[MAX_SPRING], curvature[MAX_SPRING];
  int count;
  double contracted, unstable, extended;
} Spring;

typedef struct Switching {
  double time;
  int chamber, state;
} Switching;

typedef struct SwitchingQueue {
  Switching *items;
  int first, size, capacity;
} SwitchingQueue;

typedef enum { STICK = 0, FORWARD = 1, BACKWARD = -1 } Slide;

typedef struct Crosshead {
  double start, travel, rate;
  bool there_and_back;
} Crosshead;

struct Plant {
  PlantParameters p;
  Spring spring[2];  // body, small
  int experiment, chamber;
  double time, step;
  double y[STATES];
  double play[CHAMBERS];  // position of the spring within the backlash
  int source[CHAMBERS];   // what each chamber is connected to
  double set_point_psi;
  SwitchingQueue commands, edges;
  Slide slide[2];  // head, tail
  Crosshead crosshead;
  double origin_head, origin_tail;
  bool pulled_loose;
  double pulled_m;  // how far the anchored head has slid
  struct Wires *wires;
};

// spring.c
void spring_make(Spring *spring, const double *force, int count, double first, double step);
double spring_force(const Spring *spring, double x);
double spring_energy(const Spring *spring, double x);

// air.c
bool chamber_in_use(const Plant *plant, int chamber);
double supply_psi(const Plant *plant, double time, const double *y, int source);
void air_derivative(const Plant *plant, double time, const double *y, double *dy);
double sensed_psi(const Plant *plant, double time, const double *y, int chamber);
double reading_psi(const Plant *plant, double time, const double *y, int chamber);
double next_switching(const Plant *plant);
void switch_valves(Plant *plant);
void queue_switching(SwitchingQueue *queue, Switching item);

// mechanics.c
double crosshead_m(const Plant *plant, double time, double *rate);
double next_turn(const Plant *plant);
double stroke_m(const double *y, int chamber, double *rate);
double damping_Ns_m(const Plant *plant, int chamber);
double area_N_psi(const Plant *plant, int chamber, double x);
double internal_force(const Plant *plant, const double *y, int chamber);
double wall_force(const Plant *plant, const double *y, int end);
void mechanics_derivative(const Plant *plant, const double *y, double *dy);

// friction.c
double normal_force(const Plant *plant, const double *y, int end);
double static_grip(const Plant *plant, const double *y, int end, double direction);
double kinetic_grip(const Plant *plant, const double *y, int end, double direction, double speed);
double pull_without_friction(const Plant *plant, const double *y, int end);

// integrate.c
void integrate(Plant *plant, double duration);

// wires.c
void wires_free(Plant *plant);
double next_watch(const Plant *plant);
void watch_now(Plant *plant);

#endif
