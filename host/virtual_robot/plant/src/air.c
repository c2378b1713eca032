// SPDX-License-Identifier: GPL-3.0-or-later
// Supplies, valves, tubes, chambers and pressure sensors: eqs. (2) and (3), and the effects that modify them.
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "parts.h"

bool chamber_in_use(const Plant *plant, int chamber) {
  return plant->experiment == LOCOMOTION || chamber == plant->chamber;
}

// --- valves -----------------------------------------------------------------------------------------------------

void queue_switching(SwitchingQueue *queue, Switching item) {
  if (queue->first + queue->size == queue->capacity) {
    if (queue->first > 0) memmove(queue->items, queue->items + queue->first, queue->size * sizeof item);
    queue->first = 0;
    if (queue->size == queue->capacity) {
      queue->capacity = queue->capacity ? 2 * queue->capacity : 64;
      queue->items = realloc(queue->items, queue->capacity * sizeof item);
    }
  }
  queue->items[queue->first + queue->size++] = item;
}

static double valve_delay(const PlantParameters *p, int state) {
  double edge = state == POSITIVE ? p->valve_asymmetry_difference_s : -p->valve_asymmetry_difference_s;
  double own = state == VENT ? p->valve_closing_s : p->valve_opening_s;
  return p->valve_latency_delay_s + (edge > 0 ? edge : 0) + own;
}

// Drops pending edges that a newer command supersedes.
static void forget_overtaken(SwitchingQueue *edges, const Switching *newer) {
  int kept = 0;
  Switching *items = edges->items + edges->first;
  for (int i = 0; i < edges->size; i++) {
    if (items[i].chamber == newer->chamber && items[i].time >= newer->time) continue;
    items[kept++] = items[i];
  }
  edges->size = kept;
}

static const Switching *earliest(const SwitchingQueue *queue) {
  const Switching *best = NULL;
  for (int i = 0; i < queue->size; i++) {
    const Switching *item = &queue->items[queue->first + i];
    if (best == NULL || item->time < best->time) best = item;
  }
  return best;
}

double next_switching(const Plant *plant) {
  double next = INFINITY;
  if (plant->commands.size > 0) next = plant->commands.items[plant->commands.first].time;
  const Switching *edge = earliest(&plant->edges);
  return edge && edge->time < next ? edge->time : next;
}

// Carries out every command and edge that is due.
void switch_valves(Plant *plant) {
  const double due = plant->time + 1e-12;
  while (plant->commands.size > 0 && plant->commands.items[plant->commands.first].time <= due) {
    Switching command = plant->commands.items[plant->commands.first++];
    plant->commands.size--;
    Switching edge = {command.time + valve_delay(&plant->p, command.state), command.chamber, command.state};
    forget_overtaken(&plant->edges, &edge);
    queue_switching(&plant->edges, edge);
  }
  const Switching *edge;
  while ((edge = earliest(&plant->edges)) != NULL && edge->time <= due) {
    plant->source[edge->chamber] = edge->state;
    Switching *items = plant->edges.items + plant->edges.first;
    int place = (int)(edge - items);
    memmove(items + place, items + place + 1, (plant->edges.size - place - 1) * sizeof *items);
    plant->edges.size--;
  }
}

// --- supplies ---------------------------------------------------------------------------------------------------

static double unloaded_psi(const Plant *plant, double time, const double *y, int source) {
  const PlantParameters *p = &plant->p;
  if (source == VENT) return 0.0;
  if (source == VACUUM) return p->supply_negative_psi + p->pump_fade_psi * p->session_share;
  double pressure = p->regulator_time_s > 0 ? y[REGULATED] : plant->set_point_psi;
  if (pressure > 0 && p->regulator_ripple_amplitude_psi > 0) {
    pressure += p->regulator_ripple_amplitude_psi *
                sin(2 * M_PI * p->regulator_ripple_frequency_Hz * time + p->ripple_phase_rad);
  }
  return pressure;
}

static double inlet_psi(const Plant *plant, const double *y, int chamber, double source_psi) {
  return plant->p.line_lag_time_s > 0 ? y[LINE + chamber] : source_psi;
}

// Eq. (3): a bulged pouch empties slowly.
static double alpha_per_s(const Plant *plant, const double *y, int chamber, double inlet) {
  const PlantParameters *p = &plant->p;
  bool small = chamber != BODY;
  double x = stroke_m(y, chamber, NULL);
  bool bulged = x > plant->spring[small].unstable && inlet < 0;
  if (small) return bulged ? p->small_alpha_s_per_s : p->small_alpha_n_per_s;
  return bulged ? p->body_alpha_s_per_s : p->body_alpha_n_per_s;
}

// Volume of a chamber relative to the body's: three actuators at an end of the robot, one on the stand.
static double volume_share(const Plant *plant, int chamber) {
  if (chamber == BODY) return 1.0;
  double count = plant->experiment == STEP_RESPONSE || plant->experiment == STATIC_LOADING ? 1.0 : SMALL_PER_END;
  const Spring *body = &plant->spring[0], *small = &plant->spring[1];
  return count * plant->p.small_area_N_psi * (small->extended - small->contracted) /
         (plant->p.body_area_N_psi * (body->extended - body->contracted));
}

