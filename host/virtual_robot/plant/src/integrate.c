// SPDX-License-Identifier: GPL-3.0-or-later
// Classical Runge-Kutta steps, split wherever the equations change: a half stops or breaks away, an actuator meets or
// leaves the wall, a stroke passes the point where the pouch bulges.
#include <math.h>
#include <string.h>

#include "parts.h"

enum { SLIDE_HEAD, SLIDE_TAIL, WALL_HEAD, WALL_TAIL, BULGE_BODY, BULGE_HEAD, BULGE_TAIL, EVENTS };
#define MAX_CUTS 16
#define SLOW_M_S 0.01
#define SLOW_FACTOR 8.0

static void derivative(const Plant *plant, double time, const double *y, double *dy) {
  memset(dy, 0, STATES * sizeof *dy);
  air_derivative(plant, time, y, dy);
  mechanics_derivative(plant, y, dy);
}

static void runge_kutta(const Plant *plant, double h, double *next) {
  const double *y = plant->y, t = plant->time;
  double k1[STATES], k2[STATES], k3[STATES], k4[STATES], at[STATES];
  derivative(plant, t, y, k1);
  for (int i = 0; i < STATES; i++) at[i] = y[i] + 0.5 * h * k1[i];
  derivative(plant, t + 0.5 * h, at, k2);
  for (int i = 0; i < STATES; i++) at[i] = y[i] + 0.5 * h * k2[i];
  derivative(plant, t + 0.5 * h, at, k3);
  for (int i = 0; i < STATES; i++) at[i] = y[i] + h * k3[i];
  derivative(plant, t + h, at, k4);
  for (int i = 0; i < STATES; i++) next[i] = y[i] + h / 6.0 * (k1[i] + 2 * k2[i] + 2 * k3[i] + k4[i]);
}

// Sliding: speed in the direction of sliding. Sticking: static friction left before the half breaks away.
static double hold_margin(const Plant *plant, const double *y, int end) {
  Slide slide = plant->slide[end];
  if (slide != STICK) return slide * y[end ? V_TAIL : V_HEAD];
  double pull = pull_without_friction(plant, y, end);
  return static_grip(plant, y, end, pull > 0 ? 1 : -1) - fabs(pull);
}

static void event_values(const Plant *plant, const double *y, double *g) {
  for (int i = 0; i < EVENTS; i++) g[i] = 1.0;
  if (plant->experiment == STATIC_LOADING) return;
  for (int end = 0; end < 2; end++) {
    if (plant->experiment == LOCOMOTION) g[SLIDE_HEAD + end] = hold_margin(plant, y, end);
    if (plant->experiment != STEP_RESPONSE) g[WALL_HEAD + end] = y[X_SMALL + end] - plant->p.wall_offset_m;
  }
  for (int chamber = 0; chamber < CHAMBERS; chamber++) {
    if (!chamber_in_use(plant, chamber)) continue;
    g[BULGE_BODY + chamber] = stroke_m(y, chamber, NULL) - plant->spring[chamber != BODY].unstable;
  }
}

// A half that stops sticks, unless the pull exceeds its static friction.
static void stop_or_break_away(Plant *plant, int end) {
  int v = end ? V_TAIL : V_HEAD;
  plant->y[v] = 0.0;
  double pull = pull_without_friction(plant, plant->y, end);
  double direction = pull > 0 ? 1 : -1;
  bool held = fabs(pull) <= static_grip(plant, plant->y, end, direction);
  plant->slide[end] = held ? STICK : (Slide)direction;
}

static void accept(Plant *plant, const double *next, double h) {
  memcpy(plant->y, next, sizeof plant->y);
  plant->time += h;
  double half = 0.5 * plant->p.backlash_gap_m;
  for (int chamber = 0; half > 0 && chamber < CHAMBERS; chamber++) {
    double x = stroke_m(plant->y, chamber, NULL);
    plant->play[chamber] = fmin(fmax(plant->play[chamber], x - half), x + half);
  }
}

