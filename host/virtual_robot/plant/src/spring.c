// SPDX-License-Identifier: GPL-3.0-or-later
// The bistable spring as a table with a cubic spline through it (parabolic run-out), extrapolated linearly.
#include <math.h>
#include <string.h>

#include "parts.h"

static double root_between(const Spring *spring, double low, double high) {
  double at_low = spring_force(spring, low);
  for (int i = 0; i < 80; i++) {
    double middle = 0.5 * (low + high), force = spring_force(spring, middle);
    if ((force < 0) == (at_low < 0)) {
      low = middle;
    } else {
      high = middle;
    }
  }
  return 0.5 * (low + high);
}

// The three equilibria: the force rises through zero at the stable ones and falls through it at the unstable one.
static void find_landmarks(Spring *spring) {
  int found = 0;
  double root[3] = {0};
  for (int i = 0; i + 1 < spring->count && found < 3; i++) {
    if ((spring->force[i] < 0) != (spring->force[i + 1] < 0)) {
      double low = spring->first + i * spring->step;
      root[found++] = root_between(spring, low, low + spring->step);
    }
  }
  spring->contracted = root[0];
  spring->unstable = root[1];
  spring->extended = root[2];
}

void spring_make(Spring *spring, const double *force, int count, double first, double step) {
  if (count > MAX_SPRING) count = MAX_SPRING;
  spring->count = count;
  spring->first = first;
  spring->step = step;
  memcpy(spring->force, force, count * sizeof *force);
  // Thomas algorithm for the second derivatives; at the ends they equal their neighbours'.
  double upper[MAX_SPRING] = {0}, right[MAX_SPRING] = {0};
  for (int i = 1; i + 1 < count; i++) {
    double bend = 6.0 * (force[i + 1] - 2.0 * force[i] + force[i - 1]) / (step * step);
    double diagonal = i == 1 || i == count - 2 ? 5.0 : 4.0;
    double pivot = diagonal - upper[i - 1];
    upper[i] = 1.0 / pivot;
    right[i] = (bend - right[i - 1]) / pivot;
  }
  double *curvature = spring->curvature;
  curvature[count - 1] = 0;
  for (int i = count - 2; i > 0; i--) curvature[i] = right[i] - (i == count - 2 ? 0 : upper[i] * curvature[i + 1]);
  curvature[0] = curvature[1];
  curvature[count - 1] = curvature[count - 2];
  find_landmarks(spring);
}

static double end_slope(const Spring *spring, int upper_end) {
  int i = upper_end ? spring->count - 2 : 0;
  double chord = (spring->force[i + 1] - spring->force[i]) / spring->step;
  double at_end = spring->curvature[upper_end ? i + 1 : i], inside = spring->curvature[upper_end ? i : i + 1];
  return chord + (upper_end ? 1.0 : -1.0) * spring->step * (2.0 * at_end + inside) / 6.0;
}

double spring_force(const Spring *spring, double x) {
  double place = (x - spring->first) / spring->step;
  int last = spring->count - 1;
  if (!(place > 0)) return spring->force[0] + (x - spring->first) * end_slope(spring, 0);
  if (place >= last) {
    return spring->force[last] + (x - spring->first - last * spring->step) * end_slope(spring, 1);
  }
  int i = (int)place;
  double b = place - i, a = 1.0 - b, h2 = spring->step * spring->step / 6.0;
  return a * spring->force[i] + b * spring->force[i + 1] +
         ((a * a - 1.0) * a * spring->curvature[i] + (b * b - 1.0) * b * spring->curvature[i + 1]) * h2;
}

double spring_energy(const Spring *spring, double x) {
  const int panels = 400;  // Simpson's rule from the contracted state
  double from = spring->contracted, h = (x - from) / panels;
  double sum = spring_force(spring, from) + spring_force(spring, x);
  for (int i = 1; i < panels; i++) sum += (i % 2 ? 4.0 : 2.0) * spring_force(spring, from + i * h);
  return sum * h / 3.0;
}
