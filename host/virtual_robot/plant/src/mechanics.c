// SPDX-License-Identifier: GPL-3.0-or-later
// Forces and motion of the actuators and of the two halves of the robot: eqs. (1), (4) and (8).
#include <math.h>

#include "parts.h"

double crosshead_m(const Plant *plant, double time, double *rate) {
  const Crosshead *c = &plant->crosshead;
  double elapsed = time - c->start, leg = c->rate > 0 ? c->travel / c->rate : 0;
  double position = 0, speed = 0;
  if (c->rate > 0 && elapsed > 0) {
    if (elapsed < leg) {
      position = c->rate * elapsed;
      speed = c->rate;
    } else if (!c->there_and_back) {
      position = c->travel;
    } else if (elapsed < 2 * leg) {
      position = c->travel - c->rate * (elapsed - leg);
      speed = -c->rate;
    }
  }
  if (rate) *rate = speed;
  return position;
}

// Next time at which the cross-head's speed jumps; infinite if there is none.
double next_turn(const Plant *plant) {
  const Crosshead *c = &plant->crosshead;
  if (c->rate <= 0) return INFINITY;
  double leg = c->travel / c->rate;
  for (int turn = 0; turn <= (c->there_and_back ? 2 : 1); turn++) {
    double at = c->start + turn * leg;
    if (at > plant->time + 1e-12) return at;
  }
  return INFINITY;
}

// Extension of an actuator; the body's is the distance between the two halves.
double stroke_m(const double *y, int chamber, double *rate) {
  if (chamber == BODY) {
    if (rate) *rate = y[V_HEAD] - y[V_TAIL];
    return y[X_HEAD] - y[X_TAIL];
  }
  if (rate) *rate = y[V_SMALL + chamber - HEAD];
  return y[X_SMALL + chamber - HEAD];
}

double area_N_psi(const Plant *plant, int chamber, double x) {
  const PlantParameters *p = &plant->p;
  const Spring *spring = &plant->spring[chamber != BODY];
  double share = (x - spring->contracted) / (spring->extended - spring->contracted);
  double area = chamber == BODY ? p->body_area_N_psi : p->small_area_N_psi;
  return area * (1.0 + p->area_variation_slope * share) * (1.0 + p->area_drift_share * p->session_share);
}

// A static loading is so slow that the air moves without resistance (contract: force = K(x) - a p).
double damping_Ns_m(const Plant *plant, int chamber) {
  if (plant->experiment == STATIC_LOADING) return 0.0;
  return chamber == BODY ? plant->p.body_damping_Ns_m : plant->p.small_damping_Ns_m;
}

static double spring_position(const Plant *plant, int chamber, double x) {
  double half = 0.5 * plant->p.backlash_gap_m;
  if (half <= 0) return x;
  return fmin(fmax(plant->play[chamber], x - half), x + half);
}

// The force that pushes an actuator's ends apart: -K - b v + a p.
double internal_force(const Plant *plant, const double *y, int chamber) {
  const PlantParameters *p = &plant->p;
  bool small = chamber != BODY;
  double rate, x = stroke_m(y, chamber, &rate);
  double force = area_N_psi(plant, chamber, x) * y[PRESSURE + chamber];
  force -= damping_Ns_m(plant, chamber) * rate;
  force -= spring_force(&plant->spring[small], spring_position(plant, chamber, x));
  if (p->hysteresis_force_N > 0) {
    force -= p->hysteresis_force_N * (small ? p->hysteresis_small_share : 1.0) * y[LOOP + chamber];
  }
  if (p->viscoelasticity_stiffness_N_m > 0) {
    force -= (small ? p->viscoelasticity_small_share : 1.0) * y[RELAXING + chamber];
  }
  if (!small && plant->experiment != STATIC_LOADING) force -= p->quadratic_damping_Ns2_m2 * fabs(rate) * rate;
  return force;
}