static void step(Plant *plant, double h) {
  bool cut[EVENTS] = {false};
  double before[EVENTS], after[EVENTS], next[STATES];
  for (int cuts = 0; h > 0; cuts++) {
    event_values(plant, plant->y, before);
    runge_kutta(plant, h, next);
    event_values(plant, next, after);
    int first = -1;
    double share = 1.0;
    for (int i = 0; i < EVENTS && cuts < MAX_CUTS; i++) {
      bool is_slide = i <= SLIDE_TAIL;
      bool crossed = is_slide ? after[i] < 0 : (before[i] < 0) != (after[i] < 0) && !cut[i];
      if (!crossed) continue;
      double at = before[i] == after[i] ? 0.0 : before[i] / (before[i] - after[i]);
      at = fmin(fmax(at, 0.0), 1.0);
      if (first < 0 || at < share) {
        first = i;
        share = at;
      }
    }
    if (first < 0) {
      accept(plant, next, h);
      return;
    }
    if (share > 0) {
      runge_kutta(plant, share * h, next);
      accept(plant, next, share * h);
      h -= share * h;
    }
    if (first <= SLIDE_TAIL) {
      // Both halves of a symmetric robot break away together, not one before the other.
      bool together = first == SLIDE_HEAD && after[SLIDE_TAIL] < 0 && plant->slide[0] == STICK &&
                      plant->slide[1] == STICK && fabs(before[SLIDE_TAIL] - before[SLIDE_HEAD]) < 1e-9;
      stop_or_break_away(plant, first);
      if (together) plant->slide[1] = plant->slide[0] == STICK ? STICK : -plant->slide[0];
    } else {
      cut[first] = true;
    }
  }
}

// The testing machine prescribes the position of the actuator's end.
static void follow_crosshead(Plant *plant) {
  if (plant->experiment != STATIC_LOADING) return;
  double rate;
  crosshead_m(plant, plant->time + 1e-9, &rate);
  int x = plant->chamber == BODY ? X_HEAD : X_SMALL, v = plant->chamber == BODY ? V_HEAD : V_SMALL;
  plant->y[x] = plant->spring[plant->chamber != BODY].contracted + crosshead_m(plant, plant->time, NULL);
  plant->y[v] = rate;
}

// The load cell stretches until the head breaks away; then the head follows at kinetic friction.
static void follow_pull(Plant *plant) {
  if (plant->experiment != ANCHOR_PULL) return;
  double rate, pulled = crosshead_m(plant, plant->time, &rate) - plant->p.backlash_gap_m;
  double stretch = pulled - plant->pulled_m;
  if (!plant->pulled_loose && plant->p.load_cell_N_m * stretch > static_grip(plant, plant->y, 0, 1)) {
    plant->pulled_loose = true;
  }
  if (plant->pulled_loose && rate > 0) {
    double grip = kinetic_grip(plant, plant->y, 0, 1, rate) + plant->p.viscous_drag_Ns_m * rate;
    plant->pulled_m = fmax(plant->pulled_m, pulled - grip / plant->p.load_cell_N_m);
  }
}

// Long steps are accurate while nothing moves fast; at the fastest rate (2.4e3 1/s) they are still stable.
static double allowed_step(const Plant *plant) {
  const double *y = plant->y;
  if (plant->experiment == STATIC_LOADING) return plant->step;
  double fastest = fmax(fmax(fabs(y[V_HEAD]), fabs(y[V_TAIL])), fmax(fabs(y[V_SMALL]), fabs(y[V_SMALL + 1])));
  return fastest < SLOW_M_S ? SLOW_FACTOR * plant->step : plant->step;
}

void integrate(Plant *plant, double duration) {
  double end = plant->time + duration;
  while (plant->time < end - 1e-12) {
    switch_valves(plant);
    follow_crosshead(plant);
    double until = fmin(end, fmin(next_switching(plant), next_turn(plant)));
    double left;
    while ((left = until - plant->time) > 1e-12) {
      double allowed = allowed_step(plant);
      step(plant, left <= allowed ? left : left < 2 * allowed ? 0.5 * left : allowed);
      follow_pull(plant);
    }
    plant->time = until;
  }
  plant->time = end;  // a valve that switches at this instant takes effect in the next call
  follow_crosshead(plant);
}