// The pressure of a source with internal resistance drops with the flow that its chambers draw.
double supply_psi(const Plant *plant, double time, const double *y, int source) {
  double pressure = unloaded_psi(plant, time, y, source);
  double resistance = plant->p.supply_sag_resistance_s;
  if (resistance <= 0 || source == VENT) return pressure;
  if (source == VACUUM) resistance *= plant->p.supply_sag_vacuum_share;
  double conductance = 0, drawn = 0;
  for (int chamber = 0; chamber < CHAMBERS; chamber++) {
    if (!chamber_in_use(plant, chamber) || plant->source[chamber] != source) continue;
    double rate = volume_share(plant, chamber) * alpha_per_s(plant, y, chamber, pressure);
    conductance += rate;
    drawn += rate * y[PRESSURE + chamber];
  }
  return (pressure + resistance * drawn) / (1.0 + resistance * conductance);
}

// --- chambers ---------------------------------------------------------------------------------------------------

// Flow through a restriction by ISO 6358, as the pressure difference in psi at which a linear law gives the same flow.
// The conductance is chosen so that the paper's baseline gait keeps its speed.
#define CONDUCTANCE 1.05
#define LAMINAR_RATIO 0.999  // above this ratio the flow is laminar, which avoids an infinite slope

static double throttled(double inlet, double pressure, double critical_ratio) {
  double up = fmax(inlet, pressure) + SURROUNDINGS_PSI, down = fmax(fmin(inlet, pressure) + SURROUNDINGS_PSI, 0.0);
  double ratio = down / fmax(up, 0.01), laminar = 1.0;
  if (ratio > LAMINAR_RATIO) {
    laminar = (1.0 - ratio) / (1.0 - LAMINAR_RATIO);
    ratio = LAMINAR_RATIO;
  }
  double bend = (ratio - critical_ratio) / (1.0 - critical_ratio);
  double share = ratio < critical_ratio ? 1.0 : laminar * sqrt(1.0 - bend * bend);
  return (inlet > pressure ? 1.0 : -1.0) * CONDUCTANCE * up * share;
}

static double filling_psi_per_s(const Plant *plant, double rate_per_s, double inlet, double pressure) {
  const PlantParameters *p = &plant->p;
  double linear = rate_per_s * (inlet - pressure), flow = linear;
  if (p->iso6358_share > 0) {
    double real = rate_per_s * throttled(inlet, pressure, p->iso6358_critical_ratio);
    flow = linear + p->iso6358_share * (real - linear);
  }
  if (p->choked_flow_saturation_s_per_psi > 0) {
    double share = p->choked_flow_saturation_s_per_psi * fabs(flow);
    flow /= pow(1.0 + pow(share, p->choked_flow_sharpness), 1.0 / p->choked_flow_sharpness);
  }
  return flow;
}

static double lost_psi_per_s(const PlantParameters *p, double pressure) {
  double lost = p->leak_rate_per_s * pressure;
  double above = pressure - p->leak_cracking_pressure_psi;
  if (p->leak_cracking_rate_per_s > 0 && above > 0) lost += p->leak_cracking_rate_per_s * above;
  return lost;
}

void air_derivative(const Plant *plant, double time, const double *y, double *dy) {
  const PlantParameters *p = &plant->p;
  if (p->regulator_time_s > 0) dy[REGULATED] = (plant->set_point_psi - y[REGULATED]) / p->regulator_time_s;
  for (int chamber = 0; chamber < CHAMBERS; chamber++) {
    if (!chamber_in_use(plant, chamber)) continue;
    double source = supply_psi(plant, time, y, plant->source[chamber]);
    double inlet = inlet_psi(plant, y, chamber, source);
    if (p->line_lag_time_s > 0) dy[LINE + chamber] = (source - y[LINE + chamber]) / p->line_lag_time_s;
    double pressure = y[PRESSURE + chamber];
    double rate = alpha_per_s(plant, y, chamber, inlet);
    dy[PRESSURE + chamber] = filling_psi_per_s(plant, rate, inlet, pressure) - lost_psi_per_s(p, pressure);
    if (p->sensor_lag_time_s > 0) {
      dy[SENSED + chamber] = (sensed_psi(plant, time, y, chamber) - y[SENSED + chamber]) / p->sensor_lag_time_s;
    }
  }
}

// --- sensors ----------------------------------------------------------------------------------------------------

// The pressure inside is p = (F - b v) / a (paper, section III.A).
double sensed_psi(const Plant *plant, double time, const double *y, int chamber) {
  double rate, x = stroke_m(y, chamber, &rate);
  double inside = y[PRESSURE + chamber] - damping_Ns_m(plant, chamber) * rate / area_N_psi(plant, chamber, x);
  double share = plant->p.sensor_position_share;
  if (share <= 0) return inside;
  return inside + share * (supply_psi(plant, time, y, plant->source[chamber]) - inside);
}

double reading_psi(const Plant *plant, double time, const double *y, int chamber) {
  const PlantParameters *p = &plant->p;
  double seen = p->sensor_lag_time_s > 0 ? y[SENSED + chamber] : sensed_psi(plant, time, y, chamber);
  if (chamber != BODY && chamber_in_use(plant, BODY)) seen += p->sensor_crosstalk_share * y[PRESSURE + BODY];
  return (1.0 + p->sensor_calibration_gain) * seen + p->sensor_calibration_offset_psi;
}
