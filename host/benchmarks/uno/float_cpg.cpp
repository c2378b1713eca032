// The same in float, as a sketch would write eq. (9) and (10): three sines a step.
#include <math.h>

#include "cycles.h"

namespace {

const float kTurn = 6.2831853f;
const float kStep_s = 1e-3f;
const float kOmega = kTurn / 5.7f;
const float kCoupling = 10;
const float kPsi12 = 3.5692f;
const float kPsi13 = 5.7893f;
const float kThreshold[3] = {0.6535f * kTurn, 0.5f * kTurn, 0.5f * kTurn};

float phi[3] = {0, 1, 4};

void step() {
  const float s12 = sin(phi[1] - phi[0] - kPsi12);
  const float s13 = sin(phi[2] - phi[0] - kPsi13);
  const float s23 = sin(phi[2] - phi[1] - (kPsi13 - kPsi12));
  const float pull[3] = {s12 + s13, s23 - s12, -s13 - s23};
  uint8_t outputs = 0;
  for (uint8_t i = 0; i < 3; ++i) {
    phi[i] += kStep_s * (kOmega + kCoupling * pull[i]);
    if (phi[i] >= kTurn) phi[i] -= kTurn;
    if (phi[i] < 0) phi[i] += kTurn;
    if (phi[i] > kThreshold[i]) outputs |= 1 << i;
  }
  GPIOR0 = outputs;
}

}  // namespace

int main() {
  measure([](uint16_t) {}, step);
}
