// Timed holds, executed on the tick.
#pragma once

#include "chamber.h"
#include "constants.h"

namespace bifa {

class Schedule {
 public:
  /// False if there is no room left.
  bool add(uint32_t time_ms, Chamber chamber, ChamberState state);
  void clear();
  /// Whether `time_ms` may come after what is there.
  bool in_order(uint32_t time_ms) const { return count_ == 0 || time_ms >= entries_[count_ - 1].time_ms; }

  /// Time 0 is the next tick.
  void start();
  void stop() { running_ = false; }
  bool running() const { return running_; }
  /// Every millisecond, and as long as it returns true: takes what is due. After the last entry it stops by itself.
  bool take(Chamber& chamber, ChamberState& state);
  void tick() { ++now_ms_; }

 private:
  struct Entry {
    uint32_t time_ms;
    uint8_t what;  ///< chamber in the upper half, state in the lower: memory is short
  };

  Entry entries_[kScheduleEntries] = {};
  uint8_t count_ = 0;
  uint8_t next_ = 0;
  uint32_t now_ms_ = 0;
  bool running_ = false;
};

}  // namespace bifa
