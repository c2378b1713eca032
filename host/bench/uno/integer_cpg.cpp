// The project's step. SETTLING: phases anew every 256 steps, so that it never rests; else as it walks.
#include "cycles.h"
#include "oscillators.h"
#include "parameters.h"

bifa::Oscillators oscillators;

int main() {
  bifa::ParameterSet set = bifa::factory_preset(0);
  set.psi12_mdeg = 204500;
  set.psi13_mdeg = 331700;
  set.duty_body_e4 = 6535;
  oscillators.use(bifa::gait_of(set));
  uint32_t random = 1;
  measure(
      [&](uint16_t n) {
        if (n % SETTLING != 0) return;
        random = random * 1664525UL + 1013904223UL;
        oscillators.place(random, random << 7, random << 13);
      },
      [] {
        oscillators.step();
        GPIOR0 = oscillators.outputs();
      });
}
