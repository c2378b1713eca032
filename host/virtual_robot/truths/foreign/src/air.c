// SPDX-License-Identifier: GPL-3.0-or-later
// Supplies, valves, lines, chambers and pressure sensors.
#include "inside.h"

// --- supplies ---------------------------------------------------------------------------------------------------

// Waveform of a hunting regulator: zero mean, peak about 1, period 1.
static double hunting(const ForeignRobot *r, double turns) {
  double at = turns - floor(turns), rise = r->hunt_skew;
  double up = at < rise, share = up ? at / rise : (at - rise) / (1.0 - rise);
  if (r->hunt_form == 1) return up ? 2.0 * share - 1.0 : 1.0 - 2.0 * share;
  // A relay's limit cycle: charging and discharging towards levels beyond its thresholds.
  const double bend = 1.8;
  double exponential = (1.0 - exp(-bend * share)) / (1.0 - exp(-bend));
  return up ? 2.0 * exponential - 1.0 : 1.0 - 2.0 * exponential;
}

static double unloaded(const ForeignRobot *r, double t, int source) {
  if (source == OFF) return 0.0;
  if (source == VACUUM_PUMP) return r->negative_psi;
  double psi = r->positive_psi;
  if (r->hunt_form && psi > 0) psi += r->hunt_psi * hunting(r, r->hunt_Hz * t + r->hunt_phase);
  return psi;
}

static double supplied(const Foreign *f, double t, const double *y, int source) {
  if (source == OFF || f->r->recharge_s[source - 1] <= 0) return unloaded(f->r, t, source);
  return y[RESERVOIR + source - 1];
}

// --- throat -----------------------------------------------------------------------------------------------------

// ISO 6358-1: sonic flow C p1 below the critical ratio, a quarter of an ellipse above; psi/s into the chamber.
double foreign_throat(double conductance, double critical, double source, double sink) {
  double up = fmax(source, sink) + AIR_PSI, down = fmin(source, sink) + AIR_PSI;
  if (up <= 0) return 0.0;
  double over = (fmax(down, 0.0) / up - critical) / (1.0 - critical);
  double flow = conductance * up * (over <= 0 ? 1.0 : sqrt(fmax(1.0 - over * over, 0.0)));
  return source >= sink ? flow : -flow;
}

// Pressure between the throat and the linear resistance of eq. (2) behind it, by the Illinois method.
static double between(double conductance, double critical, double alpha, double source, double sink) {
  double a = sink, b = source;
  double at_a = foreign_throat(conductance, critical, source, a), at_b = -alpha * (b - sink);
  if (fabs(source - sink) < 1e-9) return source;
  for (int i = 0, side = 0; i < 60 && fabs(b - a) > 1e-10; i++) {
    double c = (a * at_b - b * at_a) / (at_b - at_a);
    double at_c = foreign_throat(conductance, critical, source, c) - alpha * (c - sink);
    if (fabs(at_c) < 1e-10) return c;
    if ((at_c > 0) == (at_b > 0)) {
      b = c;
      at_b = at_c;
      if (side == -1) at_a *= 0.5;
      side = -1;
    } else {
      a = c;
      at_a = at_c;
      if (side == 1) at_b *= 0.5;
      side = 1;
    }
  }
  return 0.5 * (a + b);
}

// --- chambers ---------------------------------------------------------------------------------------------------

// Volume relative to the body's; an end of the robot has three actuators.
static double volume(const Foreign *f, int chamber) {
  if (chamber == 0) return 1.0;
  const ForeignRobot *r = f->r;
  double number = f->trial->experiment == STEP || f->trial->experiment == STATIC ? 1.0 : ACTUATORS_PER_END;
  return number * r->area_N_psi[1] * r->spring[1].extended_m / (r->area_N_psi[0] * r->spring[0].extended_m);
}

static double filling_psi_s(const Foreign *f, double t, double alpha, double inlet, double pressure, int chamber) {
  const ForeignRobot *r = f->r;
  double open = 1.0;
  if (r->opening_s > 0) open = fmin(fmax((t - f->opened_s[chamber]) / r->opening_s, 0.0), 1.0);
  if (r->throat_per_s > 0) {
    double conductance = r->throat_per_s / (r->throat_by_volume ? volume(f, chamber) : 1.0);
    inlet = between(conductance, r->throat_ratio, alpha, inlet, pressure);
  }
  return open * alpha * (inlet - pressure);
}

static double lost_psi_s(const ForeignRobot *r, double pressure) {
  const double full = 8.5;
  double lost = r->orifice_per_s * pressure * sqrt(full / (fabs(pressure) + 0.05));
  if (r->check_per_s > 0 && pressure > r->check_psi)
    lost += r->check_per_s * (pressure - r->check_psi) * full / (full - r->check_psi);
  return lost;
}

