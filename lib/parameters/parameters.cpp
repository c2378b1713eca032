#include "parameters.h"

namespace bifa {

FlashText text_of(ParameterId id, ParameterText which) {
  const uint8_t kTexts = 3;
  return flash_text(kParameterTexts, static_cast<uint8_t>(id) * kTexts + static_cast<uint8_t>(which));
}

uint32_t minimum_of(ParameterId id) { return flash_long(&descriptor(id).minimum); }
uint32_t maximum_of(ParameterId id) { return flash_long(&descriptor(id).maximum); }

uint32_t value_of(const ParameterSet& set, ParameterId id) {
  uint32_t value = 0;
  memcpy(&value, reinterpret_cast<const uint8_t*>(&set) + flash_byte(&descriptor(id).offset),
         flash_byte(&descriptor(id).width));
  return value;
}

void put_value(ParameterSet& set, ParameterId id, uint32_t value) {
  memcpy(reinterpret_cast<uint8_t*>(&set) + flash_byte(&descriptor(id).offset), &value,
         flash_byte(&descriptor(id).width));
}

bool in_range(ParameterId id, uint32_t value) { return value >= minimum_of(id) && value <= maximum_of(id); }

bool find_parameter(const char* name, ParameterId& id) {
  for (uint8_t i = 0; i < kParameterCount; ++i) {
    id = static_cast<ParameterId>(i);
    if (flash_equal(name, reinterpret_cast<const char*>(text_of(id, ParameterText::kName)))) return true;
  }
  return false;
}

bool is_valid(const ParameterSet& set) {
  for (uint8_t i = 0; i < kParameterCount; ++i) {
    const ParameterId id = static_cast<ParameterId>(i);
    if (!in_range(id, value_of(set, id))) return false;
  }
  return true;
}

ParameterSet factory_preset(uint8_t index) {
  ParameterSet set;
  flash_copy(&set, &kFactoryPresets[index].set, sizeof set);
  return set;
}

bool find_factory_preset(const char* name, ParameterSet& set) {
  for (uint8_t i = 0; i < kFactoryPresetCount; ++i) {
    if (!flash_equal(name, kFactoryPresets[i].name)) continue;
    set = factory_preset(i);
    return true;
  }
  return false;
}

}  // namespace bifa
