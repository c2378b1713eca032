#include "commands.h"

#include "crc.h"

namespace bifa {

const char kStartPreset[kNameSize + 1] = "startup";

namespace {

/// Results in the order of Verdict.
const Result kResults[] BIFA_FLASH = {
    Result::kOk,   Result::kLatched, Result::kRefused, Result::kFault,
    Result::kFull, Result::kOrder,   Result::kUnrest,  Result::kOffset,
};
static_assert(sizeof kResults == static_cast<uint8_t>(Verdict::kOffset) + 1, "one for each verdict");

__attribute__((noinline)) Result result_of(Verdict verdict) {
  return static_cast<Result>(flash_byte(&kResults[static_cast<uint8_t>(verdict)]));
}

bool is_hold(uint8_t chamber, uint8_t state) {
  return chamber < kChamberCount && state <= static_cast<uint8_t>(ChamberState::kPositive);
}

static_assert(sizeof(Calibration) <= sizeof(ParameterSet), "the settings fit a record");

}  // namespace

void Commands::begin(StartCause cause) {
  store_.begin();
  running_ = wanted_ = at_power_up();
  controller_.begin(cause, wanted_, calibration_at_power_up());
}

void Commands::poll() {
  const bool was_busy = store_.busy();
  store_.poll();
  if (!was_busy || store_.busy()) return;
  controller_.calibrate(calibration_at_power_up());
  if (erasing_ && store_.result() == Result::kOk) take_over_soon(factory_preset(0));
  erasing_ = false;
}

ParameterSet Commands::at_power_up() {
  ParameterSet set;
  if (!store_.load(kStartPreset, set)) set = factory_preset(0);
  return set;
}

Calibration Commands::calibration_at_power_up() {
  uint8_t payload[sizeof(ParameterSet)];
  if (!store_.load_settings(payload)) return {};
  Calibration calibration;
  memcpy(&calibration, payload, sizeof calibration);
  return is_valid(calibration) ? calibration : Calibration{};
}

Result Commands::run() {
  // A set may still be waiting for a cycle boundary of the previous walk, if no sample has been taken since it ended.
  if (pending_ && controller_.state() != State::kRunning) use(wanted_);
  return result_of(controller_.run());
}

Result Commands::stop() { return result_of(controller_.stop()); }
Result Commands::clear() { return result_of(controller_.clear()); }

Result Commands::hold(uint8_t chamber, uint8_t state) {
  if (!is_hold(chamber, state)) return Result::kRange;
  return result_of(controller_.hold(static_cast<Chamber>(chamber), static_cast<ChamberState>(state)));
}

Result Commands::schedule_clear() {
  schedule_spoilt_ = false;
  return result_of(controller_.schedule_clear());
}

Result Commands::schedule_add(uint32_t time_ms, uint8_t chamber, uint8_t state) {
  if (schedule_spoilt_) return Result::kTransaction;
  const Result result = is_hold(chamber, state)
                            ? result_of(controller_.schedule_add(time_ms, static_cast<Chamber>(chamber),
                                                                 static_cast<ChamberState>(state)))
                            : Result::kRange;
  schedule_spoilt_ = result != Result::kOk;
  return result;
}

Result Commands::schedule_start() {
  if (schedule_spoilt_) return Result::kTransaction;
  return result_of(controller_.schedule_start());
}

void Commands::abandon() {
  draft_state_ = Draft::kNone;
  erasing_ = false;
  schedule_clear();
}

void Commands::use(const ParameterSet& set) {
  running_ = wanted_ = set;
  pending_ = false;
  controller_.apply(running_);
}

Result Commands::take_over_soon(const ParameterSet& set) {
  if (controller_.state() != State::kRunning) {
    use(set);
  } else {
    wanted_ = set;
    pending_ = true;
  }
  return Result::kOk;
}

void Commands::follow(const Sample& sample) {
  const uint16_t kQuarter = 0x4000;
  const uint16_t phase = sample.phase[0];
  const bool boundary = phase < kQuarter && last_phase_ >= 3 * kQuarter;
  last_phase_ = phase;
  if (pending_ && (boundary || sample.state != State::kRunning)) use(wanted_);
}

Result Commands::set(ParameterId id, uint32_t value) {
  if (!in_range(id, value)) return Result::kRange;
  put_value(wanted_, id, value);
  put_value(running_, id, value);
  controller_.apply(running_);
  return Result::kOk;
}

Result Commands::begin_set() {
  draft_ = wanted_;
  draft_state_ = Draft::kOpen;
  return Result::kOk;
}

Result Commands::field(uint8_t parameter, uint32_t value) {
  if (draft_state_ != Draft::kOpen) return Result::kTransaction;
  const ParameterId id = static_cast<ParameterId>(parameter);
  const Result result = parameter >= kParameterCount ? Result::kNoParameter
                        : in_range(id, value)        ? Result::kOk
                                                     : Result::kRange;
  if (result == Result::kOk) {
    put_value(draft_, id, value);
  } else {
    draft_state_ = Draft::kSpoilt;
  }
  return result;
}

Result Commands::commit(uint16_t check) {
  const bool open = draft_state_ == Draft::kOpen;
  draft_state_ = Draft::kNone;
  if (!open) return Result::kTransaction;
  if (crc16(&draft_, sizeof draft_) != check) return Result::kCheck;
  if (!is_valid(draft_)) return Result::kRange;
  return take_over_soon(draft_);
}

Result Commands::save(const char* name) { return store_.save(name, wanted_); }

Result Commands::load(const char* name) {
  ParameterSet set;
  if (!find_factory_preset(name, set) && !(is_name(name) && store_.load(name, set))) return Result::kNoPreset;
  return take_over_soon(set);
}

Result Commands::forget(const char* name) { return store_.forget(name); }

Result Commands::defaults() {
  const Result result = store_.erase_all();
  if (result == Result::kOk) erasing_ = true;
  return result;
}

Result Commands::zero(bool factory) {
  Calibration calibration = {};
  if (!factory) {
    const Result result = result_of(controller_.measure_zero(calibration));
    if (result != Result::kOk) return result;
  }
  uint8_t payload[sizeof(ParameterSet)] = {};
  memcpy(payload, &calibration, sizeof calibration);
  return store_.save_settings(payload);
}

bool Commands::preset_at(uint8_t index, char* name, bool& stored) {
  stored = index >= kFactoryPresetCount;
  if (stored) return store_.name_at(index - kFactoryPresetCount, name);
  memset(name, 0, kNameSize + 1);
  flash_copy(name, kFactoryPresets[index].name, sizeof kFactoryPresets[index].name);
  return true;
}

uint8_t Commands::preset_count() { return kFactoryPresetCount + store_.count(); }

}  // namespace bifa