static double inlet_of(const Foreign *f, const double *y, int chamber, double source) {
  if (f->r->line_form == 0) return source;
  return y[CELL + 3 * chamber + (f->r->line_form == 2 ? 2 : 0)];
}

static void line(const Foreign *f, const double *y, double *dy, int chamber, double source) {
  const ForeignRobot *r = f->r;
  const double *cell = y + CELL + 3 * chamber;
  double *d = dy + CELL + 3 * chamber;
  if (r->line_form == 1) {
    double omega = 2.0 * r->line_damping / r->line_s;
    d[0] = cell[1];
    d[1] = omega * omega * (source - cell[0]) - 2.0 * r->line_damping * omega * cell[1];
  } else if (r->line_form == 2) {
    double rate = 6.0 / r->line_s;  // the Elmore delay of three equal cells is six times that of one
    d[0] = rate * (source - 2.0 * cell[0] + cell[1]);
    d[1] = rate * (cell[0] - 2.0 * cell[1] + cell[2]);
    d[2] = rate * (cell[1] - cell[2]);
  }
}

// --- sensors ----------------------------------------------------------------------------------------------------

static double at_the_sensor(const Foreign *f, double t, const double *y, int chamber) {
  const ForeignRobot *r = f->r;
  double v, x = foreign_stroke(f, y, chamber, &v);
  double inside = (y[FORCE + chamber] - foreign_damping(f, y, chamber) * v) / foreign_area(f, chamber, x);
  if (r->thermal_share > 0) inside += y[HEAT + chamber];
  if (r->drop_share <= 0) return inside;
  const double usual = 12.0;  // psi of drop at which the share is drop_share
  double drop = supplied(f, t, y, f->source[chamber]) - inside;
  return inside + r->drop_share * drop * pow(fabs(drop) / usual, r->drop_power - 1.0);
}

static void sensor(const Foreign *f, double t, const double *y, double *dy, int chamber) {
  const ForeignRobot *r = f->r;
  const double *s = y + SENSOR + 2 * chamber;
  double off = at_the_sensor(f, t, y, chamber) - s[0];
  if (r->sensor_form == 1) {
    double omega = 2.0 * r->sensor_damping / r->sensor_s;
    dy[SENSOR + 2 * chamber] = s[1];
    dy[SENSOR + 2 * chamber + 1] = omega * omega * off - 2.0 * r->sensor_damping * omega * s[1];
  } else {  // an orifice before the sensor's volume: flow goes as the root of the drop; laminar below 0.05 psi
    dy[SENSOR + 2 * chamber] = off / r->sensor_s * sqrt(1.0 / (fabs(off) + 0.05));
  }
}

double foreign_reading(const Foreign *f, const double *y, int chamber) {
  return f->r->sensor_form ? y[SENSOR + 2 * chamber] : at_the_sensor(f, f->t, y, chamber);
}

// --- derivative -------------------------------------------------------------------------------------------------

// Eq. (2) in the paper's form, for the force. Called after the mechanics.
void foreign_air(const Foreign *f, double t, const double *y, double *dy) {
  const ForeignRobot *r = f->r;
  double drawn[2] = {0, 0};
  for (int chamber = 0; chamber < 3; chamber++) {
    if (!in_use(f, chamber)) continue;
    int source = f->source[chamber], size = kind(chamber);
    double x = foreign_stroke(f, y, chamber, NULL), area = foreign_area(f, chamber, x);
    double pressure = y[FORCE + chamber] / area, psi = supplied(f, t, y, source);
    line(f, y, dy, chamber, psi);
    // Eq. (3): a bulged pouch empties slowly.
    bool bulged = source == VACUUM_PUMP && x > r->spring[size].unstable_m;
    double alpha = bulged ? r->alpha_s_per_s[size] : r->alpha_n_per_s[size];
    double filling = filling_psi_s(f, t, alpha, inlet_of(f, y, chamber, psi), pressure, chamber);
    if (source != OFF) drawn[source - 1] += volume(f, chamber) * filling;
    double rate = filling - lost_psi_s(r, pressure);
    dy[FORCE + chamber] = area * rate;
    if (r->thermal_share > 0) dy[HEAT + chamber] = r->thermal_share * rate - y[HEAT + chamber] / r->thermal_s;
    if (r->sensor_form) sensor(f, t, y, dy, chamber);
  }
  for (int i = 0; i < 2; i++) {
    if (r->recharge_s[i] <= 0) continue;
    double lack = unloaded(r, t, i + 1) - y[RESERVOIR + i];
    dy[RESERVOIR + i] = lack / r->recharge_s[i] - r->reservoir_share[i] * drawn[i];
  }
}
