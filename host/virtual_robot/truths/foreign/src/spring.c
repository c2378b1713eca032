// SPDX-License-Identifier: GPL-3.0-or-later
// The bistable spring and the elements with memory of its motion.
#include "inside.h"

// `crept`: creep of the pouch, which shifts the stop at the extended end only.
double foreign_spring(const ForeignSpring *s, double x, double crept) {
  double from_truss = x + s->zero_m, w = from_truss - s->rise_m;
  double bar = hypot(s->half_span_m, w), free_bar = hypot(s->half_span_m, s->rise_m);
  double truss = 2.0 * s->bar_N_m * (bar - free_bar) * w / bar;
  double turned = atan2(w, s->half_span_m) - s->hinge_rest_rad;
  double hinge = s->hinge_Nm * turned * s->half_span_m / (bar * bar);
  double inner = -s->stop_in_N * exp(-from_truss / s->stop_in_m);
  double outer = s->stop_out_N * exp((from_truss - 2.0 * s->rise_m - crept) / s->stop_out_m);
  return truss + hinge + inner + outer;
}

static double clip(double value, double low, double high) { return value < low ? low : value > high ? high : value; }

static double crept(const double *y, int chamber) { return y[CREEP + kind(chamber)]; }

// Nordin and Gutman's dead zone between the actuator's end and a massless mechanism. Returns the mechanism's force
// against one side of it (1: the end pulls it outwards); negative if it would let go.
double foreign_against(const Foreign *f, const double *y, int chamber, int side) {
  double x = foreign_stroke(f, y, chamber, NULL) - 0.5 * side * f->r->gap_m;
  return side * foreign_spring(&f->r->spring[kind(chamber)], x, crept(y, chamber));
}

static double spring_with_play(const Foreign *f, const double *y, int chamber, double x) {
  const ForeignRobot *r = f->r;
  if (r->gap_m > 0) return f->side[chamber] * fmax(foreign_against(f, y, chamber, f->side[chamber]), 0.0);
  const ForeignSpring *s = &r->spring[kind(chamber)];
  if (r->play_m[0] <= 0) return foreign_spring(s, x, crept(y, chamber));
  double at = 0;
  for (int i = 0; i < 3; i++) at += clip(f->play[chamber][i], x - r->play_m[i], x + r->play_m[i]) / 3.0;
  return foreign_spring(s, at, crept(y, chamber));
}

static double slipping(const Foreign *f, int chamber, double x) {
  const ForeignRobot *r = f->r;
  double sum = 0;
  for (int i = 0; i < 4; i++) {
    double yield = r->slip_m[i], at = clip(f->slip[chamber][i] + x - f->anchor[chamber], -yield, yield);
    sum += r->slip_share[i] * at / yield;
  }
  return r->slip_N[kind(chamber)] * sum;
}

double foreign_damping(const Foreign *f, const double *y, int chamber) {
  // Contract: a static loading is slow enough for the air to move freely.
  if (f->trial->experiment == STATIC || f->trial->frictionless) return 0.0;
  double b = f->r->damping_Ns_m[kind(chamber)];
  if (f->r->warm_share > 0 && chamber == 0) b *= fmax(1.0 - f->r->warm_share * y[WARMTH], 0.3);
  return b;
}

static double pouch_shape(double share) {  // chord of an inflating pouch over its arc
  double angle = 0.5 * M_PI * (1.0 - share), edge = 2.0 / M_PI;
  double sinc = fabs(angle) < 1e-6 ? 1.0 : sin(angle) / angle;
  return (sinc - edge) / (1.0 - edge);
}

double foreign_area(const Foreign *f, int chamber, double x) {
  const ForeignRobot *r = f->r;
  double area = r->area_N_psi[kind(chamber)];
  if (r->area_slope == 0) return area;
  double share = clip(x / r->spring[kind(chamber)].extended_m, -0.15, 1.15);
  double shape = r->area_form == 1 ? pouch_shape(share) : share * share;
  return area * (1.0 + r->area_slope * shape);
}

