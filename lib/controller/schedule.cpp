#include "schedule.h"

namespace bifa {

bool Schedule::add(uint32_t time_ms, Chamber chamber, ChamberState state) {
  if (count_ == kCapacity) return false;
  entries_[count_] = {time_ms, chamber, state};
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
  chamber = entries_[next_].chamber;
  state = entries_[next_].state;
  ++next_;
  if (next_ == count_) running_ = false;
  return true;
}

}  // namespace bifa
