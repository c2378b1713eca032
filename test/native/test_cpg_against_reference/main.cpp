// The integer oscillators against eq. (9) in double precision.
#include <stdio.h>
#include <unity.h>

#include "../../suite.h"
#include "oscillators.h"
#include "parameters.h"
#include "random.h"
#include "reference.h"

using bifa::Gait;
using bifa::gait_of;
using bifa::Oscillators;
using bifa::ParameterSet;
using reference::Triple;
using reference::Update;

namespace {

Random chance(1);

double radians(uint32_t phase) { return phase / 4294967296.0 * reference::kTurn; }

Triple phases_of(const Oscillators& oscillators) {
  return {{radians(oscillators.phase(0)), radians(oscillators.phase(1)), radians(oscillators.phase(2))}};
}

void place(Oscillators& oscillators) {
  const uint32_t body = chance.bits();
  const uint32_t head = chance.bits();
  oscillators.place(body, head, chance.bits());
}

/// The update in double precision, with two perturbed copies whose head or tail started slightly off.
class Bundle {
 public:
  void begin(const Triple& phi) {
    straight_.begin(phi);
    for (int k = 0; k < 2; ++k) nudged_[k].begin(moved(phi, k));
  }
  void begin(const reference::Gait& gait, const Triple& phi, const Triple& before) {
    straight_.begin(gait, phi, before);
    for (int k = 0; k < 2; ++k) nudged_[k].begin(gait, moved(phi, k), moved(before, k));
  }
  void step(const reference::Gait& gait) {
    straight_.step(gait);
    for (Update& one : nudged_) one.step(gait);
  }
  const Triple& phi() const { return straight_.phi(); }
  /// How much the perturbations have grown since the beginning.
  double growth() const {
    return fmax(reference::greatest_difference(phi(), nudged_[0].phi()),
                reference::greatest_difference(phi(), nudged_[1].phi())) /
           kNudge;
  }

 private:
  static Triple moved(Triple phi, int which) {
    phi.of[1 + which] += kNudge;
    return phi;
  }

