// Timed holds, executed on the tick.
#pragma once

#include "chamber.h"
#include "constants.h"

namespace bifa {

class Schedule {
 public:
  /// Appends an entry; returns false if there is no room left.
  bool add(uint32_t time_ms, Chamber chamber, ChamberState state);
  void clear();
  /// Whether an entry at `time_ms` may be appended.
  bool in_order(uint32_t time_ms) const { return count_ == 0 || time_ms >= entries_[count_ - 1].time_ms; }

  /// Starts the schedule; time 0 is the next tick.
  void start();
  void stop() { running_ = false; }
  bool running() const { return running_; }
  /// Takes the next entry that is due; call every millisecond until it returns false. Stops after the last entry.
  bool take(Chamber& chamber, ChamberState& state);
  void tick() { ++now_ms_; }

 private:
  struct Entry {
    uint32_t time_ms;
    uint8_t what;  ///< chamber in the upper half, state in the lower, to save memory
  };

  Entry entries_[kScheduleEntries] = {};
  uint8_t count_ = 0;
  uint8_t next_ = 0;
  uint32_t now_ms_ = 0;
  bool running_ = false;
};

}  // namespace bifa
