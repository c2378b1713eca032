// SPDX-License-Identifier: GPL-3.0-or-later
// Dormand and Prince's pair of order 5(4) with step-size control and dense output (E. Hairer, S. P. Norsett,
// G. Wanner, Solving Ordinary Differential Equations I, 1993, II.4 to II.6). Times at which the equations change
// (a half stops or breaks away, a wall is met, a pouch begins to bulge) are located on the dense output, and the next
// step begins there; steps also end at every valve edge and every turn of the cross-head.
#include <string.h>

#include "inside.h"

#define SETTLE_S 16.0
#define MAX_STEPS 4000000.0

enum { HOLD = 0, CONTACT = 2, BULGE = 4, BREAK = 7, LET_GO = 8, EVENTS = LET_GO + 3 };

typedef struct Step {
  double h, t, y0[SIZE], y1[SIZE], k[7][SIZE], dense[5][SIZE];
} Step;

static void derivative(Foreign *f, double t, const double *y, double *dy) {
  memset(dy, 0, SIZE * sizeof *dy);
  foreign_mechanics(f, y, dy);
  foreign_air(f, t, y, dy);
}

// --- one step ---------------------------------------------------------------------------------------------------

static const double A[7][6] = {
    {0},
    {1.0 / 5},
    {3.0 / 40, 9.0 / 40},
    {44.0 / 45, -56.0 / 15, 32.0 / 9},
    {19372.0 / 6561, -25360.0 / 2187, 64448.0 / 6561, -212.0 / 729},
    {9017.0 / 3168, -355.0 / 33, 46732.0 / 5247, 49.0 / 176, -5103.0 / 18656},
    {35.0 / 384, 0, 500.0 / 1113, 125.0 / 192, -2187.0 / 6784, 11.0 / 84},
};
static const double C[7] = {0, 1.0 / 5, 3.0 / 10, 4.0 / 5, 8.0 / 9, 1, 1};
static const double E[7] = {71.0 / 57600, 0, -71.0 / 16695, 71.0 / 1920, -17253.0 / 339200, 22.0 / 525, -1.0 / 40};
static const double D[7] = {-12715105075.0 / 11282082432,  0,
                            87487479700.0 / 32700410799,   -10690763975.0 / 1880347072,
                            701980252875.0 / 199316789632, -1453857185.0 / 822651844,
                            69997945.0 / 29380423};

static double allowed_error(int i) {
  if (i < MOMENTUM || (i >= X_ACT && i < P_ACT)) return 1e-8;         // m
  if (i < X_ACT) return 1e-7;                                         // kg m/s
  if (i < FORCE) return 2e-8;                                         // kg m/s, small actuators
  if (i >= PRONY && i < SENSOR) return 1e-4;                          // N
  if (i >= BOUC && i < PRONY) return 1e-5;                            // dimensionless
  if (i >= CREEP) return 1e-8;                                        // m
  if (i >= SENSOR && i < RESERVOIR && (i - SENSOR) % 2) return 1e-2;  // psi/s
  if (i >= CELL && i < BOUC && (i - CELL) % 3 == 1) return 1e-3;      // psi or psi/s
  return 1e-4;                                                        // N, psi
}

// Attempts a step, given k[0]; returns its error relative to the allowed error.
static double attempt(Foreign *f, Step *s) {
  double at[SIZE];
  for (int stage = 1; stage < 7; stage++) {
    for (int i = 0; i < SIZE; i++) {
      double sum = 0;
      for (int j = 0; j < stage; j++) sum += A[stage][j] * s->k[j][i];
      at[i] = s->y0[i] + s->h * sum;
    }
    derivative(f, s->t + C[stage] * s->h, at, s->k[stage]);
  }
  memcpy(s->y1, at, sizeof at);
  double worst = 0;
  for (int i = 0; i < SIZE; i++) {
    double error = 0;
    for (int j = 0; j < 7; j++) error += E[j] * s->k[j][i];
    double scale = f->trial->tolerance * (allowed_error(i) + 1e-6 * fmax(fabs(s->y0[i]), fabs(s->y1[i])));
    double ratio = fabs(s->h * error) / scale;
    if (!isfinite(ratio)) return INFINITY;
    worst = fmax(worst, ratio);
  }
  return worst;
}

