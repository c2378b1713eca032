#include "parameters.h"

namespace bifa {

ParameterDescriptor descriptor(ParameterId id) {
  ParameterDescriptor row;
  flash_copy(&row, &kParameterDescriptors[static_cast<uint8_t>(id)], sizeof row);
  return row;
}

uint32_t value_of(const ParameterSet& set, ParameterId id) {
  const ParameterDescriptor row = descriptor(id);
  uint32_t value = 0;
  memcpy(&value, reinterpret_cast<const uint8_t*>(&set) + row.offset, row.width);
  return value;
}

void put_value(ParameterSet& set, ParameterId id, uint32_t value) {
  const ParameterDescriptor row = descriptor(id);
  memcpy(reinterpret_cast<uint8_t*>(&set) + row.offset, &value, row.width);
}

bool in_range(ParameterId id, uint32_t value) {
  const ParameterDescriptor row = descriptor(id);
  return value >= row.minimum && value <= row.maximum;
}

bool find_parameter(const char* name, ParameterId& id) {
  for (uint8_t i = 0; i < kParameterCount; ++i) {
    id = static_cast<ParameterId>(i);
    if (strcmp(name, descriptor(id).name) == 0) return true;
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
    FactoryPreset preset;
    flash_copy(&preset, &kFactoryPresets[i], sizeof preset);
    if (strcmp(name, preset.name) != 0) continue;
    set = preset.set;
    return true;
  }
  return false;
}

}  // namespace bifa