// The force that pushes an actuator's ends apart.
double foreign_push(const Foreign *f, const double *y, int chamber) {
  const ForeignRobot *r = f->r;
  double v, x = foreign_stroke(f, y, chamber, &v);
  double push = y[FORCE + chamber] - foreign_damping(f, y, chamber) * v - spring_with_play(f, y, chamber, x);
  if (r->thermal_share > 0) push += foreign_area(f, chamber, x) * y[HEAT + chamber];
  if (r->bouc_m > 0) push -= r->bouc_N[kind(chamber)] * y[BOUC + chamber];
  if (r->slip_m[0] > 0) push -= slipping(f, chamber, x);
  if (r->prony_s[0] > 0) {
    for (int i = 0; i < 5; i++) push -= y[PRONY + 5 * chamber + i];
  }
  return push;
}

static void memory(const Foreign *f, const double *y, double *dy, int chamber) {
  const ForeignRobot *r = f->r;
  double v, x = foreign_stroke(f, y, chamber, &v);
  if (r->bouc_m > 0) {
    double z = y[BOUC + chamber], size = pow(fabs(z), r->bouc_power);
    double along = r->bouc_beta * fabs(v) * (z < 0 ? -size : size) + (1.0 - r->bouc_beta) * v * size;
    dy[BOUC + chamber] = (v - along) / r->bouc_m;
  }
  if (r->prony_s[0] > 0) {
    for (int i = 0; i < 5; i++) {
      int k = PRONY + 5 * chamber + i;
      if (r->prony_s[i] > 0) dy[k] = r->prony_N_m[kind(chamber)] * r->prony_share[i] * v - y[k] / r->prony_s[i];
    }
  }
  if (r->creep_m_s > 0 && chamber < 2) {
    double over = y[FORCE + chamber] / foreign_area(f, chamber, x) / r->creep_psi - 1.0;
    double done = y[CREEP + chamber] / (r->creep_limit_m * (chamber ? 0.5 : 1.0));
    if (over > 0 && done < 1) dy[CREEP + chamber] = r->creep_m_s * (chamber ? 0.5 : 1.0) * over * (1.0 - done);
  }
  if (r->warm_share > 0 && chamber == 0) {
    dy[WARMTH] = (r->damping_Ns_m[0] * v * v / r->warm_W - y[WARMTH]) / r->warm_s;
  }
}

static void actuator(const Foreign *f, const double *y, double *dy, int end) {
  dy[X_ACT + end] = y[P_ACT + end] / f->r->small_mass_kg;
  dy[P_ACT + end] = foreign_push(f, y, 1 + end) - foreign_wall(f, y, end);
}

void foreign_mechanics(const Foreign *f, const double *y, double *dy) {
  double rate;
  switch (f->trial->experiment) {
    case WALK:
      for (int end = 0; end < 2; end++) {
        actuator(f, y, dy, end);
        if (f->slide[end] == 0) continue;
        double v = y[MOMENTUM + end] / f->r->half_mass_kg[end];
        dy[X + end] = v;
        dy[MOMENTUM + end] =
            foreign_pull(f, y, end) - f->slide[end] * foreign_grip(f, y, end, f->slide[end], fabs(v), false);
      }
      break;
    case STEP:
      if (f->trial->chamber != 0) {
        actuator(f, y, dy, f->trial->chamber - 1);
      } else {
        dy[X] = y[MOMENTUM] / f->r->stand_mass_kg;
        dy[MOMENTUM] = foreign_push(f, y, 0);
      }
      break;
    case STATIC:
      foreign_crosshead(f, f->t, &rate);  // constant over a step
      dy[f->trial->chamber == 0 ? X : X_ACT] = rate;
      break;
    default:
      actuator(f, y, dy, 0);
  }
  for (int chamber = 0; chamber < 3; chamber++) {
    if (in_use(f, chamber)) memory(f, y, dy, chamber);
  }
}

double foreign_energy(const Foreign *f, const double *y) {
  // Simpson's rule from the contracted state; only needed for the body on the stand.
  double x = foreign_stroke(f, y, 0, NULL), h = x / 400.0, sum = 0;
  for (int i = 0; i <= 400; i++) {
    double weight = i == 0 || i == 400 ? 1.0 : i % 2 ? 4.0 : 2.0;
    sum += weight * foreign_spring(&f->r->spring[0], i * h, 0.0);
  }
  return 0.5 * y[MOMENTUM] * y[MOMENTUM] / f->r->stand_mass_kg + sum * h / 3.0;
}