static void prepare_dense(Step *s) {
  for (int i = 0; i < SIZE; i++) {
    double change = s->y1[i] - s->y0[i], bend = s->h * s->k[0][i] - change, last = 0;
    for (int j = 0; j < 7; j++) last += D[j] * s->k[j][i];
    s->dense[0][i] = s->y0[i];
    s->dense[1][i] = change;
    s->dense[2][i] = bend;
    s->dense[3][i] = change - s->h * s->k[6][i] - bend;
    s->dense[4][i] = s->h * last;
  }
}

static void at_share(const Step *s, double share, double *y) {
  double rest = 1.0 - share;
  for (int i = 0; i < SIZE; i++) {
    const double(*d)[SIZE] = s->dense;
    y[i] = d[0][i] + share * (d[1][i] + rest * (d[2][i] + share * (d[3][i] + rest * d[4][i])));
  }
}

// --- events -----------------------------------------------------------------------------------------------------

static void event_values(const Foreign *f, double t, const double *y, double *g) {
  for (int i = 0; i < EVENTS; i++) g[i] = 1.0;
  for (int chamber = 0; chamber < 3 && f->r->gap_m > 0; chamber++) {
    if (!in_use(f, chamber)) continue;  // event: the mechanism lets go of one side and meets the other
    double here = foreign_against(f, y, chamber, f->side[chamber]);
    g[LET_GO + chamber] = fmax(here, -foreign_against(f, y, chamber, -f->side[chamber]));
  }
  const ForeignTrial *trial = f->trial;
  if (trial->experiment == STATIC) return;
  for (int end = 0; end < 2; end++) {
    if (trial->experiment == STEP || (trial->experiment == PULL && end == 1)) continue;
    g[CONTACT + end] = foreign_contact_depth(f, y, end);
    if (trial->experiment != WALK) continue;
    if (f->slide[end]) {
      g[HOLD + end] = f->slide[end] * y[MOMENTUM + end];
    } else {
      double pull = foreign_pull(f, y, end);
      g[HOLD + end] = foreign_grip(f, y, end, pull > 0 ? 1 : -1, 0.0, true) - fabs(pull);
    }
  }
  for (int chamber = 0; chamber < 3; chamber++) {
    if (!in_use(f, chamber) || f->source[chamber] != VACUUM_PUMP) continue;
    g[BULGE + chamber] = foreign_stroke(f, y, chamber, NULL) - f->r->spring[kind(chamber)].unstable_m;
  }
  if (trial->experiment == PULL && !f->loose && t >= 0) {
    g[BREAK] = foreign_grip(f, y, 0, 1, 0.0, true) - foreign_load(f, t, f->slid_m);
  }
}

static bool happens(int event, double before, double now) {
  if (event < CONTACT || event >= BREAK) return now < 0;
  return (before < 0) != (now < 0);
}

// Returns the share of the step after which the first event has happened, and which one; 1 and -1 if there is none.
static double first_event(const Foreign *f, const Step *s, int *which) {
  double before[EVENTS], after[EVENTS], y[SIZE], now[EVENTS], first = 1.0;
  event_values(f, s->t, s->y0, before);
  event_values(f, s->t + s->h, s->y1, after);
  *which = -1;
  for (int i = 0; i < EVENTS; i++) {
    if (!happens(i, before[i], after[i])) continue;
    double low = 0.0, high = 1.0;
    for (int k = 0; k < 48 && (high - low) * s->h > 1e-12; k++) {
      double middle = 0.5 * (low + high);
      at_share(s, middle, y);
      event_values(f, s->t + middle * s->h, y, now);
      if (happens(i, before[i], now[i])) {
        high = middle;
      } else {
        low = middle;
      }
    }
    if (*which < 0 || high < first) {
      first = high;
      *which = i;
    }
  }
  return first;
}

