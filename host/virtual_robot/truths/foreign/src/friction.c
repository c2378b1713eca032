// SPDX-License-Identifier: GPL-3.0-or-later
// Wall, weight and dry friction of the two halves, and of the pulled head.
#include "inside.h"

#define TAIL_BEHIND_M 0.15  // where the tail touches the pipe, behind the head

double foreign_crosshead(const Foreign *f, double t, double *rate) {
  const ForeignTrial *trial = f->trial;
  double way = trial->rate_m_s * fmax(t, 0.0), speed = t >= 0 ? trial->rate_m_s : 0.0;
  if (way >= trial->travel_m - 1e-12) {  // a step that begins at the turn belongs to the return leg
    way = trial->there_and_back ? fmax(2.0 * trial->travel_m - way, 0.0) : trial->travel_m;
    speed = trial->there_and_back && way > 0 ? -trial->rate_m_s : 0.0;
  }
  if (rate) *rate = speed;
  return way;
}

double foreign_stroke(const Foreign *f, const double *y, int chamber, double *rate) {
  if (f->trial->experiment == STATIC) {
    foreign_crosshead(f, f->t, rate);
    return y[chamber == 0 ? X : X_ACT];
  }
  if (chamber > 0) {
    if (rate) *rate = y[P_ACT + chamber - 1] / f->r->small_mass_kg;
    return y[X_ACT + chamber - 1];
  }
  if (f->trial->experiment == STEP) {
    if (rate) *rate = y[MOMENTUM] / f->r->stand_mass_kg;
    return y[X];
  }
  if (rate) *rate = y[MOMENTUM] / f->r->half_mass_kg[0] - y[MOMENTUM + 1] / f->r->half_mass_kg[1];
  return y[X] - y[X + 1];
}

static double place_in_pipe(const Foreign *f, const double *y, int end) {
  if (f->trial->experiment == PULL) return f->slid_m;
  return y[X + end] - (end ? TAIL_BEHIND_M : 0.0);
}

double foreign_contact_depth(const Foreign *f, const double *y, int end) {
  const ForeignRobot *r = f->r;
  double wall = r->wall_offset_m;
  if (r->bore_m > 0) {
    double at = 2.0 * M_PI * place_in_pipe(f, y, end);
    wall += r->bore_m *
            (sin(at / r->bore_wave_m[0] + r->bore_phase[0]) + 0.5 * sin(at / r->bore_wave_m[1] + r->bore_phase[1]));
  }
  return y[X_ACT + end] - wall;
}

double foreign_wall(const Foreign *f, const double *y, int end) {
  if (f->trial->experiment == STEP || f->trial->frictionless) return 0.0;
  double depth = foreign_contact_depth(f, y, end);
  if (depth <= 0) return 0.0;
  return fmax(f->r->wall_N_m * depth + f->r->wall_Ns_m * y[P_ACT + end] / f->r->small_mass_kg, 0.0);
}

static double slope(const Foreign *f, const double *y, int end) {
  if (f->trial->experiment != WALK) return 0.0;
  return f->r->slope_rad + f->r->slope_rad_m * place_in_pipe(f, y, end);
}

static double weight(const Foreign *f, int end) {
  return G_M_S2 * (f->trial->experiment == PULL ? f->r->segment_mass_kg : f->r->half_mass_kg[end]);
}

// Eq. (6) and the component of the weight along the pipe.
double foreign_pull(const Foreign *f, const double *y, int end) {
  double push = foreign_push(f, y, 0);
  return (end ? -push : push) - weight(f, end) * sin(slope(f, y, end));
}

static double seam(const ForeignRobot *r, double place) {  // climbs a lip, drops off its edge
  if (r->seam_rise <= 0) return 1.0;
  double along = fmod(place + r->seam_phase_m + 100.0 * r->seam_spacing_m, r->seam_spacing_m) / r->seam_width_m;
  return along < 1.0 ? 1.0 + r->seam_rise * along : 1.0;
}

// Share of static friction: 1 at rest, 0 if friction is purely kinetic.
static double still(const ForeignRobot *r, double speed, bool at_rest) {
  if (at_rest) return 1.0;
  double ratio = r->stribeck_form ? speed / r->stribeck_m_s : 0.0;
  if (r->stribeck_form == 1) return 1.0 / (1.0 + ratio * ratio);
  return r->stribeck_form == 2 ? exp(-ratio) : 0.0;
}

double foreign_grip(const Foreign *f, const double *y, int end, int direction, double speed, bool at_rest) {
  const ForeignRobot *r = f->r;
  if (f->trial->frictionless) return 0.0;
  double pressed = ACTUATORS_PER_END * foreign_wall(f, y, end), own = weight(f, end) * cos(slope(f, y, end));
  double share = still(r, speed, at_rest);
  double kinetic = r->mu_k * (1.0 + direction * r->direction_kinetic);
  double mu = kinetic + share * (r->mu_s * (1.0 + direction * r->direction_static) - kinetic);
  double mu_own = r->direction_wall_only ? r->mu_k + share * (r->mu_s - r->mu_k) : mu;
  double place = place_in_pipe(f, y, end);
  double grip = r->friction_factor * seam(r, place) * (mu * pressed + mu_own * own);
  if (end == 1 && r->tether_N > 0 && y[X + 1] > 0) grip += r->tether_N * expm1(y[X + 1] / r->tether_m);
  return grip;
}

// Force of the load cell once the head has slid by `slid`, with the slack and compliance of the load train.
double foreign_load(const Foreign *f, double t, double slid) {
  const ForeignRobot *r = f->r;
  double pulled = foreign_crosshead(f, t, NULL) - slid, load = 0;
  if (r->play_m[0] > 0) {  // three strands tighten one after the other
    for (int i = 0; i < 3; i++) load += r->load_cell_N_m / 3.0 * fmax(pulled - 2.0 * r->play_m[i], 0.0);
    return load;
  }
  return r->load_cell_N_m * fmax(pulled - r->gap_m, 0.0);
}