  static constexpr double kNudge = 1e-6;
  Update straight_;
  Update nudged_[2];
};

/// How much a small change of the initial phases grows along a path. Near the saddles between the basins of the settled
/// states, no finite arithmetic can follow the path of another.
double growth(const ParameterSet& set, const Triple& initial, int steps) {
  const reference::Gait gait(set);
  Bundle bundle;
  bundle.begin(initial);
  double greatest = 1;
  for (int n = 0; n < steps; ++n) {
    bundle.step(gait);
    greatest = fmax(greatest, bundle.growth());
  }
  return greatest;
}

// ---- the update ----

void test_each_step_is_the_update_of_double_precision_to_a_few_microradians() {
  double greatest = 0;
  for (int trial = 0; trial < 500; ++trial) {
    const ParameterSet set = random_set(chance);
    const reference::Gait gait(set);
    Oscillators oscillators;
    oscillators.use(gait_of(set));
    place(oscillators);
    Update update;
    for (int n = 0; n < 400; ++n) {
      // Both start this step and the one before it from the integers' phases.
      const Triple before = phases_of(oscillators);
      update.begin(before);
      oscillators.step();
      update.step(gait);
      const Triple middle = phases_of(oscillators);
      Oscillators second = oscillators;
      const Triple pull_before = reference::pull(gait, before);
      const Triple pull_now = reference::pull(gait, middle);
      second.step();
      Triple expected;
      for (int i = 0; i < 3; ++i) {
        expected.of[i] = middle.of[i] + 1e-3 * (gait.omega + 1.5 * pull_now.of[i] - 0.5 * pull_before.of[i]);
      }
      greatest = fmax(greatest, reference::greatest_difference(phases_of(second), expected));
    }
  }
  printf("  a step from the same phases: off by at most %.2g rad\n", greatest);
  TEST_ASSERT_TRUE(greatest < 1e-5);
}

/// Near a saddle any difference grows without bound, even between two roundings. So the reference is restarted from the
/// integers' phases wherever a perturbation of the path has doubled, and no step of any path is left out.
void test_paths_stay_within_2e_4_rad_of_the_update_in_double_precision() {
  const int kSets = 400, kSteps = 4000;
  double greatest_whole = 0, greatest_parted = 0;
  int whole = 0, beginnings = 0;
  for (int trial = 0; trial < kSets; ++trial) {
    const ParameterSet set = random_set(chance);
    const reference::Gait gait(set);
    Oscillators oscillators;
    oscillators.use(gait_of(set));
    place(oscillators);
    Triple now = phases_of(oscillators);
    Bundle bundle;
    bundle.begin(now);
    double greatest = 0;
    bool is_whole = true;
    for (int n = 0; n < kSteps; ++n) {
      const Triple before = now;
      oscillators.step();
      bundle.step(gait);
      now = phases_of(oscillators);
      greatest = fmax(greatest, reference::greatest_difference(now, bundle.phi()));
      if (bundle.growth() <= 2) continue;
      bundle.begin(gait, now, before);
      is_whole = false;
      ++beginnings;
    }
    whole += is_whole;
    double& among = is_whole ? greatest_whole : greatest_parted;
    among = fmax(among, greatest);
  }
  printf("  %d whole paths: off by at most %.2g rad; %d beside a saddle, begun anew %.1f times each: %.2g rad\n", whole,
         greatest_whole, kSets - whole, beginnings / fmax(1, kSets - whole), greatest_parted);
  TEST_ASSERT_TRUE(greatest_whole <= 2e-4);
  TEST_ASSERT_TRUE(greatest_parted <= 2e-4);
  TEST_ASSERT_TRUE(beginnings < kSets);  // a reference that is always restarted would prove nothing
}

void test_parameters_may_change_at_any_step_without_a_jump() {
  double greatest = 0;
  for (int trial = 0; trial < 100; ++trial) {
    ParameterSet set = random_set(chance);
    Oscillators oscillators;
    oscillators.use(gait_of(set));
    oscillators.settle();
    for (int change = 0; change < 20; ++change) {
      const Triple before = phases_of(oscillators);
      change_one(set, chance);
      oscillators.use(gait_of(set));
      TEST_ASSERT_TRUE(reference::greatest_difference(before, phases_of(oscillators)) < 1e-8);
      const reference::Gait gait(set);
      Update update;
      update.begin(before);
      for (uint32_t n = chance.below(30); n > 0; --n) {
        oscillators.step();
        update.step(gait);
        greatest = fmax(greatest, reference::greatest_difference(phases_of(oscillators), update.phi()));
      }
    }
  }
  TEST_ASSERT_TRUE(greatest <= 2e-4);
}

// ---- the exact solution ----

void test_transient_is_ten_times_closer_to_the_exact_solution_than_forward_euler() {
  double ours = 0, euler = 0;
  for (int trial = 0; trial < 200; ++trial) {
    ParameterSet set = random_set(chance);
    set.coupling_milli_per_s = 10000;
    const reference::Gait gait(set);
    Oscillators oscillators;
    oscillators.use(gait_of(set));
    place(oscillators);
    Triple exact = phases_of(oscillators);
    if (growth(set, exact, 1500) > 3) continue;
    Triple simple = exact;
    for (int n = 0; n < 1500; ++n) {
      oscillators.step();
      reference::solve(gait, exact);
      const Triple slope = reference::pull(gait, simple);
      for (int i = 0; i < 3; ++i) simple.of[i] += 1e-3 * (gait.omega + slope.of[i]);
      ours = fmax(ours, reference::greatest_difference(phases_of(oscillators), exact));
      euler = fmax(euler, reference::greatest_difference(simple, exact));
    }
  }
  printf("  transient at coupling 10: %.2g rad, forward Euler %.2g rad\n", ours, euler);
  TEST_ASSERT_TRUE(ours < 1e-3);
  TEST_ASSERT_TRUE(euler > 10 * ours);
}

void test_settled_phases_are_within_1e_3_rad_of_the_exact_ones() {
  double greatest = 0;
  for (int trial = 0; trial < 300; ++trial) {
    ParameterSet set = random_set(chance);
    if (set.coupling_milli_per_s < 1000) set.coupling_milli_per_s = 1000;
    const reference::Gait gait(set);
    Oscillators oscillators;
    oscillators.use(gait_of(set));
    place(oscillators);
    for (int n = 0; n < 20000; ++n) oscillators.step();
    const Triple phi = phases_of(oscillators);
    greatest = fmax(greatest, fabs(reference::difference(phi.of[1] - phi.of[0], gait.psi12)));
    greatest = fmax(greatest, fabs(reference::difference(phi.of[2] - phi.of[0], gait.psi13)));
  }
  printf("  settled: off by at most %.2g rad\n", greatest);
  TEST_ASSERT_TRUE(greatest < 1e-3);
}

void test_without_coupling_each_oscillator_runs_on_its_own() {
  ParameterSet set = random_set(chance);
  set.coupling_milli_per_s = 0;
  Oscillators oscillators;
  oscillators.use(gait_of(set));
  place(oscillators);
  const uint32_t head = oscillators.phase(1) - oscillators.phase(0);
  const uint32_t tail = oscillators.phase(2) - oscillators.phase(0);
  for (int n = 0; n < 100000; ++n) oscillators.step();
  TEST_ASSERT_TRUE(head == oscillators.phase(1) - oscillators.phase(0));
  TEST_ASSERT_TRUE(tail == oscillators.phase(2) - oscillators.phase(0));
}

void test_period_is_within_10_ppm() {
  double greatest_ppm = 0;
  for (int trial = 0; trial < 2000; ++trial) {
    const ParameterSet set = random_set(chance);
    const double period_us = 4294967296.0 / (gait_of(set).increment + gait_of(set).increment_fraction / 256.0) * 1000;
    greatest_ppm = fmax(greatest_ppm, fabs(period_us / set.period_us - 1) * 1e6);
  }
  printf("  period: off by at most %.2g ppm\n", greatest_ppm);
  TEST_ASSERT_TRUE(greatest_ppm < 0.1);  // 10 are required
}

void test_mean_of_the_phases_runs_at_exactly_f_whatever_the_coupling_does() {
  for (int trial = 0; trial < 50; ++trial) {
    Oscillators oscillators;
    const Gait gait = gait_of(random_set(chance));
    oscillators.use(gait);
    place(oscillators);
    const uint32_t sum = oscillators.phase(0) + oscillators.phase(1) + oscillators.phase(2);
    for (int n = 0; n < 1000; ++n) oscillators.step();
    const uint32_t expected = sum + 3 * (1000 * gait.increment + 1000 * gait.increment_fraction / 256);
    TEST_ASSERT_TRUE(expected == oscillators.phase(0) + oscillators.phase(1) + oscillators.phase(2));
  }
}

// ---- switching ----

/// Follows settled oscillators for some cycles; returns the greatest deviation (ms) of a switch from the instant at
/// which the exact phase passes the threshold or a full turn, and checks that there are two switches per cycle.
double worst_switch_ms(const ParameterSet& set) {
  const reference::Gait exact(set);
  const double duty[3] = {set.duty_body_e4 * 1e-4, set.duty_head_e4 * 1e-4, set.duty_tail_e4 * 1e-4};
  const double psi[3] = {0, exact.psi12, exact.psi13};
  Oscillators oscillators;
  oscillators.use(gait_of(set));
  oscillators.settle();
  oscillators.step();
  uint8_t last = oscillators.outputs();
  double worst = 0;
  int switches[3] = {0, 0, 0};
  const int cycles = 3;
  const long steps = lround(cycles * set.period_us * 1e-3);
  for (long n = 1; n <= steps; ++n) {
    oscillators.step();
    const uint8_t changed = last ^ oscillators.outputs();
    last = oscillators.outputs();
    for (int i = 0; i < 3; ++i) {
      if (!(changed >> i & 1)) continue;
      ++switches[i];
      const double now = exact.omega * (n + 1) * 1e-3 + psi[i];  // after n + 1 steps
      const double edge = last >> i & 1 ? duty[i] * reference::kTurn : 0;
      worst = fmax(worst, fabs(reference::difference(now, edge)) / exact.omega * 1e3);
    }
  }
  for (int i = 0; i < 3; ++i) TEST_ASSERT_INT_WITHIN(1, 2 * cycles, switches[i]);
  return worst;
}

void test_settled_valves_switch_within_a_millisecond_of_the_exact_solution() {
  double worst_ms = 0;
  for (int trial = 0; trial < 150; ++trial) {
    ParameterSet set = random_set(chance);
    set.duty_body_e4 = 100 + chance.below(9800);
    set.duty_head_e4 = 100 + chance.below(9800);
    set.duty_tail_e4 = 100 + chance.below(9800);
    worst_ms = fmax(worst_ms, worst_switch_ms(set));
  }
  printf("  switches: off by at most %.2g ms\n", worst_ms);
  TEST_ASSERT_TRUE(worst_ms <= 1);
}

void test_valves_that_settled_from_anywhere_switch_within_a_millisecond_too() {
  double worst_ms = 0;
  for (int trial = 0; trial < 60; ++trial) {
    ParameterSet set = random_set(chance);
    set.coupling_milli_per_s = 5000 + chance.below(15001);
    const reference::Gait gait(set);
    Oscillators oscillators;
    oscillators.use(gait_of(set));
    place(oscillators);
    Triple exact = phases_of(oscillators);
    if (growth(set, exact, 3000) > 100) continue;
    for (int n = 0; n < 10000; ++n) {
      oscillators.step();
      reference::solve(gait, exact);
    }
    const Triple phi = phases_of(oscillators);
    worst_ms = fmax(worst_ms, reference::greatest_difference(phi, exact) / gait.omega * 1e3);
  }
  printf("  settled from anywhere: off by at most %.2g ms of the period's time\n", worst_ms);
  TEST_ASSERT_TRUE(worst_ms <= 1);
}

// ---- a day ----

void test_after_a_day_the_phase_differences_are_those_asked_for() {
  ParameterSet set = bifa::factory_preset(0);
  set.period_us = 2720000;
  set.psi12_mdeg = 204500;
  set.psi13_mdeg = 331700;
  const reference::Gait gait(set);
  Oscillators oscillators;
  const Gait integers = gait_of(set);
  oscillators.use(integers);
  oscillators.place(0, 0x40000000, 0x90000000);
  const uint32_t sum = oscillators.phase(0) + oscillators.phase(1) + oscillators.phase(2);
  const uint32_t day_ms = 24UL * 3600 * 1000;
  for (uint32_t n = 0; n < day_ms; ++n) oscillators.step();
  const Triple phi = phases_of(oscillators);
  TEST_ASSERT_TRUE(fabs(reference::difference(phi.of[1] - phi.of[0], gait.psi12)) < 1e-3);
  TEST_ASSERT_TRUE(fabs(reference::difference(phi.of[2] - phi.of[0], gait.psi13)) < 1e-3);
  const uint32_t carries = static_cast<uint32_t>(static_cast<uint64_t>(day_ms) * integers.increment_fraction / 256);
  const uint32_t expected = sum + 3 * (day_ms * integers.increment + carries);
  TEST_ASSERT_TRUE(expected == oscillators.phase(0) + oscillators.phase(1) + oscillators.phase(2));
}

void run() {
  RUN_TEST(test_each_step_is_the_update_of_double_precision_to_a_few_microradians);
  RUN_TEST(test_paths_stay_within_2e_4_rad_of_the_update_in_double_precision);
  RUN_TEST(test_parameters_may_change_at_any_step_without_a_jump);
  RUN_TEST(test_transient_is_ten_times_closer_to_the_exact_solution_than_forward_euler);
  RUN_TEST(test_settled_phases_are_within_1e_3_rad_of_the_exact_ones);
  RUN_TEST(test_without_coupling_each_oscillator_runs_on_its_own);
  RUN_TEST(test_period_is_within_10_ppm);
  RUN_TEST(test_mean_of_the_phases_runs_at_exactly_f_whatever_the_coupling_does);
  RUN_TEST(test_settled_valves_switch_within_a_millisecond_of_the_exact_solution);
  RUN_TEST(test_valves_that_settled_from_anywhere_switch_within_a_millisecond_too);
  RUN_TEST(test_after_a_day_the_phase_differences_are_those_asked_for);
}

}  // namespace

void setUp() {}
void tearDown() {}

RUN_SUITE(run)