static void stop_or_go(Foreign *f, int end) {
  f->y[MOMENTUM + end] = 0.0;
  double pull = foreign_pull(f, f->y, end);
  int direction = pull > 0 ? 1 : -1;
  f->slide[end] = fabs(pull) <= foreign_grip(f, f->y, end, direction, 0.0, true) ? 0 : direction;
}

static void follow_the_pull(Foreign *f) {
  double rate;
  foreign_crosshead(f, f->t, &rate);
  if (f->trial->experiment != PULL || !f->loose || rate <= 0) return;
  for (int i = 0; i < 60; i++) {
    double lack = foreign_load(f, f->t, f->slid_m) - foreign_grip(f, f->y, 0, 1, rate, false);
    if (lack <= 1e-7) break;
    f->slid_m += lack / f->r->load_cell_N_m;
  }
}

static double clip(double value, double half, double middle) { return fmin(fmax(value, middle - half), middle + half); }

// Updates plays and slips for the new stroke.
static void remember(Foreign *f) {
  for (int chamber = 0; chamber < 3; chamber++) {
    if (!in_use(f, chamber)) continue;
    double x = foreign_stroke(f, f->y, chamber, NULL);
    for (int i = 0; i < 3; i++) f->play[chamber][i] = clip(f->play[chamber][i], f->r->play_m[i], x);
    for (int i = 0; i < 4; i++) {
      f->slip[chamber][i] = clip(f->slip[chamber][i] + x - f->anchor[chamber], f->r->slip_m[i], 0.0);
    }
    f->anchor[chamber] = x;
  }
}

// --- running a trial --------------------------------------------------------------------------------------------

static void sample_at(const Foreign *f, const Step *s, double t, ForeignSample *out) {
  Foreign now = *f;
  if (s->h > 0) {
    at_share(s, fmin(fmax((t - s->t) / s->h, 0.0), 1.0), now.y);
  }
  now.t = t;
  const double *y = now.y;
  memset(out, 0, sizeof *out);
  const ForeignTrial *trial = f->trial;
  double rate;
  out->crosshead_m = foreign_crosshead(&now, t, &rate);
  out->head_m = trial->experiment == STEP && trial->chamber ? y[X_ACT + trial->chamber - 1] : y[X];
  out->tail_m = y[X + 1];
  for (int end = 0; end < 2; end++) {
    out->small_m[end] = y[X_ACT + end];
    out->sliding[end] = f->slide[end];
  }
  for (int chamber = 0; chamber < 3; chamber++) {
    if (in_use(f, chamber)) out->pressure_psi[chamber] = foreign_reading(&now, y, chamber);
  }
  if (trial->experiment == STATIC) out->force_N = -foreign_push(&now, y, trial->chamber);
  if (trial->experiment == PULL) {
    out->force_N = f->loose && rate > 0 ? foreign_grip(&now, y, 0, 1, rate, false) : foreign_load(&now, t, f->slid_m);
  }
  if (trial->experiment == STEP && trial->chamber == 0) out->energy_J = foreign_energy(&now, y);
}

static double next_turn(const Foreign *f) {
  const ForeignTrial *trial = f->trial;
  if (trial->rate_m_s <= 0) return INFINITY;
  double leg = trial->travel_m / trial->rate_m_s;
  for (int i = 0; i <= 2; i++) {
    if (i * leg > f->t + 1e-12) return i * leg;
  }
  return INFINITY;
}

typedef struct Outlet {
  const double *times;
  int count, done;
  ForeignSample *samples;
} Outlet;

