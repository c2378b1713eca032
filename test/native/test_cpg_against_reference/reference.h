// Eq. (9) in double precision, for comparison only: the exact solution, and the integer oscillators' update.
#pragma once

#include <math.h>

#include "parameter_table.h"

namespace reference {

const double kTurn = 2 * M_PI;

/// The paper's parameters in SI.
struct Gait {
  double omega;  ///< 2 pi f, rad/s
  double coupling;
  double psi12;
  double psi13;

  explicit Gait(const bifa::ParameterSet& set)
      : omega(kTurn * 1e6 / set.period_us),
        coupling(set.coupling_milli_per_s * 1e-3),
        psi12(set.psi12_mdeg / 360e3 * kTurn),
        psi13(set.psi13_mdeg / 360e3 * kTurn) {}
};

/// Three phases, or their derivatives; not wrapped.
struct Triple {
  double of[3];
};

inline Triple plus(const Triple& a, double factor, const Triple& b) {
  Triple sum;
  for (int i = 0; i < 3; ++i) sum.of[i] = a.of[i] + factor * b.of[i];
  return sum;
}

/// Right-hand side of eq. (9), rad/s, without the common 2 pi f.
inline Triple pull(const Gait& gait, const Triple& phi) {
  const double psi[3][3] = {{0, gait.psi12, gait.psi13},
                            {-gait.psi12, 0, gait.psi13 - gait.psi12},
                            {-gait.psi13, -(gait.psi13 - gait.psi12), 0}};
  Triple sum = {{0, 0, 0}};
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      if (j != i) sum.of[i] += gait.coupling * sin(phi.of[j] - phi.of[i] - psi[i][j]);
    }
  }
  return sum;
}

/// Advances the exact solution by a millisecond (fourth-order Runge-Kutta in four steps: error below 1e-9).
inline void solve(const Gait& gait, Triple& phi) {
  const double h = 0.25e-3;
  for (int part = 0; part < 4; ++part) {
    const Triple a = pull(gait, phi);
    const Triple b = pull(gait, plus(phi, h / 2, a));
    const Triple c = pull(gait, plus(phi, h / 2, b));
    const Triple d = pull(gait, plus(phi, h, c));
    for (int i = 0; i < 3; ++i) {
      phi.of[i] += h * (gait.omega + (a.of[i] + 2 * b.of[i] + 2 * c.of[i] + d.of[i]) / 6);
    }
  }
}

/// The second-order Adams-Bashforth update of the integer oscillators, in double precision.
class Update {
 public:
  void begin(const Triple& phi) {
    phi_ = phi;
    begun_ = false;
  }
  /// Starts in the middle of a path that was at `before` a step ago.
  void begin(const Gait& gait, const Triple& phi, const Triple& before) {
    phi_ = phi;
    last_ = pull(gait, before);
    begun_ = true;
  }

  void step(const Gait& gait) {
    const double h = 1e-3;
    const Triple now = pull(gait, phi_);
    if (!begun_) last_ = now;
    begun_ = true;
    for (int i = 0; i < 3; ++i) phi_.of[i] += h * (gait.omega + 1.5 * now.of[i] - 0.5 * last_.of[i]);
    last_ = now;
  }
  const Triple& phi() const { return phi_; }

 private:
  Triple phi_;
  Triple last_;
  bool begun_ = false;
};

/// Difference of two angles, wrapped into (-pi, pi].
inline double difference(double a, double b) { return remainder(a - b, kTurn); }

inline double greatest_difference(const Triple& a, const Triple& b) {
  double greatest = 0;
  for (int i = 0; i < 3; ++i) greatest = fmax(greatest, fabs(difference(a.of[i], b.of[i])));
  return greatest;
}

}  // namespace reference