// Eq. (8), except that the wall never pulls. An actuator on the test stand has no wall around it.
double wall_force(const Plant *plant, const double *y, int end) {
  const PlantParameters *p = &plant->p;
  if (plant->experiment == STEP_RESPONSE || plant->experiment == STATIC_LOADING) return 0.0;
  double depth = y[X_SMALL + end] - p->wall_offset_m;
  if (depth <= 0) return 0.0;
  return fmax(p->wall_stiffness_N_m * depth + p->wall_damping_Ns_m * y[V_SMALL + end], 0.0);
}

static void spring_memory_derivative(const Plant *plant, const double *y, double *dy, int chamber) {
  const PlantParameters *p = &plant->p;
  double rate;
  stroke_m(y, chamber, &rate);
  if (p->hysteresis_force_N > 0) {
    dy[LOOP + chamber] = (rate - fabs(rate) * y[LOOP + chamber]) / p->hysteresis_displacement_m;
  }
  if (p->viscoelasticity_stiffness_N_m > 0) {
    dy[RELAXING + chamber] =
        p->viscoelasticity_stiffness_N_m * rate - y[RELAXING + chamber] / p->viscoelasticity_time_s;
  }
}

static void small_derivative(const Plant *plant, const double *y, double *dy, int end) {
  double force = internal_force(plant, y, HEAD + end) - wall_force(plant, y, end);
  dy[X_SMALL + end] = y[V_SMALL + end];
  dy[V_SMALL + end] = force / plant->p.small_mass_kg;
}

static void half_derivative(const Plant *plant, const double *y, double *dy, int end) {
  Slide slide = plant->slide[end];
  int x = end ? X_TAIL : X_HEAD, v = end ? V_TAIL : V_HEAD;
  if (slide == STICK) return;
  double pull = pull_without_friction(plant, y, end);
  double grip = kinetic_grip(plant, y, end, slide, fabs(y[v])) + plant->p.viscous_drag_Ns_m * fabs(y[v]);
  dy[x] = y[v];
  dy[v] = (pull - slide * grip) / (end ? plant->p.tail_mass_kg : plant->p.head_mass_kg);
}

// The camera's marker sits on a springy mount, which rings when the head accelerates.
static void mount_derivative(const Plant *plant, const double *y, double *dy) {
  const PlantParameters *p = &plant->p;
  if (p->mount_resonance_share <= 0) return;
  double omega = 2 * M_PI * p->mount_resonance_frequency_Hz;
  dy[RINGING] = y[RINGING_RATE];
  dy[RINGING_RATE] =
      -2 * p->mount_resonance_damping * omega * y[RINGING_RATE] - omega * omega * y[RINGING] - dy[V_HEAD];
}

void mechanics_derivative(const Plant *plant, const double *y, double *dy) {
  switch (plant->experiment) {
    case LOCOMOTION:
      half_derivative(plant, y, dy, 0);
      half_derivative(plant, y, dy, 1);
      small_derivative(plant, y, dy, 0);
      small_derivative(plant, y, dy, 1);
      for (int chamber = 0; chamber < CHAMBERS; chamber++) spring_memory_derivative(plant, y, dy, chamber);
      break;
    case STEP_RESPONSE:
      if (plant->chamber == BODY) {
        dy[X_HEAD] = y[V_HEAD];
        dy[V_HEAD] = internal_force(plant, y, BODY) / plant->p.head_mass_kg;
      } else {
        small_derivative(plant, y, dy, plant->chamber - HEAD);
      }
      spring_memory_derivative(plant, y, dy, plant->chamber);
      break;
    case STATIC_LOADING:
      // The cross-head holds the end; integrate() sets position and speed.
      dy[plant->chamber == BODY ? X_HEAD : X_SMALL] = y[plant->chamber == BODY ? V_HEAD : V_SMALL];
      spring_memory_derivative(plant, y, dy, plant->chamber);
      break;
    default:  // ANCHOR_PULL: the head actuators against the wall; the pull itself is quasi-static
      small_derivative(plant, y, dy, 0);
      spring_memory_derivative(plant, y, dy, HEAD);
  }
  mount_derivative(plant, y, dy);
}
