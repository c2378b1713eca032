// SPDX-License-Identifier: GPL-3.0-or-later
// Dry friction of the two halves on the pipe, eqs. (5)-(7), as true set-valued Coulomb friction: a half either
// sticks (friction balances the pull) or slides (friction opposes the motion). integrate() locates the transitions,
// so no threshold speed is needed.
#include <math.h>

#include "parts.h"

static double pipe_angle(const Plant *plant) {
  if (plant->experiment != LOCOMOTION) return 0.0;  // only the pipe of walking experiments is tilted
  return (plant->p.inclination_deg + plant->p.inclination_angle_deg) * M_PI / 180.0;
}

static double mass_of(const Plant *plant, int end) {
  if (plant->experiment == ANCHOR_PULL) return plant->p.head_segment_mass_kg;
  return end ? plant->p.tail_mass_kg : plant->p.head_mass_kg;
}

double normal_force(const Plant *plant, const double *y, int end) {
  double angle = pipe_angle(plant);
  double weight = mass_of(plant, end) * GRAVITY * (angle == 0 ? 1.0 : cos(angle));
  return SMALL_PER_END * wall_force(plant, y, end) + weight;
}

// Lips at the joints of the pipe's segments raise the friction over a short distance.
static double joint_factor(const PlantParameters *p, double x) {
  if (p->pipe_joint_rise <= 0) return 1.0;
  double from_joint = remainder(x - 0.5 * p->pipe_joint_spacing_m, p->pipe_joint_spacing_m) / p->pipe_joint_width_m;
  return 1.0 + p->pipe_joint_rise * exp(-0.5 * from_joint * from_joint);
}

static double travelled(const Plant *plant, const double *y, int end) {
  if (plant->experiment == ANCHOR_PULL) return plant->pulled_m;
  return end ? y[X_TAIL] - plant->origin_tail : y[X_HEAD] - plant->origin_head;
}

static double grip(const Plant *plant, const double *y, int end, double direction, double coefficient) {
  const PlantParameters *p = &plant->p;
  double way = travelled(plant, y, end);
  coefficient *= p->friction_factor * (1.0 + p->friction_direction_asymmetry * direction) * joint_factor(p, way);
  double force = coefficient * normal_force(plant, y, end);
  if (end && plant->experiment == LOCOMOTION && way > 0) force += p->tether_drag_drag_N_m * way;
  return force;
}

double static_grip(const Plant *plant, const double *y, int end, double direction) {
  return grip(plant, y, end, direction, plant->p.mu_s);
}

double kinetic_grip(const Plant *plant, const double *y, int end, double direction, double speed) {
  const PlantParameters *p = &plant->p;
  double coefficient = p->mu_k;
  if (p->stribeck_speed_m_s > 0) {
    double ratio = speed / p->stribeck_speed_m_s;
    coefficient += (p->mu_s - p->mu_k) * exp(-ratio * ratio);
  }
  return grip(plant, y, end, direction, coefficient);
}

// Eq. (6) with the component of the weight along the pipe.
double pull_without_friction(const Plant *plant, const double *y, int end) {
  double push = internal_force(plant, y, BODY);
  double angle = pipe_angle(plant);
  return (end ? -push : push) - mass_of(plant, end) * GRAVITY * (angle == 0 ? 0.0 : sin(angle));
}