// Integrates to `end`, with no valve edge or turn in between. Returns false if it gets stuck.
static bool advance(Foreign *f, double end, double *try_s, Outlet *out) {
  const double longest = f->trial->experiment == STATIC ? 0.05 : f->t < 0 ? 0.02 : 0.005;
  Step s;
  bool known = false;
  while (end - f->t > 1e-12) {
    if (!known) derivative(f, f->t, f->y, s.k[0]);
    memcpy(s.y0, f->y, sizeof s.y0);
    s.t = f->t;
    double left = end - f->t, wanted = fmin(*try_s, longest);
    s.h = left <= wanted ? left : left < 2.0 * wanted ? 0.5 * left : wanted;
    double error = attempt(f, &s);
    double factor = isfinite(error) ? 0.9 * pow(fmax(error, 1e-8), -0.2) : 0.1;
    *try_s = s.h * fmin(fmax(factor, 0.2), 5.0);
    if (++f->trial->steps > MAX_STEPS) return false;
    known = true;  // k[0] still belongs to this state
    if (!(error <= 1.0)) {
      if (s.h < 1e-11) return false;
      continue;
    }
    prepare_dense(&s);
    int which;
    double share = first_event(f, &s, &which);
    double reached = which < 0 ? (left == s.h ? end : s.t + s.h) : s.t + share * s.h;
    while (out != NULL && out->done < out->count && out->times[out->done] <= reached + 1e-12) {
      sample_at(f, &s, out->times[out->done], &out->samples[out->done]);
      out->done++;
    }
    if (which < 0) {
      memcpy(f->y, s.y1, sizeof f->y);
      memcpy(s.k[0], s.k[6], sizeof s.k[0]);
    } else {
      at_share(&s, share, f->y);
      known = false;
      *try_s = fmin(*try_s, 1e-3);
    }
    f->t = reached;
    remember(f);
    if (which == HOLD || which == HOLD + 1) stop_or_go(f, which - HOLD);
    if (which == BREAK) f->loose = true;
    if (which >= LET_GO) f->side[which - LET_GO] *= -1;
    follow_the_pull(f);
  }
  f->t = end;
  return true;
}

static void switch_valves(Foreign *f, const ForeignEdge *edges, int count, int *next) {
  while (*next < count && edges[*next].time_s <= f->t + 1e-12) {
    const ForeignEdge *edge = &edges[(*next)++];
    if (f->source[edge->chamber] != edge->source) f->opened_s[edge->chamber] = f->t;
    f->source[edge->chamber] = edge->source;
  }
}

// Contracted, with `start` just connected.
static void place(Foreign *f) {
  const ForeignRobot *r = f->r;
  f->t = -SETTLE_S;
  if (f->trial->experiment == PULL) f->y[X_ACT] = r->wall_offset_m;  // already extended by pressure
  f->y[RESERVOIR] = r->positive_psi;
  f->y[RESERVOIR + 1] = r->negative_psi;
  for (int i = 0; i < 2; i++) f->y[CREEP + i] = f->trial->creep_m[i];
  for (int chamber = 0; chamber < 3; chamber++) {
    f->source[chamber] = in_use(f, chamber) ? f->trial->start : OFF;
    f->opened_s[chamber] = f->t;
    f->anchor[chamber] = foreign_stroke(f, f->y, chamber, NULL);
    f->side[chamber] = 1;
    for (int i = 0; i < 3; i++) f->play[chamber][i] = f->anchor[chamber];
  }
}

int foreign_run(const ForeignRobot *robot, ForeignTrial *trial, const ForeignEdge *edges, int edge_count,
                const double *times_s, int count, ForeignSample *samples) {
  Foreign f = {.r = robot, .trial = trial};
  Outlet out = {times_s, count, 0, samples};
  trial->steps = 0;
  place(&f);
  double try_s = 1e-4;
  if (!advance(&f, 0.0, &try_s, NULL)) return 1;
  memset(f.y + PRONY, 0, 15 * sizeof *f.y);  // relaxed after a long rest
  f.y[WARMTH] = 0;
  int next = 0;
  while (out.done < count) {
    switch_valves(&f, edges, edge_count, &next);
    double until = fmin(times_s[count - 1], next_turn(&f));
    if (next < edge_count) until = fmin(until, edges[next].time_s);
    if (until <= f.t + 1e-12) {  // at the last sample
      Step none = {.h = 0};
      while (out.done < count) sample_at(&f, &none, f.t, &samples[out.done++]);
      break;
    }
    try_s = fmin(try_s, 1e-3);
    if (!advance(&f, until, &try_s, &out)) return 1;
  }
  for (int i = 0; i < 2; i++) trial->creep_m[i] = f.y[CREEP + i];
  return 0;
}
