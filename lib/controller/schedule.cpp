#include "schedule.h"

namespace bifa {

bool Schedule::add(uint32_t time_ms, Chamber chamber, ChamberState state) {
  if (count_ == kScheduleEntries) return false;
  entries_[count_].time_ms = time_ms;
  entries_[count_].what = static_cast<uint8_t>(static_cast<uint8_t>(chamber) << 4 | static_cast<uint8_t>(state));
  ++count_;
  return true;
}

void Schedule::clear() {
  running_ = false;
  count_ = 0;
}

void Schedule::start() {
  now_ms_ = 0;
  next_ = 0;
  running_ = count_ > 0;
}

bool Schedule::take(Chamber& chamber, ChamberState& state) {
  if (!running_ || entries_[next_].time_ms > now_ms_) return false;
  chamber = static_cast<Chamber>(entries_[next_].what >> 4);
  state = static_cast<ChamberState>(entries_[next_].what & 0x0F);
  ++next_;
  if (next_ == count_) running_ = false;
  return true;
}

}  // namespace bifa
