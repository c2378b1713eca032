// Parameters by name or number: read, write, check.
#pragma once

#include "parameter_table.h"

namespace bifa {

/// The description of a parameter, in flash.
inline const ParameterDescriptor& descriptor(ParameterId id) { return kParameterDescriptors[static_cast<uint8_t>(id)]; }

enum class ParameterText : uint8_t { kName, kUnit, kHelp };
FlashText text_of(ParameterId id, ParameterText which);

/// Bounds of a parameter's value in wire units.
uint32_t minimum_of(ParameterId id);
uint32_t maximum_of(ParameterId id);

/// Value of one parameter in wire units.
uint32_t value_of(const ParameterSet& set, ParameterId id);

/// Sets a value (wire units), which must lie within its range.
void put_value(ParameterSet& set, ParameterId id, uint32_t value);

/// Whether a value (wire units) lies within the parameter's range.
bool in_range(ParameterId id, uint32_t value);

/// Finds a parameter by its name; false if there is none.
bool find_parameter(const char* name, ParameterId& id);

/// Whether every field lies within its range. Check every set from outside with it (wire, EEPROM).
bool is_valid(const ParameterSet& set);

/// The factory preset number `index` (0 is the baseline).
ParameterSet factory_preset(uint8_t index);

/// Finds a factory preset by its name; false if there is none.
bool find_factory_preset(const char* name, ParameterSet& set);

}  // namespace bifa
