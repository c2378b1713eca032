// SPDX-License-Identifier: GPL-3.0-or-later
// Mounting, commanding, moving and observing.
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "parts.h"

#define SETTLE_S 10.0       // twenty times the chambers' time constant
#define STEP_S 1e-4         // the small actuators' fastest rate is 2.4e3 1/s
#define STATIC_STEP_S 2e-3  // only the air has dynamics of its own

Plant *plant_new(const PlantParameters *parameters, const double *body_force_N, int body_count, double body_first_m,
                 double body_step_m, const double *small_force_N, int small_count, double small_first_m,
                 double small_step_m) {
  Plant *plant = calloc(1, sizeof *plant);
  plant->p = *parameters;
  spring_make(&plant->spring[0], body_force_N, body_count, body_first_m, body_step_m);
  spring_make(&plant->spring[1], small_force_N, small_count, small_first_m, small_step_m);
  plant->set_point_psi = parameters->supply_positive_psi;
  plant_mount(plant, LOCOMOTION, BODY, VENT);
  return plant;
}

void plant_free(Plant *plant) {
  wires_free(plant);
  free(plant->commands.items);
  free(plant->edges.items);
  free(plant);
}

double plant_spring(const Plant *plant, int small, double displacement_m) {
  return spring_force(&plant->spring[small], displacement_m);
}

void plant_landmarks(const Plant *plant, int small, double *contracted_m, double *unstable_m, double *extended_m) {
  *contracted_m = plant->spring[small].contracted;
  *unstable_m = plant->spring[small].unstable;
  *extended_m = plant->spring[small].extended;
}

// Vented and at rest, with `start` just connected; integration then lets the robot settle.
static void put_at_rest(Plant *plant, int start) {
  memset(plant->y, 0, sizeof plant->y);
  double *y = plant->y;
  y[X_HEAD] = plant->spring[0].contracted;
  y[X_SMALL] = y[X_SMALL + 1] = plant->spring[1].contracted;
  if (plant->experiment == ANCHOR_PULL) y[X_SMALL] = plant->p.wall_offset_m;  // already extended by pressure
  y[REGULATED] = plant->set_point_psi;
  for (int chamber = 0; chamber < CHAMBERS; chamber++) {
    plant->source[chamber] = VENT;
    if (!chamber_in_use(plant, chamber)) continue;
    plant->source[chamber] = start;
    plant->play[chamber] = stroke_m(y, chamber, NULL);
  }
}

void plant_mount(Plant *plant, int experiment, int chamber, int start) {
  plant->experiment = experiment;
  plant->chamber = experiment == LOCOMOTION ? BODY : experiment == ANCHOR_PULL ? HEAD : chamber;
  plant->step = experiment == STATIC_LOADING ? STATIC_STEP_S : STEP_S;
  plant->commands.size = plant->commands.first = plant->edges.size = plant->edges.first = 0;
  plant->crosshead = (Crosshead){0};
  plant->pulled_m = 0;
  plant->pulled_loose = false;
  plant->slide[0] = plant->slide[1] = STICK;
  put_at_rest(plant, start);
  plant->time = -SETTLE_S;
  integrate(plant, SETTLE_S);
  plant->time = 0;
  for (int c = 0; c < CHAMBERS; c++) plant->y[RELAXING + c] = 0;  // relaxed after a long rest
  plant->origin_head = plant->y[X_HEAD];
  plant->origin_tail = plant->y[X_TAIL];
}

void plant_set_trial(Plant *plant, double friction_factor, double inclination_deg, double ripple_phase_rad,
                     double session_share) {
  plant->p.friction_factor = friction_factor;
  plant->p.inclination_deg = inclination_deg;
  plant->p.ripple_phase_rad = ripple_phase_rad;
  plant->p.session_share = session_share;
}

void plant_set_step(Plant *plant, double step_s) { plant->step = step_s; }

void plant_set_supply(Plant *plant, double positive_psi) { plant->set_point_psi = positive_psi; }

void plant_connect(Plant *plant, double time_s, int chamber, int state) {
  queue_switching(&plant->commands, (Switching){time_s, chamber, state});
}

void plant_move(Plant *plant, double start_s, double travel_m, double rate_m_s, int there_and_back) {
  plant->crosshead = (Crosshead){start_s, travel_m, rate_m_s, there_and_back};
}

int plant_moving(const Plant *plant) {
  double rate;
  crosshead_m(plant, plant->time, &rate);
  return rate != 0 || (plant->crosshead.rate > 0 && plant->time <= plant->crosshead.start);
}

void plant_advance(Plant *plant, double time_s) {
  double next;
  while ((next = next_watch(plant)) <= time_s) {
    if (next > plant->time) integrate(plant, next - plant->time);
    watch_now(plant);
  }
  if (time_s > plant->time) integrate(plant, time_s - plant->time);
}

static double measured_force_N(const Plant *plant) {
  if (plant->experiment == STATIC_LOADING) return -internal_force(plant, plant->y, plant->chamber);
  if (plant->experiment != ANCHOR_PULL) return 0.0;
  double pulled = crosshead_m(plant, plant->time, NULL) - plant->p.backlash_gap_m;
  return fmax(plant->p.load_cell_N_m * (pulled - plant->pulled_m), 0.0);
}

void plant_sample(const Plant *plant, PlantSample *sample) {
  const PlantParameters *p = &plant->p;
  const double *y = plant->y;
  double camera = 1.0 + p->camera_scale_gain;
  sample->time_s = plant->time;
  sample->crosshead_m = crosshead_m(plant, plant->time, NULL);
  if (plant->experiment == STEP_RESPONSE) {
    const Spring *spring = &plant->spring[plant->chamber != BODY];
    sample->head_m = camera * (stroke_m(y, plant->chamber, NULL) - spring->contracted);
  } else {
    sample->head_m = camera * (y[X_HEAD] - plant->origin_head);
  }
  sample->head_m += p->mount_resonance_share * y[RINGING];
  sample->tail_m = camera * (y[X_TAIL] - plant->origin_tail);
  sample->force_N = measured_force_N(plant);
  for (int chamber = 0; chamber < CHAMBERS; chamber++) {
    sample->pressure_psi[chamber] = reading_psi(plant, plant->time, y, chamber);
    sample->small_m[chamber] = chamber == BODY ? 0 : y[X_SMALL + chamber - HEAD];
    sample->connected[chamber] = plant->source[chamber];
  }
  sample->sliding_head = plant->slide[0];
  sample->sliding_tail = plant->slide[1];
}

void plant_record(Plant *plant, double start_s, double period_s, int count, PlantSample *samples) {
  for (int i = 0; i < count; i++) {
    plant_advance(plant, start_s + i * period_s);
    plant_sample(plant, &samples[i]);
  }
}

double plant_energy(const Plant *plant) {
  const double *y = plant->y;
  const PlantParameters *p = &plant->p;
  double kinetic = 0.5 * (p->head_mass_kg * y[V_HEAD] * y[V_HEAD] + p->tail_mass_kg * y[V_TAIL] * y[V_TAIL]);
  double stored = spring_energy(&plant->spring[0], y[X_HEAD] - y[X_TAIL]);
  for (int end = 0; end < 2; end++) {
    kinetic += 0.5 * p->small_mass_kg * y[V_SMALL + end] * y[V_SMALL + end];
    stored += spring_energy(&plant->spring[1], y[X_SMALL + end]);
    double depth = fmax(y[X_SMALL + end] - p->wall_offset_m, 0);
    stored += 0.5 * p->wall_stiffness_N_m * depth * depth;
  }
  return kinetic + stored;
}

