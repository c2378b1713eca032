// The project's step. The phases are thrown off every SETTLING steps: seldom, and it rests in between; often, and it never does.
#include "cycles.h"
#include "oscillators.h"
#include "parameters.h"

bifa::Oscillators oscillators;

// Apart, so that they leave the registers to the step, as the tick does.
__attribute__((noinline)) void begin() {
  bifa::ParameterSet set = bifa::factory_preset(0);
  set.psi12_mdeg = 204500;
  set.psi13_mdeg = 331700;
  set.duty_body_e4 = 6535;
  oscillators.use(bifa::gait_of(set));
}

__attribute__((noinline)) void throw_off() {
  static uint32_t random = 1;
  random = random * 1664525UL + 1013904223UL;
  oscillators.place(random, random << 7, random << 13);
}

int main() {
  begin();
  measure(
      [](uint16_t n) {
        if (n % SETTLING == 0) throw_off();
      },
      [] {
        oscillators.step();
        GPIOR0 = oscillators.outputs();
      });
}
