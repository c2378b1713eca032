#include "supply_watch.h"

#include "sensor.h"
#include "sensor_watch.h"

namespace bifa {

namespace {
const uint16_t kConnected_ms = 1000;  ///< an open input wanders; it hardly stays in the band for so long
}

bool RegulatorWatch::look(uint16_t conversion, uint16_t set_point_mpsi) {
  if (present_.met(conversion >= kMonitorAbsent, kConnected_ms / kSamplePeriod_ms)) connected_ = true;
  const int32_t deviation = static_cast<int32_t>(monitor_mpsi(conversion)) - set_point_mpsi;
  deviates_ = connected_ && (deviation > kMonitorTolerance_mpsi + kMonitorHighAtLowSupply_mpsi ||
                             deviation < -kMonitorTolerance_mpsi - kMonitorLowAtHighSupply_mpsi);
  return deviating_.met(deviates_, 1, kMonitorTime_ms / kSamplePeriod_ms);
}

}  // namespace bifa
